"""Formatters, linter and type checker have nothing to say about any file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

PROGRAMS = Path(sys.executable).parent


def check(*command: str) -> None:
    if not (PROGRAMS / command[0]).exists():
        pytest.skip(f"{command[0]} is not installed beside Python")
    done = subprocess.run([PROGRAMS / command[0], *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_ruff_finds_nothing() -> None:
    check("ruff", "check")


def test_python_is_formatted() -> None:
    check("ruff", "format", "--check")


def test_types_are_right() -> None:
    check("mypy")


def test_cpp_is_formatted() -> None:
    sources = [
        str(path) for folder in ("runtime", "ops_library", "benchmarks") for path in (ROOT / folder).rglob("*.?pp")
    ]
    check("clang-format", "--dry-run", "-Werror", *sources)
