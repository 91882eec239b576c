"""The catalogue: every code with its page, and the smallest network that provokes it."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import indent


@dataclass(frozen=True)
class Page:
    """What `lnc explain CODE` prints. `example` is None where no text of a network can provoke the code."""

    code: str
    title: str
    text: str
    example: str | None
    operators: tuple[str, ...] = ()  # declarations beyond the built-in library that the example needs
    scene: str | None = None  # the glTF file (JSON) that the example is checked with

    @property
    def provoked_by(self) -> str:
        """The example with what it needs, as text under headings; "" without an example."""
        if self.example is None:
            return ""
        parts = [("The smallest network that provokes it:", self.example)]
        if self.operators:
            parts.append(("with these operators in a folder given by --ops:", "\n".join(self.operators)))
        if self.scene is not None:
            parts.append(("with this glTF file given by --scene:", self.scene))
        return "\n".join(f"{heading}\n\n{indent(text, '    ')}" for heading, text in parts)


def page(code: str) -> Page | None:
    return PAGES.get(code.upper())


def _pages(*pages: Page) -> dict[str, Page]:
    return {p.code: p for p in pages}


PAGES = _pages(
    Page(
        "LN0100",
        "unreadable file",
        """The file is missing, is not UTF-8 text, or is larger than any network. The exit status is 2.""",
        None,
    ),
    Page(
        "LN0101",
        "syntax",
        """The text cannot be read here. The statement is skipped and the next one is read as if nothing had
happened, so one run shows every such place. A statement ends with its line; it goes on inside ( )
and [ ], and on a line that begins with | + - -> or a comma. The letters L D G S E are events of
light paths and cannot be names by themselves.""",
        "light = Lights(\nimage Direct(light)\n",
    ),
    Page(
        "LN0102",
        "unknown name",
        """No wire, operator, tag, representation or kind of tag has this name. The message suggests the
closest one there is. `lnc ops` lists the operators.""",
        "light = Lights()\nimage Direct(ligth)\n",
    ),
    Page(
        "LN0103",
        "unknown parameter",
        """The operator has no parameter and no port of this name. `lnc ops NAME` lists what it has.""",
        "light = Lights()\nimage Direct(light, sampels = 4)\n",
    ),
    Page(
        "LN0104",
        "value, unit or range",
        """The value is of another kind than the parameter, has a wrong unit or none, or lies outside of the
range. Counts take k, M and G; ratios %; lengths m, km, cm, mm, um; angles deg, rad; times s, ms,
min, h. Lengths, angles and times always need a unit, except 0.""",
        "light = Lights()\nimage Direct(light, samples = 5cm)\n",
    ),
    Page(
        "LN0105",
        "input missing",
        """A port of the operator is not connected, or a parameter without a default is not given. Ports are
given by position, or by name with a single wire: PathTracer(in = direct).""",
        "image Direct(samples = 4)\n",
    ),
    Page(
        "LN0106",
        "defined twice",
        """A wire, a tag, the image, a layer of the picture, the file of a result or a cache, or the network's name is
defined a second time. Order does not matter in a network, so neither can replace the other.""",
        "light = Lights()\nlight = Lights()\nimage Direct(light)\n",
    ),
    Page(
        "LN0107",
        "too many inputs",
        """More wires are given by position than the operator has ports, or one input or parameter is given
twice. Parameters are always given by name.""",
        "light = Lights()\nimage Direct(light, light)\n",
    ),
    Page(
        "LN0108",
        "unused wire",
        """Nothing uses this wire, so the program leaves it out. This is a warning.""",
        "light = Lights()\nspare = Direct(light)\nexpect L S* E | L (D|G) S* E\nimage Direct(light)\n",
    ),
    Page(
        "LN0109",
        "no result",
        """The network has no `image`, `tap`, `probe` or `lightmap`, so there is nothing to compute.""",
        "light = Lights()\n",
    ),
    Page(
        "LN0110",
        "not supported",
        """Declarations of operators and representations belong into a folder of an operator library, which
--ops names, not into a network.""",
        "representation Mine\n",
    ),
    Page(
        "LN0111",
        "macro",
        """A macro
is wrong: it lacks its result `out`, uses itself, or its input has no default and is not given. A
mistake inside a macro is shown in its text, with the call that led there.""",
        "op Twice(in: Points) -> Points {\n    out = Twice(in)\n}\nimage Twice(Direct(Lights()))\n",
    ),
    Page(
        "LN0112",
        "wrong declaration",
        """A declaration in an operator library is wrong: an unknown type, a default that does not fit, light
paths that name no port, or a file that is not named after its operator. ops_library/README.md says
how to write one.""",
        None,
    ),
    Page(
        "LN0201",
        "no conversion",
        """A port takes another representation than the wire has, and no chain of converters leads from one to
the other. Only operators that declare `converter` are inserted; an estimate such as NNDensity,
whose quality is a choice, never is.""",
        "light = Lights()\nimage light\n",
    ),
    Page(
        "LN0202",
        "ambiguous conversion",
        """Several chains of converters cost the same. There is no silent choice: write the one that you want
as a call. The built-in converters are never ambiguous by themselves.""",
        "light = Lights()\nimage ParticleTracer(light)\n",
        operators=(
            "operator Smooth(in: Photons) -> Points {\n    paths irradiance = in\n    converter cost 3\n}\n",
            "operator Sharp(in: Photons) -> Points {\n    paths irradiance = in\n    converter cost 3\n}\n",
        ),
    ),
    Page(
        "LN0301",
        "path counted too often",
        """The picture is to hold every light path once, or as often as `expect` says. The path in the message
is the shortest one that is counted more often, so its light would be too bright. Two routes through
the network carry it; the message lists both, wire by wire, with their lines. Leave one of the wires
out of the sum, or narrow one of them by via, from or to.""",
        "light   = Lights()\ndirect  = Direct(light)\ndirect2 = Direct(light)\n"
        "expect  L S* E | L (D|G) S* E\nimage   direct + direct2\n",
    ),
    Page(
        "LN0302",
        "path missing",
        """The picture lacks light: no route through the network carries the path in the message, which is the
shortest of its kind. It is an error where `expect` asks for the path. Without `expect` the picture
is compared with all light, L(D|G|S)*E, and what is missing is a warning; a network that is partial
on purpose says so: `expect` with the paths that it has, or `expect <= PATH`, which allows less.
L@delta S* E carries no light and is never missed.""",
        "light  = Lights()\ndirect = Direct(light)\nexpect L (D|G|S)* E\nimage  direct\n",
    ),
    Page(
        "LN0303",
        "path counted negatively",
        """A difference takes away light that was never there: the path in the message is carried by what is
subtracted, but not by what it is subtracted from, so its light is negative in the picture. Narrow
the wire behind the minus to paths that the other one has.""",
        "light  = Lights()\ndirect = Direct(light)\nbounce = PathTracer(direct)\n"
        "expect L S* E | L (D|G) S* E\nimage  direct - bounce\n",
    ),
    Page(
        "LN0304",
        "operator that can never carry light",
        """No light path fits what the operator follows, whatever the scene holds, so its wire is always dark.
Mostly its input is restricted to surfaces (by to, from or via) on which the operator allows no
event. Remove the operator, or widen one of the restrictions.""",
        'tag mirror = material "Mirror*"\nlight  = Lights()\nnear   = Direct(light, to = mirror)\n'
        "bounce = PathTracer(near, via = D@!mirror)\nexpect <= L (D|G|S)* E\nimage  near + bounce\n",
    ),
    Page(
        "LN0305",
        "event that this content cannot scatter",
        """A `via` begins with an event that the light at the port cannot be scattered by. Irradiance has no
directions, so a surface can scatter it by D alone. Samples come from directions of their own
choice: D and G, for S asks for one exact direction. Radiance can be scattered by all.""",
        "light   = Lights()\nphotons = ParticleTracer(light)\nsoft    = NNDensity(photons)\n"
        "image   PathTracer(soft, via = S)\n",
    ),
    Page(
        "LN0307",
        "light paths that must be equal",
        """An operator that takes several estimates of the same light, as mis(a, b) and ByDistance(far, near) do,
needs wires that carry the same light paths everywhere, each as often and, for mis, with the same content.
One that takes what arrives on a part of the scene as a whole, as the mean of AverageAmbient, needs light
paths that are the same all over that part (its parameter `from`; without it, the scene). The path in the
message is a shortest one that is counted differently.""",
        "light  = Lights()\ndirect = Direct(light)\nbounce = PathTracer(direct)\n"
        "expect <= L (D|G|S)* E\nimage  mis(direct, bounce)\n",
    ),
    Page(
        "LN0401",
        "preprocessing cycle",
        """An operator that works before the picture
needs its own result. The message prints the loop hop by hop. Break it: a pulled cycle (PathTracer)
is allowed, one through an operator that must be complete first is not.""",
        "light   = Lights()\nphotons = Retrace(Direct(light) + density)\n"
        "density = NNDensity(photons)\nimage   density\n",
        operators=("operator Retrace(in: Points) -> Photons {\n    paths samples = in D\n}\n",),
    ),
    Page(
        "LN0402",
        "unbounded recursion",
        """A cycle of pulls without an operator that ends it. PathTracer ends recursions by Russian roulette;
sums and scales alone add no event and would never end.""",
        "light  = Lights()\ndirect = Direct(light)\nloop   = Scale(direct + loop, factor = 0.5)\nimage  loop\n",
    ),
    Page(
        "LN0501",
        "tag matches nothing in the scene",
        """`lnc check --scene FILE` compares tags with a glTF file. This one matches nothing that its scene shows
or that gives light there, so what from, to and via select by it is empty. Globs are compared with whole
names and tell upper and lower case apart: * is any text, ? any byte, [a-z] one of several. A tag without
a glob is looked for in extras.tags of materials, meshes, nodes and lights.""",
        'tag mirror = material "Miror*"\nlight = Lights()\nexpect <= L (D|G|S)* E\nimage Direct(light, to = mirror)\n',
        scene="""{
    "asset": {"version": "2.0"},
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "accessors": [{"componentType": 5126, "type": "VEC3", "count": 3}],
    "materials": [{"name": "Mirror"}]
}
""",
    ),
    Page(
        "LN0502",
        "too many tags",
        """Every combination of the tags that from, to and via name is told apart. Six tags make 64
combinations; more are not supported.""",
        "".join(f'tag t{i} = material "m{i}"\n' for i in range(7))
        + "light = Lights()\nimage "
        + " + ".join(f"Direct(light, to = t{i})" for i in range(7))
        + "\n",
    ),
)
