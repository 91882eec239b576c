"""The cheapest chain of declared converters wherever a port takes another representation than its wire has.

    photons = ParticleTracer(light)         photons      = ParticleTracer(light)
    caustic = NNDensity(photons)            photons_tree = KDPhotonTree(photons)
                                            caustic      = NNDensity(photons_tree)

On entry: a typed network. On exit: every port reads wires of its own representation; several wires only as Points.
Inserted nodes take their parameters' defaults, say why they are there, and are shared by all ports that need them.
A tap takes what its file can hold: the wire as it is stored, or Points.
No chain is LN0201; two cheapest chains are LN0202, never a silent choice.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath

from lnc.conversions import cheapest_chains
from lnc.diagnostics import Related, Reporter, quote
from lnc.library import POINTS, Library, Operator, snake_case
from lnc.naming import Names
from lnc.network import Input, Node, ParameterValue, Tap, Term, TypedNetwork
from lnc.passes.parameters import parameter_value
from lnc.source import Span


def insert_converters(typed: TypedNetwork, library: Library, reporter: Reporter) -> TypedNetwork:
    """The network with converters inserted, each before the first node that reads it."""
    return _Inserter(typed, library, reporter).run()


class _Inserter:
    def __init__(self, typed: TypedNetwork, library: Library, reporter: Reporter) -> None:
        self.typed = typed
        self.library = library
        self.reporter = reporter
        self.representations = dict(typed.representations)
        self.nodes: list[Node] = []
        self.names = Names(node.name for node in typed.network.nodes)
        self.shared: dict[tuple[tuple[tuple[str, float], ...], str], str] = {}
        self.definitions = {node.name: node for node in typed.network.nodes}
        for node in typed.network.nodes:
            if node.origin == "converter":  # for an input of a macro
                self.shared[((node.inputs[0].terms[0].node, 1.0),), node.op.output] = node.name

    def run(self) -> TypedNetwork:
        network = self.typed.network
        for node in network.nodes:
            inputs = tuple(
                replace(i, terms=self._terms(i.terms, i.port.representation, f"{node.name}.{i.port.name}", i, node))
                for i in node.inputs
            )
            self.nodes.append(replace(node, inputs=inputs))
        image = network.image
        if image is not None:
            image = replace(image, terms=self._result(image.terms, "image", image.span))
        taps = tuple(self._tap(tap) for tap in network.taps)
        probes = tuple(replace(probe, terms=self._result(probe.terms, "probe", probe.span)) for probe in network.probes)
        lightmaps = tuple(replace(m, terms=self._result(m.terms, "lightmap", m.span)) for m in network.lightmaps)
        network = replace(network, nodes=tuple(self.nodes), image=image, taps=taps, probes=probes, lightmaps=lightmaps)
        return replace(self.typed, network=network, representations=self.representations)

    def _tap(self, tap: Tap) -> Tap:
        """The tap of a wire as it is stored, where that can be written as such a file; otherwise of Points."""
        suffix = PurePath(tap.file).suffix.lower()
        whole = len(tap.terms) == 1 and tap.terms[0].weight == 1
        found = self.representations.get(tap.terms[0].node, POINTS) if whole else POINTS
        formats = self.library.representations[found].taps
        points = self.library.representations[POINTS].taps
        if suffix in formats:
            return tap
        if found != POINTS and cheapest_chains(self.library, found, POINTS):
            formats += points
        if suffix not in formats or "\0" in tap.file:
            what = f"'{tap.terms[0].node}' is {found}" if whole else f"a sum is made of {POINTS}"
            known = f"which a tap writes as {' or '.join(formats)}, not as {quote(tap.file)}"
            message = f"{what}, {known if formats else 'which no tap can write'}"
            self.reporter.error("LN0104", tap.file_span, message)
            return tap
        return replace(tap, terms=self._result(tap.terms, "tap", tap.span))

    def _result(self, terms: tuple[Term, ...], name: str, span: Span) -> tuple[Term, ...]:
        return tuple(self._convert(term, POINTS, f"'{name}' takes {POINTS}", name, span, None) for term in terms)

    def _terms(
        self, terms: tuple[Term, ...], wanted: str, place: str, given: Input, consumer: Node
    ) -> tuple[Term, ...]:
        declared = Related(given.port.span, f"'{consumer.op.name}' declares '{given.port.name}: {wanted}' here")
        reason = f"'{place}' takes {wanted}"
        if len(terms) == 1:
            return (self._convert(terms[0], wanted, reason, consumer.name, consumer.statement, declared),)
        reason_points = f"a sum is made of {POINTS}" + ("" if wanted == POINTS else f", and {reason}")
        if (wrong := self._no_sum(terms, wanted)) is not None:
            self._report_sum(terms, wrong, consumer)
            return terms
        terms = tuple(
            self._convert(term, POINTS, reason_points, consumer.name, consumer.statement, declared) for term in terms
        )
        if wanted == POINTS or any(self.representations.get(t.node) != POINTS for t in terms):
            return terms
        total = Term(self._sum(terms, reason, consumer, given.span), 1.0, given.span)
        return (self._convert(total, wanted, reason, consumer.name, consumer.statement, declared),)

    def _no_sum(self, terms: tuple[Term, ...], wanted: str) -> Term | None:
        """The first term that cannot become Points, if what is wanted might be made of each alone."""
        for term in terms:
            found = self.representations.get(term.node, POINTS)
            if not cheapest_chains(self.library, found, POINTS) and cheapest_chains(self.library, found, wanted):
                return term
        return None

    def _report_sum(self, terms: tuple[Term, ...], wrong: Term, consumer: Node) -> None:
        message = f"a sum is made of {POINTS}, '{wrong.node}' is {self.representations[wrong.node]}"
        related = []
        source = self.definitions.get(wrong.node)
        if source is not None and source.span != wrong.span:
            related.append(Related(source.span, f"'{wrong.node}' is made here"))
        each = [f"{'-' if t.weight < 0 else '+'} {consumer.op.name}({t.node})" for t in terms]
        help = f"add up what it is for: {' '.join(each).removeprefix('+ ')}"
        self.reporter.error("LN0201", wrong.span, message, related=related, help=help)

    def _convert(
        self, term: Term, wanted: str, reason: str, base: str, statement: Span, declared: Related | None
    ) -> Term:
        found = self.representations.get(term.node)
        if found is None or found == wanted:
            return term
        chains = cheapest_chains(self.library, found, wanted)
        if len(chains) != 1:
            self._report(term, found, wanted, reason, chains, declared)
            return term
        name = term.node
        for op in chains[0]:
            key = (((name, 1.0),), op.output)
            if key not in self.shared:
                source = Input(op.ports[0], (Term(name, 1.0, term.span),), term.span)
                why = f"{reason}, '{term.node}' is {found}"
                self.shared[key] = self._add(f"{term.node}_{_last_word(op)}", op, source, why, term.span, statement)
            name = self.shared[key]
        return replace(term, node=name)

    def _sum(self, terms: tuple[Term, ...], reason: str, consumer: Node, span: Span) -> str:
        key = (tuple((t.node, t.weight) for t in terms), POINTS)
        if key not in self.shared:
            op = self.library.operators["Sum"]
            source = Input(op.ports[0], terms, span)
            why = f"{reason}, which reads one wire"
            self.shared[key] = self._add(f"{consumer.name}_sum", op, source, why, span, consumer.statement)
        return self.shared[key]

    def _add(self, name: str, op: Operator, source: Input, reason: str, span: Span, statement: Span) -> str:
        free = self.names.free(name)
        self.representations[free] = op.output
        defaults = [parameter_value(p, None, (), self.reporter) for p in op.parameters]
        parameters: tuple[ParameterValue, ...] = tuple(v for v in defaults if v is not None)
        self.nodes.append(Node(free, op, (source,), parameters, "converter", span, statement, reason))
        return free

    def _report(
        self,
        term: Term,
        found: str,
        wanted: str,
        reason: str,
        chains: list[tuple[Operator, ...]],
        declared: Related | None,
    ) -> None:
        related = [declared] if declared else []
        source = self.definitions.get(term.node)
        if source is not None and source.span != term.span:
            related.append(Related(source.span, f"'{term.node}' is made here"))
        if chains:
            listed = ", ".join(" then ".join(op.name for op in chain) for chain in chains)
            message = f"{reason}, '{term.node}' is {found}, and several conversions cost the same: {listed}"
            help = "write the one you want as a call"
            self.reporter.error("LN0202", term.span, message, related=related, help=help)
            return
        message = f"{reason}, '{term.node}' is {found}, and no converter leads from one to the other"
        self.reporter.error("LN0201", term.span, message, related=related, help=self._bridge(found, wanted))

    def _bridge(self, found: str, wanted: str) -> str | None:
        """An operator that is no converter but takes what there is and gives what is wanted."""
        for op in sorted(self.library.operators.values(), key=lambda o: o.name):
            if (
                op.output == wanted
                and op.ports
                and len(cheapest_chains(self.library, found, op.ports[0].representation))
            ):
                return f"{op.name}(...) makes {wanted} from {found}"
        return None


def _last_word(op: Operator) -> str:
    return snake_case(op.name).rsplit("_", 1)[-1]
