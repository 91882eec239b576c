"""The light paths on every wire and in the picture, as regular expressions.

    direct = Direct(light)              direct.radiance: L@area    direct.samples: L@delta
    pt     = PathTracer(direct + pt)    pt.radiance: L@area (D|G|S)+ | L@delta (D|G) (D|G|S)*
    image  direct + pt                  L@area (D|G|S)* E | L@delta (D|G) (D|G|S)* E

Only sets are shown here, not counts: those are check_paths' business.
On entry: a network that has passed every check but that of its light paths.
"""

from __future__ import annotations

from lnc.library import CONTENTS
from lnc.network import Network, PathReport, Term
from lnc.passes.path_automaton import PathAutomaton
from lnc.paths.automaton import Dfa, TooLarge, intersection, union
from lnc.paths.language import ALL_LIGHT, DARK, Alphabet, path_dfa
from lnc.paths.regex import Renderer
from lnc.paths.weighted import CountTable, common_blocks, count_table, weighted_graph


def light_paths(network: Network, alphabet: Alphabet) -> PathReport:
    """Readable expressions; "too many to print" where an automaton outgrows its limit."""
    automaton = PathAutomaton(network, alphabet)
    renderer = Renderer(alphabet)
    wires: dict[str, tuple[tuple[str, str], ...]] = {}
    for node in network.nodes:
        found = automaton.contents_of(node.name)
        wires[node.name] = tuple(
            (c, _text(automaton, automaton.wire(node.name, c), renderer)) for c in CONTENTS if c in found
        )
    if network.image is None:
        return PathReport(wires, None, None, None)
    try:
        seen = automaton.language(automaton.image(network.image.terms, network.image.span))
        lacking = _lacking(seen, alphabet)
    except TooLarge:
        return PathReport(wires, TOO_MANY, None, None)
    if lacking.is_empty:
        return PathReport(wires, image_text(seen, renderer), None, None)
    missing = "".join(renderer.letter_names(letters)[0] for letters in lacking.shortest_word())
    return PathReport(wires, image_text(seen, renderer), renderer.text(lacking), missing)


def seen_paths(network: Network, alphabet: Alphabet) -> dict[str, str]:
    """What the eye sees of each wire that has a picture of its own (a term of `image ... layers`, of a `tap` or a
    `Difference`, or a `WireTap`): its paths, closed as the picture closes them, without the emitters that are seen."""
    terms = [t for tap in network.taps for t in tap.terms]
    if network.image is not None and network.image.layers:
        terms += network.image.terms
    terms += [t for n in network.nodes if n.op.name == "Difference" for i in n.inputs for t in i.terms]
    shown = {t.node for t in terms} | {n.name for n in network.nodes if n.op.name == "WireTap"}
    return _closed(network, alphabet, shown, baked=False)


def baked_paths(network: Network, alphabet: Alphabet) -> dict[str, str]:
    """The paths of each wire of a `lightmap`, which shows irradiance: what a surface scatters by D, seen at once."""
    return _closed(network, alphabet, {t.node for m in network.lightmaps for t in m.terms}, baked=True)


def _closed(network: Network, alphabet: Alphabet, wires: set[str], baked: bool) -> dict[str, str]:
    automaton = PathAutomaton(network, alphabet)
    renderer = Renderer(alphabet)
    by_name = network.by_name()
    return {
        name: _text(automaton, automaton.seen([Term(name, 1, by_name[name].span)], baked=baked), renderer)
        for name in sorted(wires)
    }


def wire_counts(network: Network, alphabet: Alphabet) -> dict[str, CountTable | None]:
    """How often the eye sees each path by a wire that brings light to surfaces, with signs and without; None where its
    automaton outgrows TABLE_LIMIT."""
    automaton = PathAutomaton(network, alphabet)
    counts: dict[str, CountTable | None] = {}
    for node in network.nodes:
        if automaton.contents_of(node.name) <= {"emission"}:
            continue
        ends = automaton.seen([Term(node.name, 1, node.span)])
        blocks = common_blocks([automaton.graph.edges])
        signed = weighted_graph(automaton.graph, ends, blocks)
        unsigned = weighted_graph(automaton.graph.unsigned(), ends, blocks) if signed.subtracts else signed
        try:
            counts[node.name] = count_table([signed, unsigned], TABLE_LIMIT)
        except TooLarge:
            counts[node.name] = None
    return counts


TABLE_LIMIT = 256  # states
TOO_MANY = "too many to print"


def image_text(seen: Dfa, renderer: Renderer) -> str:
    """A picture's paths; L@delta S* E carries no light, so the simpler of both truths is as true."""
    dark = path_dfa(DARK, renderer.alphabet)
    return min(renderer.scored(seen), renderer.scored(union(seen, dark)))[1]


def _lacking(seen: Dfa, alphabet: Alphabet) -> Dfa:
    """What of all light the picture lacks."""
    return intersection(path_dfa(ALL_LIGHT, alphabet), union(seen, path_dfa(DARK, alphabet)), negated=True)


def _text(automaton: PathAutomaton, accepting: set[int], renderer: Renderer) -> str:
    try:
        return renderer.text(automaton.language(accepting))
    except TooLarge:
        return TOO_MANY
