"""Texts on which the compiler once failed, or that reach odd corners of it. `fuzz.py` finds more."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.fuzz.target import check

CORPUS = Path(__file__).parent / "corpus"
SECONDS = 5


@pytest.mark.parametrize("path", sorted(CORPUS.iterdir()), ids=lambda p: p.stem)
def test_text(path: Path) -> None:
    begin = time.process_time()
    check(path.read_bytes().decode("utf-8", "replace"))
    assert time.process_time() - begin < SECONDS
