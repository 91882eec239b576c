"""The representation of every wire, and the tags that the network tells apart.

    photons = ParticleTracer(light)         photons: Photons
    caustic = NNDensity(photons)            caustic: Points (its port takes PhotonMap: left to insert_converters)

On entry: a resolved network. On exit: the number of tags is within its limit.
"""

from __future__ import annotations

from lnc.diagnostics import Reporter
from lnc.network import Network, PathValue, TypedNetwork
from lnc.paths.language import TAG_LIMIT, Alphabet, tags_in
from lnc.syntax.ast import TagRef


def typecheck(network: Network, reporter: Reporter) -> TypedNetwork:
    """The network with its types; too many tags are LN0502."""
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
