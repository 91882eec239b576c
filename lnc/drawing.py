"""A network as an SVG picture: light flows downwards, and each wire says where it begins what it carries.

Layers are longest distances from the sources without the wires that lead back; within a layer, nodes stand near to what
they read and to what reads them. No graph program is needed.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, field
from html import escape

from lnc.driver import Result, describe_paths
from lnc.graph import strong_components
from lnc.network import Network
from lnc.passes.check_cycles import wire_sources

CHARACTER = {"name": 7.6, "paths": 6.8}  # width of one; others are like names
PATH_WIDTH = 44  # characters of light paths on a line; what takes more than two lines is cut
ROW = 15
GAP_X, GAP_Y, MARGIN = 30, 44, 20
PORT = 16  # where wires arrive and leave, from the left of a box
SIDE = 9  # between wires that lead back
SWEEPS = 60  # until boxes stand still
BEND = "bend"

STYLE = """
    text { font: 12px ui-sans-serif, Helvetica, Arial, sans-serif; fill: #222 } .name { font-weight: 600 }
    .paths { font-family: ui-monospace, Menlo, monospace; font-size: 11px; fill: #345 }
    .key { font-size: 11px; fill: #667 }
    rect { fill: #fff; stroke: #345; rx: 6 } .inserted rect { stroke: #b70; stroke-dasharray: 5 3; fill: #fff6e6 }
    .result rect { fill: #eef5ea; stroke: #474 }
    path { fill: none; stroke: #567 } .back { stroke: #a54 } .push { stroke-width: 2.5 } marker path { fill: #567 }
"""
KEYS = (
    ("inserted", "dashed: inserted by the compiler"),
    ("push", "thick: complete before the picture"),
    ("back", "red: leads back"),
)


@dataclass
class _Box:
    name: str
    lines: list[tuple[str, str]]  # (class, text), inside
    labels: list[tuple[str, str]]  # beside the wire that leaves
    reads: list[str]
    kind: str
    hint: str = ""  # what is said in full when the pointer is over it
    pushed: set[str] = field(default_factory=set)  # those of `reads` that are complete before
    layer: int = 0
    x: float = 0
    y: float = 0
    floor: float = 0  # where its layer ends

    @property
    def port(self) -> float:
        return self.x + PORT

    @property
    def frame(self) -> tuple[float, float]:
        """Width and height of the box itself."""
        return max(map(_width, self.lines), default=0) + 20, len(self.lines) * ROW + 12

    @property
    def width(self) -> float:
        if self.kind == BEND:
            return 2 * PORT
        return max(self.frame[0], PORT + 10 + max(map(_width, self.labels), default=0))

    @property
    def height(self) -> float:
        return self.frame[1] + (len(self.labels) * ROW + 8 if self.labels else 0)


def draw(result: Result) -> str:
    """The network of a result that has passed, as an SVG document."""
    assert result.typed is not None
    boxes = _boxes(result)
    back = sorted(_layers(boxes))
    _bend_long_wires(boxes, set(back))
    _place(boxes, set(back))
    found = {
        *("back" for _ in back),
        *(box.kind for box in boxes.values()),
        *("push" for b in boxes.values() if b.pushed),
    }
    key = ("key", " · ".join(text for kind, text in KEYS if kind in found))
    width = (
        max([box.x + box.width for box in boxes.values()] + [_width(key)], default=0) + MARGIN + SIDE * (len(back) + 1)
    )
    height = max((box.floor for box in boxes.values()), default=0) + 2 * MARGIN + ROW
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}">',
        f"<title>{escape(result.typed.network.name)}</title>",
        f"<style>{STYLE}</style>",
        '<defs><marker id="arrow" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="9" markerHeight="9" '
        'markerUnits="userSpaceOnUse" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z"/></marker></defs>',
        f'<rect x="0" y="0" width="{width:.0f}" height="{height:.0f}" style="fill:#fff;stroke:none"/>',
    ]
    for box in boxes.values():
        parts += [_wire(boxes[source], box) for source in box.reads if (source, box.name) not in back]
    parts += [_wire_back(boxes, *wire, side) for side, wire in enumerate(back, 1)]
    parts += [_box(box) for box in boxes.values()]
    parts.append(_text(MARGIN, height - MARGIN + 4, key))
    return "\n".join([*parts, "</svg>", ""])


def _boxes(result: Result) -> dict[str, _Box]:
    assert result.typed is not None
    network: Network = result.typed.network
    paths = describe_paths(result.typed)
    boxes: dict[str, _Box] = {}
    for node in network.nodes:
        inserted = node.origin == "converter"
        lines = [("name", f"{node.name} = {node.op.name}")]
        contents = [f"{content}: {text}" for content, text in paths.wires[node.name]]
        labels = [("", node.op.output), *(("paths", line) for text in contents for line in _lines(text))]
        hint = "\n".join([*([f"inserted: {node.reason}"] if inserted else []), node.op.output, *contents])
        pushed = {t.node for i in node.inputs if i.port.complete for t in i.terms}
        kind = "inserted" if inserted else "node"
        boxes[node.name] = _Box(node.name, lines, labels, wire_sources(node), kind, hint, pushed)
    for i, (name, terms) in enumerate(network.results()):
        lines = [("name", name)]
        image = paths.image or "" if name == "image" else ""
        lines += [("paths", line) for line in _lines(image)]
        reads = list(dict.fromkeys(t.node for t in terms))
        boxes[f"\0result{i}"] = _Box(f"\0result{i}", lines, [], reads, "result", image)
    return boxes


def _layers(boxes: dict[str, _Box]) -> set[tuple[str, str]]:
    """Give each box its layer; returns the wires (from, to) that lead back."""
    sources = {name: box.reads for name, box in boxes.items()}
    order = {name: i for i, name in enumerate(n for c in strong_components(sources) for n in c)}
    back: set[tuple[str, str]] = set()
    for name, position in order.items():
        for source in sources[name]:
            if order[source] >= position:
                back.add((source, name))
            else:
                boxes[name].layer = max(boxes[name].layer, boxes[source].layer + 1)
    return back


def _bend_long_wires(boxes: dict[str, _Box], back: set[tuple[str, str]]) -> None:
    """A wire that passes layers gets a place in each, so as not to run behind boxes; all that it leads to share it."""
    for box in list(boxes.values()):
        reads: list[str] = []
        for source in box.reads:
            through = source
            if (source, box.name) not in back:
                for layer in range(boxes[source].layer + 1, box.layer):
                    name = f"{source}\0{layer}"
                    bend = boxes.setdefault(name, _Box(name, [], [], [through], BEND, layer=layer))
                    if source in box.pushed:
                        bend.pushed.add(through)
                    through = name
            reads.append(through)
            if source in box.pushed:
                box.pushed.add(through)
        box.reads = reads


def _place(boxes: dict[str, _Box], back: set[tuple[str, str]]) -> None:
    layers: list[list[_Box]] = [[] for _ in range(max((b.layer for b in boxes.values()), default=-1) + 1)]
    for box in boxes.values():
        layers[box.layer].append(box)
    y = float(MARGIN)
    for layer in layers:
        floor = y + max(box.height for box in layer)
        for box in layer:
            box.y, box.floor = y, floor
        y = floor + GAP_Y

    near: dict[str, list[_Box]] = {name: [] for name in boxes}
    for box in boxes.values():
        for source in box.reads:
            if (source, box.name) not in back:
                near[box.name].append(boxes[source])
                near[source].append(box)
    for sweep in range(SWEEPS):
        for layer in layers if sweep % 2 == 0 else reversed(layers):
            # The first sweep knows only what is above, the next ones both sides.
            sides = {b.name: [n.port for n in near[b.name] if sweep > 0 or n.layer < b.layer] for b in layer}
            wanted = {b.name: sum(at) / len(at) if (at := sides[b.name]) else b.port for b in layer}
            layer.sort(key=lambda box: wanted[box.name])
            _spread(layer, [wanted[box.name] - PORT for box in layer])
    left = min((box.x for box in boxes.values()), default=0) - MARGIN
    for box in boxes.values():
        box.x -= left


def _spread(layer: list[_Box], wanted: list[float]) -> None:
    """Boxes side by side, as near to where they are wanted as least squares allow (pool adjacent violators)."""
    offset = 0.0
    # Boxes that touch: where the first one's left is wanted in the mean, less what is before it; and their number.
    runs: list[tuple[float, int]] = []
    offsets: list[float] = []
    for box, x in zip(layer, wanted, strict=True):
        offsets.append(offset)
        mean, count = x - offset, 1
        while runs and runs[-1][0] > mean:
            before, number = runs.pop()
            mean = (before * number + mean * count) / (number + count)
            count += number
        runs.append((mean, count))
        offset += box.width + GAP_X
    lefts = [mean for mean, count in runs for _ in range(count)]
    for box, left, offset in zip(layer, lefts, offsets, strict=True):
        box.x = left + offset


def _box(box: _Box) -> str:
    if box.kind == BEND:
        kind = "push" if box.pushed else ""
        return f'<path class="{kind}" d="M{box.port:.0f} {box.y:.0f} V{box.floor:.0f}"/>'
    width, height = box.frame
    parts = [f"<title>{escape(box.hint)}</title>"] if box.hint else []
    parts.append(f'<rect x="{box.x:.0f}" y="{box.y:.0f}" width="{width:.0f}" height="{height:.0f}"/>')
    parts += [_text(box.x + 10, box.y + 18 + i * ROW, line) for i, line in enumerate(box.lines)]
    top = box.y + height + 16
    parts += [_text(box.port + 8, top + i * ROW, line) for i, line in enumerate(box.labels)]
    return f'<g class="{box.kind}">{"".join(parts)}</g>'


def _wire(source: _Box, target: _Box) -> str:
    """Straight down past what it says, then a curve to the other box."""
    x0, y0, y1 = source.port, source.y + (source.frame[1] if source.kind != BEND else 0), source.floor
    x2, y2 = target.port, target.y
    start = f"M{x0:.0f} {y0:.0f} V{y1:.0f}" if source.kind != BEND else f"M{x0:.0f} {y1:.0f}"
    middle = (y1 + y2) / 2
    arrow = "" if target.kind == BEND else ' marker-end="url(#arrow)"'
    kind = "wire push" if source.name in target.pushed else "wire"
    return f'<path class="{kind}" d="{start} C{x0:.0f} {middle:.0f} {x2:.0f} {middle:.0f} {x2:.0f} {y2:.0f}"{arrow}/>'


def _wire_back(boxes: dict[str, _Box], start: str, end: str, side: int) -> str:
    """Down and up again at the right of all that is between."""
    source, target = boxes[start], boxes[end]
    between = [b for b in boxes.values() if target.layer <= b.layer <= source.layer]
    right = max(box.x + box.width for box in between) + SIDE * side
    x0, y0, y1 = source.port, source.y + source.frame[1], source.floor
    x2, y2 = target.port + SIDE, target.y
    data = (
        f"M{x0:.0f} {y0:.0f} V{y1:.0f} C{x0:.0f} {y1 + 24:.0f} {right:.0f} {y1 + 24:.0f} {right:.0f} {y1 - 6:.0f} "
        f"V{y2 - 8:.0f} C{right:.0f} {y2 - 36:.0f} {x2:.0f} {y2 - 36:.0f} {x2:.0f} {y2:.0f}"
    )
    return f'<path class="wire back" d="{data}" marker-end="url(#arrow)"/>'


def _text(x: float, y: float, line: tuple[str, str]) -> str:
    kind, text = line
    return f'<text x="{x:.0f}" y="{y:.0f}" class="{kind}">{escape(text)}</text>'


def _width(line: tuple[str, str]) -> float:
    kind, text = line
    return len(text) * CHARACTER.get(kind, CHARACTER["name"])


def _lines(text: str) -> list[str]:
    """At most two lines, broken and cut at blanks."""
    return textwrap.wrap(
        text, PATH_WIDTH, max_lines=2, placeholder=" …", subsequent_indent="  ", break_long_words=False
    )
