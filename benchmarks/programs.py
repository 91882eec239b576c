"""Compiled networks and reference tracers, run for benchmarks."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import exr
from benchmarks.exr import Image

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
SCENES = EXAMPLES / "scenes"


@dataclass(frozen=True)
class Run:
    """A finished run: the picture, the statistics of --stats, and all of its processor time in seconds."""

    image: Image
    stats: dict[str, Any]
    cpu: float

    @property
    def seconds(self) -> float:
        """Wall time of the algorithm: without loading the scene and building Embree's tree."""
        return float(self.stats["seconds"]["prepare"] + self.stats["seconds"]["render"])


def run(
    program: Path,
    scene: Path,
    size: str,
    samples: int,
    seed: int = 0,
    options: Sequence[str] = (),
    picture: Path | None = None,
) -> Run:
    """One run; `size` as WxH, `picture` where the file shall stay."""
    with tempfile.TemporaryDirectory() as folder:
        picture, stats = picture or Path(folder, "out.exr"), Path(folder, "stats.json")
        command = [str(program.resolve()), str(scene.resolve()), "-o", str(picture), "--size", size]
        command += ["--samples", str(samples)]
        command += ["--seed", str(seed), "--stats", str(stats), "--progress", "none", *options]
        before = _child_cpu()
        subprocess.run(command, check=True, cwd=folder, stderr=subprocess.DEVNULL)
        return Run(exr.read(picture), json.loads(stats.read_text()), _child_cpu() - before)


class Programs:
    """Networks, compiled into a folder when they are first asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.found: dict[tuple[str, ...], Path] = {}

    def __call__(self, network: Path, *options: str) -> Path:
        """The program of a network; with options of `lnc compile`, such as --reference EXPR."""
        key = (str(network), *options)
        if key not in self.found:
            program = self.folder / f"{network.stem}_{len(self.found)}"
            command = [sys.executable, "-m", "lnc", "compile", str(network), "-o", str(program), *options]
            subprocess.run(command, check=True, cwd=ROOT)
            self.found[key] = program
        return self.found[key]


def find_scene(name: str) -> Path:
    """A file of examples/scenes by its stem, or any other file by its path."""
    found = [path for path in SCENES.glob(f"{name}.gl*") if path.suffix in (".gltf", ".glb")]
    return found[0] if found else Path(name)


def _child_cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
