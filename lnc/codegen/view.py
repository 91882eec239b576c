"""A Schedule as plain data for the template: every decision is taken here, the template only loops and substitutes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath

import lnc
from lnc.build import digest, runtime_sources
from lnc.codegen.languages import TagRuleView, tag_rules
from lnc.codegen.names import cpp_string, float_literal, unique_names
from lnc.codegen.wires import PathTable, WireView, wire_views
from lnc.diagnostics import InternalError
from lnc.library import POINTS, first_sentence, snake_case
from lnc.network import Lightmap, ParameterValue, PathValue, Probe, Schedule, ScheduledInput, ScheduledNode, Tap, Term
from lnc.passes.conditions import Formula, holds
from lnc.paths.language import EMITTERS, EVENTS, Alphabet
from lnc.paths.regex import Renderer
from lnc.paths.weighted import CountTable
from lnc.syntax.ast import TagRef

LETTER_KINDS = len(EMITTERS) + len(EVENTS)


@dataclass(frozen=True)
class TermView:
    """A wire in a sum: `factor * value`, with a pull or a variable as its value; an empty factor is 1."""

    value: str
    factor: str


@dataclass(frozen=True)
class InputView:
    """An argument of an operator: a sum of Points wires, or another node's accessor."""

    terms: tuple[TermView, ...]
    accessor: str = ""
    functor: str = ""  # name of the type that evaluates the terms


@dataclass(frozen=True)
class TableView:
    """A path parameter as a type."""

    type_name: str
    text: str
    tags: tuple[str, ...]  # bits of the tags it tells apart
    next: tuple[tuple[int, ...], ...]
    accepting: tuple[str, ...]


@dataclass(frozen=True)
class SlotView:
    """A parameter that --set can change."""

    node: str
    name: str
    kind: str
    member: str
    low: str
    high: str
    choices: tuple[str, ...]
    choices_name: str
    summary: str


@dataclass(frozen=True)
class NeedView:
    """A set of letters that a light path needs: by kind, the combinations of tags; and what it is called."""

    letters: tuple[str, ...]
    noun: str


@dataclass(frozen=True)
class SkipView:
    """When a node carries no light: if a scene has all needs of none of the alternatives (bit i: needs[i])."""

    flag: str
    known: bool  # that it carries none: the program is for one scene
    constant: str
    table: str
    needs: tuple[NeedView, ...]
    alternatives: tuple[str, ...]


@dataclass(frozen=True)
class CacheView:
    """A node that may know its wire from an earlier run."""

    network: str  # stands for the part of the network that leads to it
    code: str  # and for the sources that do the work
    parameters: tuple[str, ...]  # NODE.PARAMETER: those that count, as they are when the program runs
    for_view: bool  # it depends on what results look at


@dataclass(frozen=True)
class NodeView:
    member: str
    type_name: str
    pull: str  # empty unless the node's wire answers requests
    constant: str
    fields: tuple[tuple[str, str], ...]
    inputs: tuple[InputView, ...]
    tables: tuple[TableView, ...]
    skip: str  # the flag that says that the node carries no light; empty: it always may
    receivers: str  # where `to` wants the wire; empty: everywhere
    prepares: bool
    guard: str  # a C++ condition for its preparation; empty: always
    cache: CacheView | None
    name: str
    op: str
    line: int
    text: str
    reason: str
    file: str
    wire: WireView | None  # what it carries to surfaces
    carried: str  # the same as a value, for --verify-paths


@dataclass(frozen=True)
class SeenView:
    """A wire that the eye sees: a variable for what is pulled once (`pull`), or for a sum of other such variables."""

    variable: str
    pull: str
    terms: tuple[TermView, ...]


@dataclass(frozen=True)
class LayerView:
    """A picture of some wires, as a layer or, with `file`, on its own. Without `terms`: others fill it."""

    name: str
    light_paths: str
    terms: tuple[TermView, ...] = ()
    file: str = ""
    is_signed: bool = False  # shows negative values, too


@dataclass(frozen=True)
class DifferenceView:
    """Two wires that are compared: the layers that show them."""

    name: str
    a: int
    b: int


@dataclass(frozen=True)
class ProbeView:
    """A wire that is measured at sensors."""

    functor: str  # name of the type that evaluates the terms
    terms: tuple[TermView, ...]
    wire: str
    sensors: str
    file: str
    on_surfaces: bool  # the wire is known on surfaces only


@dataclass(frozen=True)
class LightmapView:
    """A wire that is baked onto the surfaces."""

    functor: str  # name of the type that evaluates the terms
    terms: tuple[TermView, ...]
    wire: str
    light_paths: str
    file: str


@dataclass(frozen=True)
class StoredTapView:
    """A wire that is written as it is stored."""

    accessor: str
    wire: str
    light_paths: str
    file: str


@dataclass(frozen=True)
class ProgramView:
    network: str
    file: str
    source_lines: tuple[str, ...]
    headers: tuple[str, ...]
    nodes: tuple[NodeView, ...]
    prepare: tuple[NodeView, ...]
    seen: tuple[SeenView, ...]
    picture: tuple[TermView, ...]
    layers: tuple[LayerView, ...]
    emitters_layer: int  # the layer of the emitters that are seen; -1: there is none
    subtracts: bool
    differences: tuple[DifferenceView, ...]
    shows_difference: bool  # the picture is that of a Difference
    stored_taps: tuple[StoredTapView, ...]
    probes: tuple[ProbeView, ...]
    lightmaps: tuple[LightmapView, ...]
    has_image: bool
    slots: tuple[SlotView, ...]
    tags: tuple[TagRuleView, ...]
    image_paths: str
    skips: tuple[SkipView, ...]
    path_tags: tuple[str, ...]  # numbers of the tags that light paths tell apart
    compiled_for: str  # the only scene that the program is for; empty: any
    absent: tuple[NeedView, ...]  # what that scene does not have
    scene_events: str
    path_tables: tuple[PathTable, ...]


@dataclass(frozen=True)
class SceneLetters:
    """The letters of light paths that a scene has; `file`: its name."""

    file: str
    letters: int


@dataclass(frozen=True)
class LightView:
    """What is known of a network's light paths.

    `image_paths`: those of the picture; `seen_paths`: those of each wire that has a picture of its own, as the eye sees
    it; `baked_paths`: those that lightmaps show of their wires; `counts`: how often each path is, for every wire that
    brings light to surfaces; `conditions`: what a scene must have for operators to carry light, in letters of
    `alphabet`; `scene`: the only one that the program is for, if so.
    """

    image_paths: str
    seen_paths: dict[str, str]
    baked_paths: dict[str, str]
    counts: Mapping[str, CountTable | None]
    conditions: dict[str, Formula]
    alphabet: Alphabet
    scene: SceneLetters | None = None


def program_view(schedule: Schedule, source: str, light: LightView) -> ProgramView:
    """The view of a network with the text `source`."""
    return _Builder(schedule, light).build(source)


class _Builder:
    def __init__(self, schedule: Schedule, light: LightView) -> None:
        self.schedule = schedule
        self.light = light
        self.renderer = Renderer(light.alphabet)
        self.conditions = light.conditions
        if light.scene is not None:
            has = light.scene.letters
            self.conditions = {n: f for n, f in light.conditions.items() if not holds(f, has)}
        dark = self.conditions if light.scene else ()
        self.wires = wire_views(schedule, light.counts, light.alphabet, dark)
        wires = [n.identifier for n in schedule.nodes]
        self.members = unique_names(wires)
        self.pulls = unique_names(wires, "pull_", self.members.values())
        self.constants = unique_names(wires, "k_", [*self.members.values(), *self.pulls.values()])
        self.variables = unique_names(wires, "seen_", [*self.members.values(), *self.pulls.values()])
        numbers = [str(i + 1) for i in range(len(schedule.probes))]
        self.probes = list(unique_names(numbers, "probe_", [*self.members.values()]).values())
        numbers = [str(i + 1) for i in range(len(schedule.lightmaps))]
        self.lightmaps = list(unique_names(numbers, "lightmap_", [*self.members.values()]).values())
        self.flags = unique_names(
            [n.identifier for n in schedule.nodes if n.name in self.conditions], "skip_", self.members.values()
        )
        self.by_name = {n.name: n for n in schedule.nodes}
        self.needed = self.upstream(schedule.wanted, through_caches=False)
        self.tag_bits = {tag.name: i for i, tag in enumerate(schedule.tags)}
        self.layers: list[LayerView] = []
        self.differences: list[DifferenceView] = []

    def build(self, source: str) -> ProgramView:
        nodes = {n.name: self.node(n) for n in self.schedule.nodes}
        image = self.schedule.image
        emitters_layer = self.result_layers()
        file = PurePath(self.schedule.file).name
        return ProgramView(
            network=self.schedule.network,
            file=file,
            source_lines=tuple(source.splitlines()),
            headers=tuple(sorted({_header(n) for n in self.schedule.nodes})),
            nodes=tuple(nodes.values()),
            prepare=tuple(nodes[name] for name in self.schedule.prepare),
            seen=self.seen(),
            picture=self.seen_terms(image.terms) if image else (),
            layers=tuple(self.layers),
            emitters_layer=emitters_layer,
            differences=tuple(self.differences),
            shows_difference=image is not None and self.difference(image.terms) is not None,
            subtracts=any(self.is_signed(terms) for terms in self.results()),
            stored_taps=tuple(self.stored_tap(tap) for tap in self.schedule.stored_taps),
            probes=tuple(self.probe(i, probe) for i, probe in enumerate(self.schedule.probes)),
            lightmaps=tuple(self.lightmap(i, each) for i, each in enumerate(self.schedule.lightmaps)),
            has_image=self.schedule.image is not None,
            slots=tuple(slot for n in self.schedule.nodes for slot in self.slots(n)),
            tags=tag_rules(self.schedule.tags),
            image_paths=self.light.image_paths,
            skips=tuple(self.skip(self.by_name[name]) for name in self.conditions),
            path_tags=tuple(str(self.tag_bits[tag]) for tag in self.light.alphabet.tags),
            compiled_for=self.light.scene.file if self.light.scene else "",
            absent=self.absent(),
            scene_events=self.scene_events(),
            path_tables=tuple(dict.fromkeys(wire.paths for wire in self.wires.values())),
        )

    def node(self, n: ScheduledNode) -> NodeView:
        tables = tuple(self.table(n, p) for p in n.parameters if isinstance(p.value, PathValue))
        arguments = ", ".join(t.type_name for t in tables)
        return NodeView(
            member=self.members[n.identifier],
            type_name=f"ln::ops::{n.op.name}" + (f"<{arguments}>" if tables else ""),
            pull=self.pulls[n.identifier] if n.op.pulled else "",
            constant=self.constants[n.identifier],
            fields=tuple(
                (p.name, self.field(n, p))
                for p in n.parameters
                if not isinstance(p.value, PathValue) and not (p.name == "to" and n.op.output == POINTS)
            ),
            inputs=tuple(argument for i in n.inputs for argument in self.arguments(n, i)),
            tables=tables,
            skip=self.flags.get(n.identifier, ""),
            receivers=self.selection(n.receivers) if n.receivers else "",
            prepares=n.prepares,
            guard=self.guard(n),
            cache=self.cache(n) if n.op.cached else None,
            name=n.name,
            op=n.op.name,
            line=n.line,
            text=n.text,
            reason=n.reason,
            file=PurePath(n.file).name,
            wire=self.wires.get(n.name),
            carried=self.carried(n),
        )

    def carried(self, n: ScheduledNode) -> str:
        """What a wire carries: something that answers requests, or what is stored; null where neither is known."""
        if n.op.output == POINTS:
            pull = self.pulls[n.identifier]
            return f"ln::irradiance_of<scene_events>([this](auto& request) {{ return {pull}(request); }})"
        return "nullptr" if n.op.pulled else self.accessor(n.name)

    # --- Caches -------------------------------------------------------------------------------------------------------

    def upstream(self, names: Iterable[str], through_caches: bool) -> set[str]:
        """The nodes with these names and all that they read; what caches read whole only where `through_caches`."""
        found: set[str] = set()
        stack = list(names)
        while stack:
            name = stack.pop()
            if name not in found:
                found.add(name)
                n = self.by_name[name]
                stack += self.sources(n)
                if through_caches or not n.op.cached:
                    stack += self.whole_sources(n)
        return found

    def sources(self, n: ScheduledNode) -> list[str]:
        """What a node asks while others ask it."""
        return [term.node for i in n.inputs for term in i.terms if not i.port.complete]

    def whole_sources(self, n: ScheduledNode) -> list[str]:
        """What a node reads when it prepares, and never again."""
        return [term.node for i in n.inputs for term in i.terms if i.port.complete]

    def guard(self, n: ScheduledNode) -> str:
        """When a node is to be prepared: if it carries light, and some cache that alone needs it has nothing stored."""
        skip = self.flags.get(n.identifier)
        conditions = [f"!{skip}"] if skip else []
        if wanted := self.wanted(n):
            conditions.append(wanted)
        if n.op.cached:
            conditions.append(f"{self.members[n.identifier]}.wanted()")
        return " && ".join(conditions)

    def wanted(self, n: ScheduledNode) -> str:
        """The caches that a node serves, as a condition; empty if a result needs it, too."""
        if n.name in self.needed:
            return ""
        served: list[str] = []
        for cache in self.schedule.nodes:
            if cache.op.cached and n.name in self.upstream(self.whole_sources(cache), through_caches=False):
                outer = self.wanted(cache)
                served.append(f"{self.members[cache.identifier]}.wanted()" + (f" && {outer}" if outer else ""))
        return f"({' || '.join(served)})" if len(served) > 1 else "".join(served)

    def cache(self, n: ScheduledNode) -> CacheView:
        """What a cached wire is made from, and by which sources."""
        nodes = [self.by_name[name] for name in sorted(self.upstream([n.name], through_caches=True))]
        lines = [f"{tag.name} {tag.globs}" for tag in self.schedule.tags]
        for node in nodes:
            inputs = [(i.port.name, [(t.node, t.weight) for t in i.terms]) for i in node.inputs]
            parameters = [(p.name, getattr(p.value, "text", p.value)) for p in _making(node)]
            lines.append(f"{node.name} {node.op.name} {inputs} {parameters}")
        headers = sorted({Path(node.op.folder) / f"{node.op.file_stem}.hpp" for node in nodes})
        code = [lnc.__version__, runtime_sources(), *(header.read_text("utf-8") for header in headers)]
        return CacheView(
            network=digest(lines),
            code=digest(code),
            parameters=tuple(f"{node.name}.{p.name}" for node in nodes for p in _making(node)),
            for_view=any(node.op.for_view for node in nodes),
        )

    def skip(self, n: ScheduledNode) -> SkipView:
        """The condition of a node as tables; one too long for them becomes "always"."""
        formula = self.conditions[n.name]
        sets = sorted({letters for way in formula for letters in way})
        if len(sets) > 64:
            sets, formula = [], ((),)
        return SkipView(
            flag=self.flags[n.identifier],
            known=self.light.scene is not None,
            constant=self.constants[n.identifier],
            table=f"k_{self.flags[n.identifier]}",
            needs=tuple(map(self.need, sets)),
            alternatives=tuple(hex(sum(1 << sets.index(letters) for letters in way)) for way in formula),
        )

    def need(self, letters: int) -> NeedView:
        count = self.light.alphabet.combinations
        kinds = tuple(hex(letters >> (i * count) & (1 << count) - 1) for i in range(LETTER_KINDS))
        return NeedView(kinds, self.renderer.noun(letters))

    def absent(self) -> tuple[NeedView, ...]:
        """What the scene that the program is for does not have, kind by kind."""
        if self.light.scene is None:
            return ()
        alphabet = self.light.alphabet
        kinds = [alphabet.emitters(kind) for kind in EMITTERS] + [alphabet.events(event) for event in EVENTS]
        missing = (kind & ~self.light.scene.letters for kind in kinds)
        return tuple(self.need(letters) for letters in missing if letters)

    def scene_events(self) -> str:
        """The events of the scene that the program is for, in C++."""
        scene = self.light.scene
        if scene is None:
            return "ln::Events::all"
        found = [event for event in EVENTS if scene.letters & self.light.alphabet.events(event)]
        return " | ".join(f"ln::Events::{event}" for event in found) or "ln::Events::none"

    def field(self, n: ScheduledNode, p: ParameterValue) -> str:
        """The C++ initialiser of a parameter."""
        value = p.value
        kind = p.declaration.type
        if kind == "tags":
            return self.selection(value) if isinstance(value, TagRef) else "ln::TagSelection()"
        if kind == "text" and p.name == "layer":
            return str(self.layer(str(value), self.light.seen_paths.get(n.name, "")))
        if kind == "text":
            return cpp_string(str(value))
        if kind == "choice":
            return str(p.declaration.choices.index(str(value)))
        if kind == "flag":
            return "true" if value else "false"
        if not isinstance(value, int | float):
            raise InternalError(f"parameter {n.name}.{p.name} has the value {value!r}")
        return str(int(value)) if kind == "count" else float_literal(value)

    def selection(self, tag: TagRef) -> str:
        return f"ln::TagSelection::{'without' if tag.negated else 'with'}({self.tag_bits[tag.name]})"

    def layer(self, name: str, light_paths: str, terms: tuple[TermView, ...] = ()) -> int:
        """Number of the layer called `name`, a new one."""
        self.layers.append(LayerView(name, light_paths, terms))
        return len(self.layers) - 1

    def table(self, n: ScheduledNode, p: ParameterValue) -> TableView:
        assert isinstance(p.value, PathValue)
        events = p.value.events
        return TableView(
            type_name=f"{self.members[n.identifier]}_{p.name}",
            text=p.value.text,
            tags=tuple(str(self.tag_bits[t]) for t in events.tags),
            next=events.next,
            accepting=tuple("true" if a else "false" for a in events.accepting),
        )

    def arguments(self, n: ScheduledNode, i: ScheduledInput) -> list[InputView]:
        """One argument, or one a term for a variadic port."""
        if i.port.representation != POINTS and (len(i.terms) != 1 or i.terms[0].weight != 1):
            raise InternalError(f"a sum of {i.port.representation} at port {i.port.name}")
        if i.port.pulled:
            terms = self.terms(i.terms)
            functor = f"{self.members[n.identifier]}_{i.port.name}"
            if i.port.variadic:
                return [InputView((t,), "", f"{functor}_{k}") for k, t in enumerate(terms)]
            return [InputView(terms, "", functor)]
        return [InputView((), self.accessor(i.terms[0].node))]

    def accessor(self, wire: str) -> str:
        """What is stored on a wire that is not Points."""
        source = self.by_name[wire]
        return f"{self.members[source.identifier]}.{snake_case(source.op.output)}()"

    def terms(self, terms: tuple[Term, ...]) -> tuple[TermView, ...]:
        return tuple(
            TermView(f"{self.pulls[self.by_name[t.node].identifier]}(request)", _factor(t.weight)) for t in terms
        )

    # --- What the eye sees --------------------------------------------------------------------------------------------

    def result_layers(self) -> int:
        """Adds the layers of `image ... layers` and of taps. Returns the number of the emitters' layer, or -1.

        Of a wire that is subtracted, the layer holds what is taken away.
        """
        image = self.schedule.image
        emitters = -1
        if image and image.layers:
            weights = _merged(image.terms)
            for wire, weight in weights.items():
                term = TermView(self.variables[self.by_name[wire].identifier], _factor(abs(weight)))
                self.layer(wire, _weighted(weight, self.light.seen_paths[wire]), (term,))
            name = "emitters"
            while any(name == layer.name for layer in self.layers):
                name += "_"
            emitters = self.layer(name, "L S* E")
        for tap in self.schedule.taps:
            paths = self.paths_text(tap.terms)
            signed = self.is_signed(tap.terms)
            self.layers.append(LayerView(Path(tap.file).stem, paths, self.seen_terms(tap.terms), tap.file, signed))
        results = ([image.terms] if image else []) + [tap.terms for tap in self.schedule.taps]
        for n in dict.fromkeys(self.difference(terms) for terms in results):
            if n is not None:
                a, b = (self.compared(n, i) for i in n.inputs)
                self.differences.append(DifferenceView(n.name, a, b))
        return emitters

    def difference(self, terms: tuple[Term, ...]) -> ScheduledNode | None:
        """The Difference that a result is made of, if it is one alone."""
        wires = _merged(terms)
        n = self.by_name[next(iter(wires))] if list(wires.values()) == [1] else None
        return n if n is not None and n.op.name == "Difference" else None

    def compared(self, n: ScheduledNode, given: ScheduledInput) -> int:
        """The layer of one side of a Difference, called as its wire."""
        sign = -1 if given.port.subtracted else 1
        terms = tuple(replace(t, weight=sign * t.weight) for t in given.terms)
        name = terms[0].node if len(terms) == 1 else f"{n.name}_{given.port.name}"
        while any(name == layer.name for layer in self.layers if not layer.file):
            name += "_"
        return self.layer(name, self.paths_text(terms), self.seen_terms(terms))

    def paths_text(self, terms: tuple[Term, ...], paths: dict[str, str] | None = None) -> str:
        """What the eye sees of a sum; or its other `paths`."""
        by_wire = self.light.seen_paths if paths is None else paths
        weighted = (_weighted(weight, by_wire[wire]) for wire, weight in _merged(terms).items())
        return " + ".join(weighted).replace("+ -", "- ")

    def seen(self) -> tuple[SeenView, ...]:
        """The wires that results are made of, each once. A sum is made of its terms, which results may show, too."""
        results = [self.schedule.image.terms] if self.schedule.image else []
        results += [tap.terms for tap in self.schedule.taps]
        shown = dict.fromkeys(self.difference(terms) for terms in results)
        results += [i.terms for n in shown if n is not None for i in n.inputs]
        found: dict[str, SeenView] = {}
        stack = [wire for terms in reversed(results) for wire in reversed(_merged(terms))]
        while stack:
            n = self.by_name[stack[-1]]
            # What `to` restricts is pulled as a whole.
            sides = [i.terms for i in n.inputs] if n.op.name in ("Sum", "Difference") and n.receivers is None else []
            summed = tuple(term for terms in sides for term in terms)
            terms = _merged(summed)
            missing = [wire for wire in terms if wire not in found]
            if missing and n.name not in found:
                stack += reversed(missing)
                continue
            stack.pop()
            if n.name not in found:
                pull = "" if terms else self.pulls[n.identifier]
                found[n.name] = SeenView(self.variables[n.identifier], pull, self.seen_terms(summed))
        return tuple(found.values())

    def seen_terms(self, terms: tuple[Term, ...]) -> tuple[TermView, ...]:
        """A sum of wires that the eye sees."""
        return tuple(
            TermView(self.variables[self.by_name[wire].identifier], _factor(weight))
            for wire, weight in _merged(terms).items()
        )

    def is_signed(self, terms: tuple[Term, ...]) -> bool:
        """May a sum be negative? Where something on the way is subtracted, or scaled by what may be negative."""
        nodes = [self.by_name[name] for name in self.upstream((t.node for t in terms), through_caches=True)]
        sums = [terms, *(i.terms for n in nodes for i in n.inputs)]
        return any(n.op.may_negate for n in nodes) or any(t.weight < 0 for terms in sums for t in terms)

    def results(self) -> list[tuple[Term, ...]]:
        """The sums that become pictures and tables."""
        written: list[Tap | Probe | Lightmap] = [*self.schedule.taps, *self.schedule.probes, *self.schedule.lightmaps]
        return [each.terms for each in written] + ([self.schedule.image.terms] if self.schedule.image else [])

    def stored_tap(self, tap: Tap) -> StoredTapView:
        wire = tap.terms[0].node
        return StoredTapView(self.accessor(wire), wire, self.light.seen_paths[wire], tap.file)

    def probe(self, number: int, probe: Probe) -> ProbeView:
        return ProbeView(
            functor=self.probes[number],
            terms=self.terms(probe.terms),
            wire=_sum_text(probe.terms),
            sensors=probe.sensors,
            file=probe.file,
            on_surfaces=any(self.on_surfaces(term.node, set()) for term in probe.terms),
        )

    def lightmap(self, number: int, lightmap: Lightmap) -> LightmapView:
        return LightmapView(
            functor=self.lightmaps[number],
            terms=self.terms(lightmap.terms),
            wire=_sum_text(lightmap.terms),
            light_paths=self.paths_text(lightmap.terms, self.light.baked_paths),
            file=lightmap.file,
        )

    def on_surfaces(self, name: str, seen: set[str]) -> bool:
        """Is a wire known on surfaces only? Stored irradiance is, and what `to` wants on surfaces with a tag."""
        if name in seen:
            return False
        seen.add(name)
        n = self.by_name[name]
        if "irradiance" in n.contents or (n.receivers is not None and not n.receivers.negated):
            return True
        passed = {rule.port for rule in n.op.paths if rule.content == "unchanged"}
        sources = [term.node for i in n.inputs if i.port.name in passed for term in i.terms]
        return any(self.on_surfaces(source, seen) for source in sources)

    def slots(self, n: ScheduledNode) -> list[SlotView]:
        found = []
        for p in n.parameters:
            d = p.declaration
            if d.type in ("path", "tags") or d.name == n.op.depth_parameter or (d.type == "text" and d.name == "layer"):
                continue
            member = self.members[n.identifier]
            found.append(
                SlotView(
                    node=n.name,
                    name=d.name,
                    kind=d.type,
                    member=f"{member}.{d.name}",
                    low=_bound(d.low, "-"),
                    high=_bound(d.high, ""),
                    choices=d.choices if d.type == "choice" else (),
                    choices_name=f"{member}_{d.name}_choices",
                    summary=first_sentence(d.doc),
                )
            )
        return found


def _making(n: ScheduledNode) -> list[ParameterValue]:
    """The parameters that decide what a node makes: all but the file that it is kept in."""
    return [p for p in n.parameters if not (n.op.cached and p.name == "file")]


def _merged(terms: tuple[Term, ...]) -> dict[str, float]:
    """Each wire of a sum with its whole weight, in the order of the text; without those that cancel out."""
    weights: dict[str, float] = {}
    for term in terms:
        weights[term.node] = weights.get(term.node, 0) + term.weight
    return {wire: weight for wire, weight in weights.items() if weight != 0}


def _factor(weight: float) -> str:
    return "" if weight == 1 else float_literal(weight)


def _weighted(weight: float, light_paths: str) -> str:
    """`L D E`, `-(L D E)`, `2 (L D E)`."""
    return light_paths if weight == 1 else f"{'-' if weight == -1 else f'{weight:g} '}({light_paths})"


def _bound(value: float | None, sign: str) -> str:
    return f"{sign}std::numeric_limits<double>::infinity()" if value is None else repr(float(value))


def _sum_text(terms: tuple[Term, ...]) -> str:
    """`a - b`."""
    text = " ".join(f"{'-' if t.weight < 0 else '+'} {t.node}" for t in terms)
    return text.removeprefix("+ ")


def _header(n: ScheduledNode) -> str:
    """The operator's header, relative to its library: family/op/op.hpp."""
    return "/".join([*PurePath(n.op.folder).parts[-2:], f"{n.op.file_stem}.hpp"])
