#!/usr/bin/env python3
"""Makes docs/gallery.md: for each network of examples/ its graph, the pictures at its wires, and the final picture.

    .venv/bin/python scripts/gallery.py [NETWORK...]     # all networks, or some; the page always shows all

Each network is compiled with `layers` on its image, so that the wires that are summed are seen one by one; further
wires are shown as taps.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks import exr  # noqa: E402

EXAMPLES = ROOT / "examples"
SCENES = EXAMPLES / "scenes"
IMAGES = ROOT / "docs" / "images" / "gallery"
SIZE = "320x240"


@dataclass(frozen=True)
class Exhibit:
    """A network with the scene and the effort that show it best. `taps`: further wires whose pictures are shown."""

    network: str
    scene: str = "cornell_box.gltf"
    samples: int = 32
    taps: tuple[str, ...] = ()
    exposure: float = 0


EXHIBITS = (
    Exhibit("direct"),
    Exhibit("path_tracing", "mirror_glass.glb", 256),
    Exhibit("caustics", "mirror_glass.glb"),
    Exhibit("photon_density", "closed_box.gltf"),
    Exhibit("density_estimation"),
    Exhibit("radiosity"),
    Exhibit("final_gather"),
    Exhibit("composite", "cylinder_figure4.glb", 16),
    Exhibit("irradiance_gradients"),
    Exhibit("gather_irradiance_gradients"),
    Exhibit("photon_map", "mirror_glass.glb", 16),
    Exhibit("tagged", "glossy_tags.glb", 16),
    Exhibit("difference"),
)


def lnc(*arguments: str) -> str:
    command = [sys.executable, "-m", "lnc", *arguments]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def shown_text(exhibit: Exhibit) -> str:
    """The network with layers, and taps of further wires."""
    text = (EXAMPLES / f"{exhibit.network}.ln").read_text("utf-8")
    if " layers" not in text:
        text = re.sub(r"(?m)^(image\s[^/\n]*?)\s*(//.*)?$", r"\1 layers", text, count=1)
    return text + "".join(f'tap {wire} -> "{wire}.exr"\n' for wire in exhibit.taps)


def render(exhibit: Exhibit) -> None:
    lnc("graph", f"examples/{exhibit.network}.ln", "-o", str(IMAGES / f"{exhibit.network}.svg"))
    with tempfile.TemporaryDirectory() as folder:
        network = EXAMPLES / f".gallery_{exhibit.network}.ln"  # beside the example, for its `use`
        network.write_text(shown_text(exhibit), "utf-8")
        try:
            lnc("compile", str(network), "-o", f"{folder}/network")
        finally:
            network.unlink()
        options = ["--size", SIZE, "--samples", str(exhibit.samples), "--stats", "stats.json"]
        command = ["./network", str(SCENES / exhibit.scene), *options]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        picture = exr.read(f"{folder}/out.exr")
        write(exhibit, "", picture)
        layers = {name.rpartition(".")[0] for name in exr.read_channels(f"{folder}/out.exr") if "." in name}
        for layer in sorted(layers):
            write(exhibit, layer, exr.read(f"{folder}/out.exr", layer))
        for wire in exhibit.taps:
            write(exhibit, wire, exr.read(f"{folder}/{wire}.exr"))
        stats = json.loads(Path(folder, "stats.json").read_text("utf-8"))
        facts = {"seconds": stats["seconds"], "rays": stats["rays"], "samples": stats["samples"]}
        (IMAGES / f"{exhibit.network}.json").write_text(json.dumps(facts, indent=2) + "\n", "utf-8")


def write(exhibit: Exhibit, wire: str, picture: exr.Image) -> None:
    name = f"{exhibit.network}.png" if not wire else f"{exhibit.network}-{wire}.png"
    exr.write_png(IMAGES / name, exr.tone_mapped(picture, exhibit.exposure))


def section(exhibit: Exhibit) -> str:
    """A network's part of the page, from what lies in docs/images/gallery."""
    text = (EXAMPLES / f"{exhibit.network}.ln").read_text("utf-8")
    about = [line.removeprefix("//").strip() for line in text.split("\n\n")[0].splitlines()]
    facts = json.loads((IMAGES / f"{exhibit.network}.json").read_text("utf-8"))
    seconds, rays = facts["seconds"], facts["rays"]["total"]
    effort = (
        f"{facts['samples']} samples a pixel, {rays / 1e6:.1f} million rays, "
        f"{seconds['prepare']:.1f} s before the picture, {seconds['render']:.1f} s for it."
    )
    where = f"images/gallery/{exhibit.network}"
    parts = [f"## [{exhibit.network}](../examples/{exhibit.network}.ln)", about[0]]
    parts += [f"`{line}`" for line in about[1:] if line]
    parts += [f"![graph]({where}.svg)", f"![picture]({where}.png)", f"{exhibit.scene}, {SIZE}; {effort}"]
    wires = sorted(path.stem.partition("-")[2] for path in IMAGES.glob(f"{exhibit.network}-*.png"))
    if wires:
        parts.append("| " + " | ".join(wires) + " |\n|" + "---|" * len(wires))
        parts[-1] += "\n| " + " | ".join(f"![{w}]({where}-{w}.png)" for w in wires) + " |"
    return "\n\n".join(parts)


def main() -> None:
    IMAGES.mkdir(parents=True, exist_ok=True)
    there = [e for e in EXHIBITS if (EXAMPLES / f"{e.network}.ln").exists()]
    wanted = sys.argv[1:] or [e.network for e in there]
    for exhibit in there:
        if exhibit.network in wanted:
            print(f"gallery: {exhibit.network}", flush=True)
            render(exhibit)
    head = (
        "# Gallery\n\nEvery network of `examples/`: its graph (inserted converters are dashed), its picture, and\n"
        "the light on each wire that the picture sums, with the same exposure. `scripts/gallery.py` makes this page."
    )
    sections = [section(e) for e in there if (IMAGES / f"{e.network}.json").exists()]
    (ROOT / "docs" / "gallery.md").write_text("\n\n".join([head, *sections]) + "\n", "utf-8")


if __name__ == "__main__":
    main()
