"""How long checking may take. Limits are twice the goals (2 s and 5 s), as other programs slow a machine down."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from lnc.cli import main
from tests.large_networks import network

NOISE = 2


def test_a_hundred_networks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`lnc check` of 100 networks of 30 operators in one process: 1.5 s on a quiet machine."""
    paths = [tmp_path / f"n{i}.ln" for i in range(100)]
    for seed, path in enumerate(paths):
        path.write_text(network(30, seed))
    begin = time.process_time()
    assert main(["check", *map(str, paths)]) == 0
    assert time.process_time() - begin < 2 * NOISE
    assert capsys.readouterr().out == "100 networks checked: all fine\n"


def test_a_thousand_operators(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A network of 1,000 operators, 379 of which are pull cycles, is counted path by path: 0.8 s."""
    text = network(1000, 1)
    (tmp_path / "large.ln").write_text(text)
    assert len(re.findall(r"^\w+ +=", text, re.MULTILINE)) > 990 and len(re.findall("^r_", text, re.MULTILINE)) == 379
    begin = time.process_time()
    assert main(["check", str(tmp_path / "large.ln")]) == 0
    assert time.process_time() - begin < 5 * NOISE
    assert capsys.readouterr().out == "1 network checked: all fine\n"


def test_light_that_a_large_network_counts_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A fault is found and explained in the same time: one wire too much in the picture."""
    text = network(1000, 1)
    (tmp_path / "large.ln").write_text(text.replace("image ", "image w_D + "))
    begin = time.process_time()
    assert main(["check", str(tmp_path / "large.ln")]) == 1
    assert time.process_time() - begin < 5 * NOISE
    assert "error[LN0301]" in capsys.readouterr().err
