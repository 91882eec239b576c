"""`lnc graph`: what is drawn can be read."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from itertools import combinations
from pathlib import Path

import pytest

from lnc.cli import main

EXAMPLES = sorted((Path(__file__).resolve().parents[1] / "examples").glob("*.ln"))
SVG = "{http://www.w3.org/2000/svg}"
LETTER = {
    "name": 7.2,
    "": 6.5,
}  # widths of letters in usual fonts, a little narrow: only faults of layout are to be found
Box = tuple[float, float, float, float]


def drawn(network: Path, folder: Path) -> ET.Element:
    assert main(["graph", str(network), "-o", str(folder / "graph.svg")]) == 0
    return ET.parse(folder / "graph.svg").getroot()


def extents(group: ET.Element) -> list[Box]:
    """Left, top, right and bottom of a node's frame, then of each of its lines."""
    frame = group.find(f"{SVG}rect")
    assert frame is not None
    x, y, width, height = (float(frame.get(k, "")) for k in ("x", "y", "width", "height"))
    found = [(x, y, x + width, y + height)]
    for line in group.iter(f"{SVG}text"):
        x, y = float(line.get("x", "")), float(line.get("y", ""))
        letters = len(line.text or "") * LETTER.get(line.get("class", ""), LETTER[""])
        found.append((x, y - 9, x + letters, y + 2))
    return found


def apart(a: Box, b: Box) -> bool:
    return a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


@pytest.mark.parametrize("network", EXAMPLES, ids=lambda path: path.stem)
def test_nothing_covers_anything(network: Path, tmp_path: Path) -> None:
    svg = drawn(network, tmp_path)
    width, height = (float(n) for n in svg.get("viewBox", "").split()[2:])
    assert width <= 1000, "shrunk to the width of a page, it could not be read"
    groups = [extents(group) for group in svg.iter(f"{SVG}g")]
    assert len(groups) > 2
    for group in groups:
        assert all(min(box) >= 0 and box[2] <= width and box[3] <= height for box in group)
    for one, other in combinations(groups, 2):
        assert all(apart(a, b) for a in one for b in other)


def test_wires_run_down_and_say_what_they_carry(tmp_path: Path) -> None:
    svg = drawn(EXAMPLES[0].with_name("irradiance_gradients.ln"), tmp_path)
    texts = [text.text for text in svg.iter(f"{SVG}text")]
    assert "IrradianceRecords" in texts and "radiance: L D+" in texts
    wires = [path for path in svg.iter(f"{SVG}path") if (path.get("class") or "").startswith("wire")]
    back = [path for path in wires if "back" in path.get("class", "")]
    assert len(back) == 1 and len(wires) > 7
    for wire in wires:
        ends = [float(n) for n in re.findall(r"[\d.]+", wire.get("d", ""))]
        assert (ends[-1] < ends[1]) == (wire in back)


def test_long_light_paths_are_cut_at_blanks(tmp_path: Path) -> None:
    paths = " | ".join(f"L {'D ' * n}S" for n in range(1, 40))
    network = tmp_path / "long.ln"
    network.write_text(
        f'light = Lights()\nphotons = ParticleTracer(light, via = {paths.replace("L ", "")})\ntap photons -> "a.ply"\n'
    )
    svg = drawn(network, tmp_path)
    lines = [text.text or "" for text in svg.iter(f"{SVG}text") if text.get("class") == "paths"]
    assert all(len(line) <= 48 for line in lines)
    assert any(line.endswith(" …") for line in lines)
    assert max(len(title.text or "") for title in svg.iter(f"{SVG}title")) > 100  # uncut
