"""The paper's claims about its networks, in figures of this implementation.

    python -m benchmarks.claims [--page]

- Final gathering: irradiance gradients against brute force at the same error.
- Final gathering at several resolutions.
- Radiosity between the large surfaces alone than between all.
- Time in converters.
- Caustics light the room: the pictures of Figure 3.

Ratios of times are taken within one run on one machine. `--page` writes docs/claims.md and its pictures.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks import exr
from benchmarks.image_error import rel_mse
from benchmarks.programs import EXAMPLES, ROOT, Programs, find_scene, run
from lnc.library_reader import load_library

NETWORKS = ROOT / "benchmarks" / "networks"
IMAGES = ROOT / "docs" / "images" / "claims"


def final_gathering(programs: Programs, scene: str = "cornell_box", size: str = "160x120") -> str:
    """Time to the same error, with the same photons: the truth is brute force with many samples."""
    few, many = 64, 1024
    file = find_scene(scene)
    brute, gradients = (programs(NETWORKS / f"{name}.ln") for name in ("gather_brute_force", "gather_gradients"))
    truth = run(brute, file, size, many).image
    by_force, by_records = run(brute, file, size, few), run(gradients, file, size, 16)
    # The truth begins with the same few samples, and has noise of its own.
    apart = rel_mse(by_force.image, truth)
    noise = apart / (many / few - 1)
    errors = apart + noise, rel_mse(by_records.image, truth) - noise
    lines = ["| final gathering | samples | gather rays | seconds | relMSE |", "|---|--:|--:|--:|--:|"]
    for name, samples, done, error in (
        ("brute force", few, by_force, errors[0]),
        ("irradiance gradients", 16, by_records, errors[1]),
    ):
        rays = done.stats["rays"]["gather"] / 1e6
        lines.append(f"| {name} | {samples} | {rays:.2f} M | {done.seconds:.2f} | {error:.1e} |")
    needed = errors[0] / errors[1]  # its error falls as 1 / samples
    time_ratio = by_records.seconds / (by_force.seconds * needed)
    ray_ratio = by_records.stats["rays"]["gather"] / (by_force.stats["rays"]["gather"] * needed)
    lines.append(
        f"\nFor the error of irradiance gradients, brute force needs {few * needed:.0f} samples a pixel: they take "
        f"**{100 * time_ratio:.1f} %** of its time and **{100 * ray_ratio:.1f} %** of its rays ({scene}, {size})."
    )
    return "\n".join(lines)


def resolution(programs: Programs, scene: str = "cornell_box", samples: int = 4) -> str:
    """Rays and time of gathering through irradiance gradients, at more and more pixels."""
    program = programs(NETWORKS / "gather_gradients.ln")
    lines = ["| pixels | gather rays | before the picture | picture |", "|---|--:|--:|--:|"]
    for size in ("160x120", "320x240", "640x480"):
        stats = run(program, find_scene(scene), size, samples).stats
        seconds = stats["seconds"]
        rays = stats["rays"]["gather"] / 1e6
        lines.append(f"| {size} | {rays:.2f} M | {seconds['prepare']:.2f} s | {seconds['render']:.2f} s |")
    return "\n".join(lines)


def restricted_radiosity(programs: Programs, scene: str = "glossy_tags", size: str = "160x120") -> str:
    lines = ["| radiosity | before the picture | memory |", "|---|--:|--:|"]
    seconds = []
    for name, network in (
        ("between all surfaces", "radiosity_everywhere"),
        ("between large ones", "radiosity_restricted"),
    ):
        stats = run(programs(NETWORKS / f"{network}.ln"), find_scene(scene), size, 4).stats
        seconds.append(stats["seconds"]["prepare"])
        lines.append(f"| {name} | {seconds[-1]:.2f} s | {stats['peak_bytes'] / 2**20:.0f} MB |")
    return "\n".join([*lines, f"\n{seconds[0] / seconds[1]:.1f} times as fast ({scene})."])


def converters(programs: Programs, size: str = "160x120", samples: int = 16) -> str:
    """Which share of the nodes' time goes into operators of the family `convert`."""
    library, _ = load_library()
    converting = {op.name for op in library.operators.values() if op.family == "convert"}
    lines = ["| network | scene | time in converters | most of it in |", "|---|---|--:|---|"]
    for name, scene in (
        ("composite", "cylinder_figure4"),
        ("photon_map", "mirror_glass"),
        ("density_estimation", "cornell_box"),
        ("gather_irradiance_gradients", "cornell_box"),
        ("radiosity", "cornell_box"),
    ):
        stats = run(programs(EXAMPLES / f"{name}.ln"), find_scene(scene), size, samples).stats
        by_operator: dict[str, float] = {}
        for node in stats["nodes"]:
            by_operator[node["op"]] = by_operator.get(node["op"], 0) + node["seconds"]
        of_converters = {op: s for op, s in by_operator.items() if op in converting}
        share = sum(of_converters.values()) / sum(by_operator.values())
        largest = max(of_converters, key=lambda op: of_converters[op])
        lines.append(f"| {name} | {scene} | {100 * share:.0f} % | {largest} |")
    return "\n".join(lines)


def figure_3(programs: Programs, scene: str = "reflectors_figure3", size: str = "320x240", samples: int = 64) -> str:
    """Direct and caustic light, the light that these send into the room, and both."""
    with tempfile.TemporaryDirectory() as folder:
        text = (EXAMPLES / "composite.ln").read_text("utf-8")
        network = Path(folder, "figure_3.ln")
        network.write_text(text.replace("image  direct + caustic + smooth", "image  direct + caustic + smooth layers"))
        layers = Path(folder, "layers.exr")
        full = run(programs(network), find_scene(scene), size, samples, picture=layers).image
        indirect = exr.read(layers, "smooth_points")
    parts = [full - indirect, indirect, full]
    exr.write_png(IMAGES / "figure3.png", np.concatenate([exr.tone_mapped(part) for part in parts], axis=1))
    share = indirect.mean() / full.mean()
    return (
        "![Figure 3](images/claims/figure3.png)\n\nLeft: direct light and caustics. Middle: what surfaces lit by these "
        f"send to each other, {100 * share:.0f} % of the light. Right: both ({scene}, composite)."
    )


CLAIMS = (
    ("Final gathering: irradiance gradients against brute force", final_gathering),
    ("Final gathering at several resolutions", resolution),
    ("Radiosity between the large surfaces alone", restricted_radiosity),
    ("Time in converters", converters),
    ("Caustics light the room", figure_3),
)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.claims", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--page", action="store_true", help="write docs/claims.md")
    options = parser.parse_args()
    IMAGES.mkdir(parents=True, exist_ok=True)
    sections = []
    with tempfile.TemporaryDirectory() as folder:
        programs = Programs(Path(folder))
        for title, measured in CLAIMS:
            sections.append(f"## {title}\n\n{measured(programs)}")
            print(sections[-1], flush=True)
    if options.page:
        head = (
            "# The paper's claims\n\nWhat the paper says of its networks, measured here: where it holds, and where not."
        )
        head += " `python -m benchmarks.claims --page` makes this page."
        (ROOT / "docs" / "claims.md").write_text("\n\n".join([head, *sections]) + "\n", "utf-8")


if __name__ == "__main__":
    main()
