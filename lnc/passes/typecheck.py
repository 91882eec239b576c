"""The representation of every wire, and the tags that the network tells apart.

    photons = ParticleTracer(light)         photons: Photons
    caustic = NNDensity(photons)            caustic: Points (its port takes PhotonMap: left to insert_converters)

On entry: a resolved network. On exit: annotations hold, and the number of tags is within its limit.
"""

from __future__ import annotations

from lnc.diagnostics import Related, Reporter
from lnc.network import Network, PathValue, TypedNetwork
from lnc.paths.language import TAG_LIMIT, Alphabet, tags_in
from lnc.syntax.ast import TagRef


def typecheck(network: Network, reporter: Reporter) -> TypedNetwork:
    """The network with its types; a wrong annotation is LN0201, too many tags are LN0502."""
    for node in network.nodes:
        if node.annotation is not None and node.annotation != node.op.output:
            message = f"'{node.name}' is to be {node.annotation}, but '{node.op.name}' gives {node.op.output}"
            declared = Related(node.op.span, f"'{node.op.name}' is declared here")
            help = f"to convert it, write: ... as {node.annotation}"
            reporter.error("LN0201", node.span, message, related=[declared], help=help)
    representations = {node.name: node.op.output for node in network.nodes}
    return TypedNetwork(network, representations, _alphabet(network, reporter))


def _alphabet(network: Network, reporter: Reporter) -> Alphabet:
    used: set[str] = set()
    for node in network.nodes:
        for parameter in node.parameters:
            if isinstance(parameter.value, TagRef):
                used.add(parameter.value.name)
            elif isinstance(parameter.value, PathValue):
                used |= tags_in(parameter.value.expression)
    for expectation in network.expectations:
        used |= tags_in(expectation.path)
    known = [tag for tag in network.tags if tag.name in used]
    if len(known) > TAG_LIMIT:
        message = f"the network tells {len(known)} tags apart, which makes more than {1 << TAG_LIMIT} combinations"
        reporter.error("LN0502", known[TAG_LIMIT].span, message, help=f"use {TAG_LIMIT} tags at most")
    return Alphabet(tuple(tag.name for tag in known[:TAG_LIMIT]))
