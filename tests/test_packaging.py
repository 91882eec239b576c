"""An installed `lnc` works from any folder without the checkout, and what it compiles works without `lnc`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from conftest import ROOT, SCENES


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds what the wheel installs."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as wheel:
        wheel.extractall(folder / "site")
    return folder / "site"


def lnc(installed: Path, folder: Path, *arguments: str) -> str:
    (folder / "net.ln").write_text((ROOT / "examples" / "direct.ln").read_text())
    environment = {**os.environ, "PYTHONPATH": str(installed), "LNC_CACHE": str(folder / "cache")}
    command = [sys.executable, "-P", "-m", "lnc", *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert str(ROOT) not in done.stdout.replace(sys.executable, "")
    return done.stdout


def test_everything_but_compile(installed: Path, tmp_path: Path) -> None:
    assert "all fine" in lnc(installed, tmp_path, "check", "net.ln")
    assert "direct" in lnc(installed, tmp_path, "explain", "net.ln")
    assert "NNDensity" in lnc(installed, tmp_path, "ops")
    assert "LN0402" in lnc(installed, tmp_path, "explain", "LN0402")
    assert str(installed) in lnc(installed, tmp_path, "doctor")
    lnc(installed, tmp_path, "compile", "net.ln", "--emit-cpp", "net.cpp")
    assert "direct" in (tmp_path / "net.cpp").read_text()


def test_only_what_is_needed_is_installed(installed: Path) -> None:
    assert {path.name for path in (installed / "lnc" / "_data").iterdir()} == {
        "CMakeLists.txt",
        "ops_library",
        "runtime",
    }
    assert sum(path.stat().st_size for path in installed.rglob("*")) < 5_000_000


@pytest.mark.slow
@pytest.mark.program
def test_a_program_outlives_lnc_and_its_cache(installed: Path, tmp_path: Path) -> None:
    lnc(installed, tmp_path, "compile", "net.ln", "-o", "net")
    shutil.rmtree(tmp_path / "cache")
    for scene in ("cornell_box.gltf", "glossy_tags.glb"):
        command = ["./net", str(SCENES / scene), "--size", "5x3", "--samples", "1"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "out.exr").exists()
