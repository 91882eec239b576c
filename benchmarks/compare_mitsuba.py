"""Compare a compiled network with Mitsuba 3's path tracer on the same glTF file, in time, error and picture.

    lnc compile examples/path_tracing.ln -o network
    python -m benchmarks.compare_mitsuba ./network examples/scenes/cornell_box.gltf --cache references

Both render at the same size, with the same samples per pixel and number of threads, in turn, `--repeats` times with
different seeds; the table holds medians. Ours is timed by its own clock (prepare + render of --stats), Mitsuba by the
call that renders, after one call that is not counted: scene loading and compilation of kernels are left out for both.
relMSE has the noise of the reference taken off. `time to 1e-2` scales it as 1 / time. The picture test compares 8 x 8
blocks of the mean of our pictures with the reference; expect false alarms where few samples find strong light.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from benchmarks import programs
from benchmarks.exr import Image
from benchmarks.gltf_to_mitsuba import load_scene
from benchmarks.image_error import block_test, mean_and_variance, mean_ratio, noise, rel_mse
from benchmarks.reference import Reference, reference, render, set_threads

OURS = "ours"


@dataclass
class Runs:
    """What one renderer did, repeat by repeat; `cpu` holds all of its processor time, also that of loading."""

    seconds: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    images: list[Image] = field(default_factory=list)
    stats: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    program: Path
    options: Sequence[str]
    scene: Path
    width: int
    height: int
    samples: int
    threads: int


def compare(job: Job, variants: Sequence[str], repeats: int) -> dict[str, Runs]:
    """Run all renderers in turn, so that a busy machine troubles them alike."""
    set_threads(job.threads)
    renderers: dict[str, Callable[[int, Runs], None]] = {OURS: lambda seed, runs: _run_ours(job, seed, runs)}
    for variant in variants:
        renderers[variant] = _mitsuba_renderer(job, variant)
    runs = {name: Runs() for name in renderers}
    for seed in range(repeats):
        for name, run in renderers.items():
            run(seed, runs[name])
    return runs


def _run_ours(job: Job, seed: int, runs: Runs) -> None:
    options = ["--threads", str(job.threads), *job.options]
    done = programs.run(job.program, job.scene, f"{job.width}x{job.height}", job.samples, seed, options)
    runs.cpu.append(done.cpu)
    runs.seconds.append(done.seconds)
    runs.stats = done.stats
    runs.images.append(done.image)


def _mitsuba_renderer(job: Job, variant: str) -> Callable[[int, Runs], None]:
    mi.set_variant(variant)
    scene = load_scene(job.scene, job.width, job.height)
    render(scene, job.samples, 999)

    def run(seed: int, runs: Runs) -> None:
        mi.set_variant(variant)
        start, cpu = time.perf_counter(), time.process_time()
        image = render(scene, job.samples, seed)
        runs.seconds.append(time.perf_counter() - start)
        runs.cpu.append(time.process_time() - cpu)
        runs.images.append(image)

    return run


def summary(runs: dict[str, Runs], truth: Reference) -> dict[str, Any]:
    """Numbers of every renderer, and of ours against each variant."""
    result: dict[str, Any] = {}
    for name, r in runs.items():
        errors = [rel_mse(image, truth.image, truth.variance) for image in r.images]
        ratios = [mean_ratio(image, truth.image) for image in r.images]
        seconds, error = statistics.median(r.seconds), statistics.median(errors)
        result[name] = {
            "seconds": seconds,
            "cpu": statistics.median(r.cpu),
            "relmse": error,
            "seconds_to_1e-2": seconds * error / 1e-2,
            "mean_ratio": statistics.mean(ratios),
            "mean_ratio_error": _mean_ratio_error(ratios, truth) if len(ratios) > 1 else None,
        }
    ours = result[OURS]
    for name, r in runs.items():
        if name != OURS:
            pairs = zip(runs[OURS].seconds, r.seconds, strict=True)
            result[name]["time_ratio"] = statistics.median(a / b for a, b in pairs)
            result[name]["relmse_ratio"] = ours["relmse"] / result[name]["relmse"]
    if len(runs[OURS].images) > 1:
        test = block_test(*mean_and_variance(runs[OURS].images), truth.image, truth.variance)
        result["blocks"] = {"passed": test.passed, "limit": test.limit, "worst": test.worst()}
    rays = runs[OURS].stats.get("rays", {}).get("total")
    render_seconds = runs[OURS].stats.get("seconds", {}).get("render")
    if rays and render_seconds:
        result[OURS]["million_rays_per_second"] = rays / render_seconds / 1e6
    return result


def _mean_ratio_error(ratios: Sequence[float], truth: Reference) -> float:
    """Standard error of the mean of the ratios, that of the reference included; its channels may vary together."""
    of_truth = np.sqrt(3 * truth.variance.sum()) / truth.image.sum()
    return float(np.hypot(statistics.stdev(ratios) / len(ratios) ** 0.5, of_truth))


def report(result: dict[str, Any], truth: Reference) -> str:
    own_noise = noise(truth.image, truth.variance)
    lines = [f"reference: relMSE of its own {own_noise:.1e}, taken off below"]
    lines += [f"{'':14} {'seconds':>9} {'cpu':>9} {'relMSE':>10} {'to 1e-2':>9} {'mean / reference':>20}"]
    renderers = {name: row for name, row in result.items() if name != "blocks"}
    for name, row in renderers.items():
        error = row["mean_ratio_error"]
        mean = f"{row['mean_ratio']:.5f}" + (f" +- {error:.5f}" if error is not None else "")
        lines.append(
            f"{name:14} {row['seconds']:9.3f} {row['cpu']:9.3f} {row['relmse']:10.3e}"
            f" {row['seconds_to_1e-2']:9.3f} {mean:>20}"
        )
    for name, row in renderers.items():
        if name != OURS:
            lines.append(f"ours / {name}: time {row['time_ratio']:.3f}, relMSE {row['relmse_ratio']:.3f}")
    if "million_rays_per_second" in result[OURS]:
        lines.append(f"ours: {result[OURS]['million_rays_per_second']:.2f} million rays a second")
    if "blocks" in result:
        blocks = result["blocks"]
        verdict = "within the noise" if blocks["passed"] else "beyond the noise"
        lines.append(
            f"blocks: {verdict}, |z| up to {abs(blocks['worst'][0][2]):.2f}, limit {blocks['limit']:.2f}; worst:"
        )
        for row, column, z, difference in blocks["worst"]:
            lines.append(f"  row {row:3}, column {column:3}: z {z:+.2f}, {100 * difference:+.2f} %")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.compare_mitsuba",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("program", type=Path, help="a compiled network; options for it follow --")
    parser.add_argument("scene", type=Path)
    parser.add_argument("--size", default="320x240", metavar="WxH")
    parser.add_argument("--samples", type=int, default=64, help="per pixel, default 64")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--variants", default="scalar_rgb,llvm_ad_rgb", help="of Mitsuba, default %(default)s")
    parser.add_argument("--cache", type=Path, required=True, metavar="FOLDER", help="where references are kept")
    parser.add_argument("--reference-samples", type=int, default=4096, help="per pixel, default 4096")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there as well")
    own = sys.argv[1:]
    split = own.index("--") if "--" in own else len(own)
    options = parser.parse_args(own[:split])
    width, height = (int(v) for v in options.size.split("x"))
    job = Job(
        options.program.resolve(), own[split + 1 :], options.scene, width, height, options.samples, options.threads
    )
    set_threads(job.threads)
    truth = reference(options.scene, width, height, options.reference_samples, options.cache)
    variants = [v for v in options.variants.split(",") if v]
    result = summary(compare(job, variants, options.repeats), truth)
    print(report(result, truth))
    if options.json:
        options.json.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
