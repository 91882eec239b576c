"""The C++ unit tests of the runtime, runtime/cpp/tests/test_*.cpp, one test each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

NAMES = sorted(file.stem for file in (Path(__file__).parents[1] / "runtime" / "cpp" / "tests").glob("test_*.cpp"))


@pytest.mark.parametrize("name", NAMES)
def test_unit(name: str, unit_test: Callable[..., None]) -> None:
    unit_test(name)
