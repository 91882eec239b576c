"""The C++ unit tests of the runtime, runtime/cpp/tests/test_*.cpp, one test each."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

NAMES = sorted(file.stem for file in (Path(__file__).parents[1] / "runtime" / "cpp" / "tests").glob("test_*.cpp"))


@pytest.mark.parametrize("name", NAMES)
def test_unit(name: str, runtime_tool: Callable[[str], Path], tmp_path: Path) -> None:
    program = runtime_tool(name)
    done = subprocess.run(
        [str(program)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(tmp_path)},
        timeout=900,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-20_000:]
    assert "0 failed" in done.stdout, done.stdout[-20_000:]
