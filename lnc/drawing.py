"""A network as an SVG picture: light flows from left to right, inserted converters are dashed.

Layers are longest distances from the sources without the wires that lead back; within a layer, nodes are ordered by
the mean height of what they read. No graph program is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

from lnc.driver import Result, describe_paths
from lnc.graph import strong_components
from lnc.network import Network
from lnc.passes.check_cycles import wire_sources

CHARACTER = 7.6  # width of one in the label font, bold
ROW = 15
GAP_X, GAP_Y, MARGIN = 70, 26, 20
BEND = "bend"

STYLE = """
    text { font: 12px ui-sans-serif, Helvetica, Arial, sans-serif; fill: #222 }
    .name { font-weight: 600 } .paths { font-family: ui-monospace, Menlo, monospace; font-size: 11px; fill: #345 }
    rect { fill: #fff; stroke: #345; rx: 6 } .inserted rect { stroke-dasharray: 5 3; fill: #f6f6f6 }
    .result rect { fill: #eef5ea; stroke: #474 }
    path { fill: none; stroke: #567 } .back { stroke: #a54 } .push { stroke-width: 2.5 } marker path { fill: #567 }
"""


@dataclass
class _Box:
    name: str
    lines: list[tuple[str, str]]  # (class, text)
    reads: list[str]
    kind: str
    layer: int = 0
    x: float = 0
    y: float = 0
    width: float = 0
    height: float = 0

    def __post_init__(self) -> None:
        self.width = max((len(text) for _, text in self.lines), default=-1) * CHARACTER + 20
        self.height = len(self.lines) * ROW + 14


def draw(result: Result) -> str:
    """The network of a result that has passed, as an SVG document."""
    assert result.typed is not None
    network = result.typed.network
    boxes = _boxes(result)
    pushed = {(t.node, n.name) for n in network.nodes for i in n.inputs if i.port.complete for t in i.terms}
    back = _layers(boxes)
    _bend_long_wires(boxes, back)
    _place(boxes)
    width = max((b.x + b.width for b in boxes.values()), default=0) + MARGIN
    height = max((b.y + b.height for b in boxes.values()), default=0) + MARGIN + (40 if back else 0)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}">',
        f"<title>{escape(network.name)}</title>",
        f"<style>{STYLE}</style>",
        '<defs><marker id="arrow" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="9" markerHeight="9" '
        'markerUnits="userSpaceOnUse" orient="auto">'
        '<path d="M0 0 L8 4 L0 8 z"/></marker></defs>',
        f'<rect x="0" y="0" width="{width:.0f}" height="{height:.0f}" style="fill:#fff;stroke:none"/>',
    ]
    for box in boxes.values():
        parts += [_wire(boxes[s], box, (s, box.name) in back, (s, box.name) in pushed, height) for s in box.reads]
    parts += [_box(box) for box in boxes.values()]
    return "\n".join([*parts, "</svg>", ""])


def _boxes(result: Result) -> dict[str, _Box]:
    assert result.typed is not None
    network: Network = result.typed.network
    paths = describe_paths(result.typed)
    boxes: dict[str, _Box] = {}
    for node in network.nodes:
        lines = [("name", f"{node.name} = {node.op.name}"), ("", node.op.output)]
        lines += [("paths", f"{content}: {_short(text)}") for content, text in paths.wires[node.name]]
        if node.reason:
            lines.append(("", f"inserted: {node.op.name}"))
        kind = "inserted" if node.origin == "converter" else "node"
        boxes[node.name] = _Box(node.name, lines, wire_sources(node), kind)
    for i, (name, terms) in enumerate(network.results()):
        lines = [("name", _short(name))]
        if name == "image":
            lines.append(("paths", _short(paths.image or "")))
        boxes[f"\0result{i}"] = _Box(f"\0result{i}", lines, list(dict.fromkeys(t.node for t in terms)), "result")
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
    """A wire that passes layers gets a place of its own in each, so that it does not run behind boxes."""
    for box in list(boxes.values()):
        reads: list[str] = []
        for source in box.reads:
            through = source
            if (source, box.name) not in back:
                for layer in range(boxes[source].layer + 1, box.layer):
                    name = f"{source}\0{box.name}\0{layer}"
                    boxes[name] = _Box(name, [], [through], BEND, layer)
                    through = name
            reads.append(through)
        box.reads = reads


def _place(boxes: dict[str, _Box]) -> None:
    columns: dict[int, list[_Box]] = {}
    for box in boxes.values():
        columns.setdefault(box.layer, []).append(box)
    x = float(MARGIN)
    for layer in sorted(columns):
        column = columns[layer]

        def height(box: _Box) -> float:
            reads = [boxes[s].y + boxes[s].height / 2 for s in box.reads if boxes[s].layer < box.layer]
            return sum(reads) / len(reads) if reads else 0.0

        column.sort(key=height)
        y = float(MARGIN)
        for box in column:
            box.x, box.y = x, max(y, height(box) - box.height / 2)
            y = box.y + box.height + GAP_Y
        width = max(box.width for box in column)
        for box in column:
            box.width = width if box.kind == BEND else box.width
        x += width + GAP_X


def _box(box: _Box) -> str:
    lines = [
        f'<text x="{box.x + 10:.0f}" y="{box.y + 19 + i * ROW:.0f}" class="{kind}">{escape(text)}</text>'
        for i, (kind, text) in enumerate(box.lines)
    ]
    if box.kind == BEND:
        middle = box.y + box.height / 2
        return f'<path d="M{box.x:.0f} {middle:.0f} L{box.x + box.width:.0f} {middle:.0f}"/>'
    frame = f'<rect x="{box.x:.0f}" y="{box.y:.0f}" width="{box.width:.0f}" height="{box.height:.0f}"/>'
    return f'<g class="{box.kind}">{frame}{"".join(lines)}</g>'


def _wire(source: _Box, target: _Box, back: bool, push: bool, bottom: float) -> str:
    """A curve from the right of one box to the left of another; one that leads back runs below."""
    x0, y0 = source.x + source.width, source.y + source.height / 2
    x1, y1 = target.x, target.y + target.height / 2
    kinds = " ".join(k for k, on in (("wire", True), ("back", back), ("push", push)) if on)
    if back:
        low = min(max(source.y + source.height, target.y + target.height) + 24, bottom - 6)
        data = (
            f"M{x0:.0f} {y0 + 6:.0f} C{x0 + 30:.0f} {y0 + 6:.0f} {x0 + 30:.0f} {low:.0f} {x0:.0f} {low:.0f} "
            f"L{x1:.0f} {low:.0f} C{x1 - 30:.0f} {low:.0f} {x1 - 30:.0f} {y1 + 6:.0f} {x1:.0f} {y1 + 6:.0f}"
        )
    else:
        bend = max(30.0, (x1 - x0) / 2)
        data = f"M{x0:.0f} {y0:.0f} C{x0 + bend:.0f} {y0:.0f} {x1 - bend:.0f} {y1:.0f} {x1:.0f} {y1:.0f}"
    arrow = "" if target.kind == BEND else ' marker-end="url(#arrow)"'
    return f'<path class="{kinds}" d="{data}"{arrow}/>'


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
