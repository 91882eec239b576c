"""Reference pictures by Mitsuba 3's path tracer, kept in a folder:

    python -m benchmarks.reference SCENE... --cache FOLDER [--samples N]

A reference is an EXR with the picture and a layer `variance`, the variance of every pixel's value, so that comparisons
can take the reference's own noise off. More samples continue nothing: they make a new file.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchmarks import exr
from benchmarks.exr import Image
from benchmarks.gltf_to_mitsuba import load_scene
from benchmarks.image_error import noise

BATCH = 64
"""Samples per pixel of one call of Mitsuba: its llvm variants hold the whole wave in memory."""


@dataclass(frozen=True)
class Reference:
    image: Image
    variance: Image


def reference(scene: str | os.PathLike[str], width: int, height: int, samples: int, cache: Path) -> Reference:
    """From the cache, or rendered into it."""
    file = reference_file(scene, width, height, samples, cache)
    if not file.exists():
        cache.mkdir(parents=True, exist_ok=True)
        result = render_reference(load_for_rendering(scene, width, height), samples)
        exr.write(file, result.image, {"variance": result.variance})
    return Reference(exr.read(file), exr.read(file, "variance"))


def reference_file(scene: str | os.PathLike[str], width: int, height: int, samples: int, cache: Path) -> Path:
    return cache / f"{Path(scene).stem}_{width}x{height}_{samples}.exr"


def load_for_rendering(scene: str | os.PathLike[str], width: int, height: int) -> Any:
    if mi.variant() is None:
        mi.set_variant("llvm_ad_rgb")
    return load_scene(scene, width, height)


def render_reference(scene: Any, samples: int) -> Reference:
    """The mean over batches with seeds of their own, and its variance from how much the batches differ."""
    batches = max(2, samples // BATCH)
    per_batch = max(1, samples // batches)
    total: Image | None = None
    squares: Image | None = None
    for seed in range(batches):
        image = render(scene, per_batch, 1_000_000 + seed)
        total = image if total is None else total + image
        squares = image**2 if squares is None else squares + image**2
    assert total is not None and squares is not None
    mean = total / batches
    variance = np.maximum(squares / batches - mean**2, 0) / (batches - 1)
    return Reference(mean, variance)


def render(scene: Any, samples: int, seed: int) -> Image:
    """One picture, waited for."""
    return np.array(mi.render(scene, spp=samples, seed=seed), dtype=np.float64)


def set_threads(count: int) -> None:
    """How many processor threads Mitsuba uses from now on."""
    dr.set_thread_count(count)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reference", description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="+", metavar="SCENE")
    parser.add_argument("--cache", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--size", default="320x240", metavar="WxH")
    parser.add_argument("--samples", type=int, default=1024, help="per pixel, default 1024")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    width, height = (int(v) for v in options.size.split("x"))
    set_threads(options.threads)
    for scene in options.scenes:
        start = time.perf_counter()
        result = reference(scene, width, height, options.samples, options.cache)
        own_noise = noise(result.image, result.variance)
        file = reference_file(scene, width, height, options.samples, options.cache)
        seconds = time.perf_counter() - start
        print(f"{file}: mean {result.image.mean():.5f}, relMSE of its own {own_noise:.2e}, {seconds:.1f} s", flush=True)


if __name__ == "__main__":
    main()
