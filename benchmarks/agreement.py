"""Networks against reference tracers of the same light paths: error, bias, time, rays and memory.

    python -m benchmarks.agreement --cache FOLDER [--networks NAME...] [--scenes NAME...] [--page]

Every network of examples/ says with `expect` which light paths its picture holds, and `lnc check` proves it.
`lnc compile --reference` makes a tracer of just these paths, which shares no operator with the network. Networks run at
their default settings, `--repeats` times with different seeds:

- `relMSE`: mean((x - r)^2 / (r^2 + 0.01)) of one run, median of the repeats, the reference's own noise taken off;
- `bias`: mean of the picture against the reference, with the standard error of both;
- `seconds`, `rays`, `memory`: of one run, median; seconds are processor time, of all threads together;
- `reference`: the same of the reference tracer, as far as it takes to come to this relMSE.

`--page` writes docs/agreement.md and its pictures. Times depend on the machine, the order of the rows much less.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import statistics
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import exr
from benchmarks.exr import Image
from benchmarks.image_error import mean_and_variance, noise, rel_mse
from benchmarks.programs import EXAMPLES, ROOT, Programs, Run, find_scene, run

NETWORKS = (
    "path_tracing",
    "radiosity",
    "final_gather",
    "density_estimation",
    "photon_map",
    "irradiance_gradients",
    "gather_irradiance_gradients",
)
SCENES = ("cornell_box", "closed_box", "mirror_glass", "glossy_tags")
BATCHES = 8
"""Runs of the reference tracer with seeds of their own: their spread is the reference's noise."""


@dataclass(frozen=True)
class Truth:
    """A converged picture of the reference tracer, its variance, and what it takes: relMSE times processor seconds."""

    image: Image
    variance: Image
    work: float


@dataclass(frozen=True)
class Row:
    """One network on one scene, in figures."""

    rel_mse: float
    bias: float
    bias_error: float
    seconds: float
    rays: float
    peak_bytes: float
    reference_seconds: float
    """Processor time that the reference tracer takes to the same relMSE."""


def light_paths(network: Path) -> str:
    """What the picture is expected to hold: the `expect` statement without a wire's name."""
    found = re.search(r"(?m)^expect\s+([^:\n/]+)$", network.read_text("utf-8"))
    if found is None:
        raise SystemExit(f"{network}: no `expect` statement to compare with")
    return found[1].strip()


class Comparison:
    """Runs of networks and references at one size; references are kept in `cache`, with their variance."""

    def __init__(
        self, cache: Path, programs: Programs, size: str, samples: int, reference_samples: int, repeats: int
    ) -> None:
        cache.mkdir(parents=True, exist_ok=True)
        self.cache = cache
        self.programs = programs
        self.size = size
        self.samples = samples
        self.reference_samples = reference_samples
        self.repeats = repeats

    def truth(self, network: Path, scene: Path) -> Truth:
        """The reference for the light paths of a network, from the cache or rendered into it."""
        paths = light_paths(network)
        key = f"{paths}|{re.findall('(?m)^tag .*$', network.read_text('utf-8'))}|{self.size}|{self.reference_samples}"
        file = self.cache / f"{scene.stem}_{hashlib.sha256(key.encode()).hexdigest()[:16]}.exr"
        if not file.exists():
            program = self.programs(network, "--reference", paths)
            per_batch = max(1, self.reference_samples // BATCHES)
            runs = [run(program, scene, self.size, per_batch, 1000 + seed) for seed in range(BATCHES)]
            image, variance = mean_and_variance([r.image for r in runs])
            work = sum(r.cpu for r in runs) * noise(image, variance)
            exr.write(file, image, {"variance": variance, "work": np.full_like(image, work)})
        return Truth(exr.read(file), exr.read(file, "variance"), float(exr.read(file, "work")[0, 0, 0]))

    def runs(self, network: Path, scene: Path) -> list[Run]:
        program = self.programs(network)
        return [run(program, scene, self.size, self.samples, seed) for seed in range(self.repeats)]


def figures(runs: Sequence[Run], truth: Truth) -> Row:
    error = statistics.median(rel_mse(r.image, truth.image, truth.variance) for r in runs)
    ratios = [r.image.mean() / truth.image.mean() for r in runs]
    of_truth = np.sqrt(3 * truth.variance.sum()) / truth.image.sum()  # channels may vary together
    return Row(
        rel_mse=error,
        bias=statistics.mean(ratios) - 1,
        bias_error=float(np.hypot(statistics.stdev(ratios) / len(ratios) ** 0.5, of_truth)),
        seconds=statistics.median(r.cpu for r in runs),
        rays=statistics.median(r.stats["rays"]["total"] for r in runs),
        peak_bytes=statistics.median(r.stats["peak_bytes"] for r in runs),
        reference_seconds=truth.work / error if error > 0 else float("inf"),
    )


def table(rows: dict[str, Row]) -> str:
    """Markdown."""
    lines = [
        "| network | relMSE | bias of the mean | seconds | reference | rays | memory |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for name, row in rows.items():
        lines.append(
            f"| {name} | {row.rel_mse:.1e} | {100 * row.bias:+.2f} ± {100 * row.bias_error:.2f} % | {row.seconds:.1f}"
            f" | {row.reference_seconds:.1f} | {row.rays / 1e6:.1f} M | {row.peak_bytes / 2**20:.0f} MB |"
        )
    return "\n".join(lines)


def sheet(pictures: Sequence[tuple[Image, Image]]) -> NDArray[np.uint8]:
    """Pictures, given with their references, in the upper row; below each its difference, in blocks of 4 x 4 pixels.

    Red is too bright, blue too dark, full colour at 10 % of the reference plus 1 % of its mean.
    """
    upper = [exr.tone_mapped(image) for image, _ in pictures]
    lower = []
    for image, truth in pictures:
        mine, right = _blocks(image), _blocks(truth)
        relative = (mine - right) / (0.1 * right + 0.01 * truth.mean())
        red, blue = np.clip(relative, 0, 1), np.clip(-relative, 0, 1)
        colours = np.round(255 * np.stack([1 - blue, 1 - red - blue, 1 - red], axis=-1)).astype(np.uint8)
        lower.append(
            np.pad(colours, ((0, image.shape[0] - len(colours)), (0, image.shape[1] - colours.shape[1]), (0, 0)))
        )
    return np.concatenate([np.concatenate(upper, axis=1), np.concatenate(lower, axis=1)])


def _blocks(image: Image, size: int = 4) -> Image:
    """Each pixel's block mean of all channels; what is left at the right and lower edge goes."""
    rows, columns = image.shape[0] // size, image.shape[1] // size
    means = image[: rows * size, : columns * size].reshape(rows, size, columns, size * image.shape[2]).mean(axis=(1, 3))
    whole: Image = means.repeat(size, axis=0).repeat(size, axis=1)
    return whole


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.agreement", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cache", type=Path, required=True, metavar="FOLDER", help="where references are kept")
    parser.add_argument("--networks", nargs="+", default=NETWORKS, metavar="NAME")
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="NAME")
    parser.add_argument("--size", default="160x120", metavar="WxH")
    parser.add_argument("--samples", type=int, default=64, help="per pixel, default 64")
    parser.add_argument("--reference-samples", type=int, default=8192, help="per pixel, default 8192")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--page", action="store_true", help="write docs/agreement.md")
    options = parser.parse_args()

    images = ROOT / "docs" / "images" / "agreement" if options.page else options.cache
    images.mkdir(parents=True, exist_ok=True)
    sections = []
    with tempfile.TemporaryDirectory() as programs:
        comparison = Comparison(
            options.cache,
            Programs(Path(programs)),
            options.size,
            options.samples,
            options.reference_samples,
            options.repeats,
        )
        for scene in map(find_scene, options.scenes):
            rows, pictures = {}, []
            for name in options.networks:
                network = EXAMPLES / f"{name}.ln"
                truth, runs = comparison.truth(network, scene), comparison.runs(network, scene)
                rows[name] = figures(runs, truth)
                pictures.append((mean_and_variance([r.image for r in runs])[0], truth.image))
            exr.write_png(images / f"{scene.stem}.png", sheet(pictures))
            sections.append(f"## {scene.name}\n\n{table(rows)}\n\n![{scene.stem}](images/agreement/{scene.stem}.png)")
            print(sections[-1], flush=True)
    if options.page:
        text = HEAD.format(size=options.size, samples=options.samples, reference=options.reference_samples)
        (ROOT / "docs" / "agreement.md").write_text("\n\n".join([text, *sections]) + "\n", "utf-8")


HEAD = """# Agreement

Networks that carry the same light must show the same picture. Each row compares a network of `examples/`, at its
default settings, with the reference tracer of its own light paths (`lnc compile --reference`), {reference} samples a
pixel. All at {size}, {samples} samples a pixel. `bias` is the mean of the picture against the reference; `seconds` are
processor time, of all threads together; `reference` is what the reference tracer takes to come to the same relMSE.
`python -m benchmarks.agreement --cache FOLDER --page` makes this page.

Below each table: the pictures in the order of the rows, and under each its difference from the reference in blocks of
4 x 4 pixels, red where it is too bright, blue where it is too dark, full colour at 10 %."""


if __name__ == "__main__":
    main()
