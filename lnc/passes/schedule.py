"""The order in which a network is built, prepared and pulled.

    image direct + caustic      nodes light, direct, photons, photons_tree, caustic; prepare photons, photons_tree

On entry: a network with converters, sound cycles and known contents. On exit: all that code generation needs.
Nodes that no result needs are left out.
"""

from __future__ import annotations

from lnc.graph import strong_components
from lnc.library import POINTS
from lnc.network import Network, Node, Schedule, ScheduledInput, ScheduledNode, Tap, Term
from lnc.passes.check_cycles import wire_sources
from lnc.source import Span
from lnc.syntax.ast import TagRef

TEXT_LIMIT = 400
CPP_WORDS = frozenset(
    """alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t char32_t class
    compl concept const consteval constexpr constinit const_cast continue co_await co_return co_yield decltype
    default delete do double dynamic_cast else enum explicit export extern false float for friend goto if
    inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected
    public register reinterpret_cast requires return short signed sizeof static static_assert static_cast
    struct switch template this thread_local throw true try typedef typeid typename union unsigned using
    virtual void volatile wchar_t while xor xor_eq main std ln assert errno stdin stdout stderr NULL EOF
    INFINITY NAN linux unix i386""".split()
)


def schedule(network: Network, contents: dict[str, tuple[str, ...]]) -> Schedule:
    """The live part of the network, sources first."""
    nodes = network.by_name()
    sources = {name: wire_sources(nodes[name]) for name in _live(network, nodes)}
    components = strong_components(sources)
    cycles = tuple(tuple(c) for c in components if len(c) > 1 or c[0] in sources[c[0]])
    recursive = {name for cycle in cycles for name in cycle}
    order = [name for component in components for name in component]
    position = {name: i for i, name in enumerate(order)}
    heads = {s for name in order for s in sources[name] if position[s] >= position[name]}
    identifiers = _identifiers(order)
    scheduled = tuple(
        _scheduled(nodes[n], identifiers[n], contents[n], n in recursive, n in heads, network.file) for n in order
    )
    return Schedule(
        network=network.name,
        file=network.file,
        nodes=scheduled,
        prepare=tuple(n.name for n in scheduled if n.prepares),
        cycles=cycles,
        image=network.image,
        taps=tuple(tap for tap in network.taps if _is_picture(tap, nodes)),
        stored_taps=tuple(tap for tap in network.taps if not _is_picture(tap, nodes)),
        probes=network.probes,
        lightmaps=network.lightmaps,
        tags=network.tags,
        wanted=tuple(dict.fromkeys(term.node for _, terms in network.results() for term in terms)),
    )


def _live(network: Network, nodes: dict[str, Node]) -> list[str]:
    """What a result needs, in the order of the text."""
    stack = [term.node for _, terms in network.results() for term in terms]
    live: set[str] = set()
    while stack:
        name = stack.pop()
        if name not in live:
            live.add(name)
            stack += wire_sources(nodes[name])
    return [node.name for node in network.nodes if node.name in live]


def _is_picture(tap: Tap, nodes: dict[str, Node]) -> bool:
    return all(nodes[term.node].op.output == POINTS for term in tap.terms)


def _scheduled(
    node: Node, identifier: str, contents: tuple[str, ...], recursive: bool, head: bool, file: str
) -> ScheduledNode:
    to = node.parameter("to")
    return ScheduledNode(
        name=node.name,
        identifier=identifier,
        op=node.op,
        inputs=tuple(ScheduledInput(i.port, i.terms) for i in node.inputs),
        parameters=node.parameters,
        contents=contents,
        prepares=node.op.prepares,
        recursive=recursive,
        head=head,
        receivers=to.value if to and isinstance(to.value, TagRef) else None,
        origin=node.origin,
        reason=node.reason,
        file=node.statement.source.name,
        line=node.statement.line,
        text=_first_line(node.statement),
    )


def _first_line(statement: Span) -> str:
    """The statement on one line, cut where it gets long."""
    text = statement.source.text[statement.start : min(statement.end, statement.start + TEXT_LIMIT)]
    return " ".join(text.split()) + ("..." if statement.end - statement.start > TEXT_LIMIT else "")


def _identifiers(names: list[str]) -> dict[str, str]:
    """Unique C++ identifiers: the name itself, or with underscores behind where C++ keeps it for itself."""
    taken = set(names)
    identifiers: dict[str, str] = {}
    for name in names:
        identifier = name
        if name in CPP_WORDS or "__" in name or (name[0] == "_"):
            identifier = "wire_" + "_".join(part for part in name.split("_") if part)
            identifier = identifier.rstrip("_")
            number, base = 1, identifier
            while identifier in taken:
                number += 1
                identifier = f"{base}_{number}"
            taken.add(identifier)
        identifiers[name] = identifier
    return identifiers


def print_schedule(plan: Schedule) -> str:
    """A stable text of everything in a schedule that the generated program depends on."""
    lines = [f"schedule {plan.network}"]
    for tag in plan.tags:
        lines.append(f"tag {tag.name} = " + " | ".join(f'{kind} "{glob}"' for kind, glob in tag.globs))
    for node in plan.nodes:
        marks = [m for m in ("prepares", "recursive", "head") if getattr(node, m)]
        lines.append(f"node {node.name}: {node.op.output} = {node.op.name}" + "".join(f" [{m}]" for m in marks))
        if node.identifier != node.name:
            lines.append(f"    identifier {node.identifier}")
        lines.append(f"    contents {', '.join(node.contents) or 'none'}")
        for given in node.inputs:
            how = "complete " if given.port.complete else ""
            lines.append(f"    {how}{given.port.name} <- {_terms_text(given.terms)}")
        for parameter in node.parameters:
            value = getattr(parameter.value, "text", parameter.value)
            lines.append(f"    {parameter.name} = {value!r}")
    lines.append(f"prepare {', '.join(plan.prepare) or 'nothing'}")
    lines += [f"cycle {' -> '.join(cycle)}" for cycle in plan.cycles]
    if plan.image is not None:
        lines.append(f"image {_terms_text(plan.image.terms)}" + (" layers" if plan.image.layers else ""))
    lines += [f"tap {_terms_text(tap.terms)} -> {tap.file!r}" for tap in plan.taps]
    lines += [f"tap {_terms_text(tap.terms)} -> {tap.file!r} [stored]" for tap in plan.stored_taps]
    lines += [f"probe {_terms_text(probe.terms)} at {probe.sensors!r} -> {probe.file!r}" for probe in plan.probes]
    lines += [f"lightmap {_terms_text(each.terms)} -> {each.file!r}" for each in plan.lightmaps]
    return "\n".join(lines) + "\n"


def _terms_text(terms: tuple[Term, ...]) -> str:
    return " ".join(f"{'+' if t.weight >= 0 else '-'} {abs(t.weight):g} {t.node}" for t in terms)
