"""One mistake, one message, and all of them in one run.

WRONG holds networks with a single mistake each, whose effects reach far; SEVERAL such with mistakes that have nothing
to do with each other.
"""

from __future__ import annotations

import pytest

from lnc.driver import compile_network
from lnc.library import Library
from lnc.source import SourceFile

# The mistake is between « and », which are taken out; the message must stand inside of it.
WRONG = {
    "equation without an expression": (
        "LN0101",
        """
light = Lights()
direct = «
»pt = PathTracer(direct + pt)
image direct + pt
""",
    ),
    "operator misspelt, used thrice": (
        "LN0102",
        """
light = Lights()
direct = «Dirct»(light)
pt = PathTracer(direct + pt)
image direct + pt
tap direct -> "d.exr"
""",
    ),
    "operator unknown inside a cycle": (
        "LN0102",
        """
light = Lights()
direct = Direct(light)
a = «Bounce»(direct + b)
b = PathTracer(a)
image a + b
""",
    ),
    "operator unknown, cast behind it": (
        "LN0102",
        """
light = Lights()
photons = «Tracer»(light)
map = photons as PhotonMap
image NNDensity(map)
""",
    ),
    "operator unknown, with parameters": (
        "LN0102",
        """
image «Frobnicate»(Lights(), colour = red, size = 5cm)
""",
    ),
    "wire misspelt where it is defined": (
        "LN0102",
        """
ligt = Lights()
image Direct(«light»)
""",
    ),
    "wire misspelt in a sum that is converted": (
        "LN0102",
        """
light = Lights()
direct = Direct(light)
image QuadTreeToPoints(direct + «dirct»)
""",
    ),
    "wire misspelt in a cycle": (
        "LN0102",
        """
light = Lights()
direct = Direct(light)
pt = PathTracer(direct + «tp»)
image direct + pt
""",
    ),
    "wire used as an operator": (
        "LN0102",
        """
light = Lights()
direct = «light»(samples = 4)
image direct
""",
    ),
    "operator used as a wire": (
        "LN0102",
        """
light = Lights()
image Direct(«Lights»)
""",
    ),
    "tag misspelt, used by three": (
        "LN0102",
        """
tag miror = material "M*"
light = Lights()
a = Direct(light, to = «mirror»)
image PathTracer(a, from = miror) + a
""",
    ),
    "tag with a wrong kind, used": (
        "LN0102",
        """
tag mirror = «colour "red"»
light = Lights()
a = Direct(light, to = mirror)
image PathTracer(a, via = D@mirror) + a
""",
    ),
    "tag with a syntax error, used": (
        "LN0101",
        """
tag mirror = material «Mirror»
light = Lights()
a = Direct(light, to = mirror)
expect <= L D@mirror E
image PathTracer(a, via = mirror) + a
""",
    ),
    "tag in a path that nobody defines": (
        "LN0102",
        """
light = Lights()
photons = ParticleTracer(light, via = S@«glass»+)
image NNDensity(photons)
""",
    ),
    "parameter misspelt": (
        "LN0103",
        """
light = Lights()
direct = Direct(light, «sampels» = 4)
image PathTracer(direct) + direct
""",
    ),
    "port misspelt": (
        "LN0103",
        """
light = Lights()
direct = Direct(light)
image PathTracer(«inn» = direct)
""",
    ),
    "parameter that must be given, misspelt": (
        "LN0103",
        """
d = Direct(Lights())
image WireTap(d, «layr» = "direct")
""",
    ),
    "value without its unit": (
        "LN0104",
        """
light = Lights()
photons = ParticleTracer(light)
soft = NNDensity(photons, radius = «5»)
image soft + PathTracer(soft)
""",
    ),
    "via that is no path": (
        "LN0104",
        """
light = Lights()
photons = ParticleTracer(light, via = «5»)
image NNDensity(photons)
""",
    ),
    "via with an emitter": (
        "LN0104",
        """
light = Lights()
photons = ParticleTracer(light, via = «L S»)
image NNDensity(photons)
""",
    ),
    "input missing in the middle": (
        "LN0105",
        """
light = Lights()
direct = «Direct()»
pt = PathTracer(direct + pt)
image pt + PathTracer(direct)
""",
    ),
    "wire defined twice": (
        "LN0106",
        """
light = Lights()
«light» = Lights()
image Direct(light)
""",
    ),
    "wire defined twice, differently": (
        "LN0106",
        """
light = Lights()
a = Direct(light)
«a» = ParticleTracer(light)
image a + PathTracer(a)
""",
    ),
    "tag defined twice": (
        "LN0106",
        """
tag t = mesh "a"
tag «t» = mesh "b"
image Direct(Lights(), to = t)
""",
    ),
    "two images": (
        "LN0106",
        """
light = Lights()
image Direct(light)
«image PathTracer(Direct(light))»
""",
    ),
    "wire too many": (
        "LN0107",
        """
light = Lights()
direct = Direct(light, «light»)
image direct + PathTracer(direct)
""",
    ),
    "circle of second names": (
        "LN0402",
        """
«a = b»
b = a
image PathTracer(a + b)
""",
    ),
    "macro without a result": (
        "LN0111",
        """
op «M»(in: Points) -> Points {
    x = PathTracer(in)
}
d = Direct(Lights())
image M(M(d)) + M(d)
""",
    ),
    "macro called with too little": (
        "LN0105",
        """
op M(in: Points, more: Points) -> Points {
    out = PathTracer(in + more)
}
d = Direct(Lights())
a = «M(d)»
image a + PathTracer(a)
""",
    ),
    "macro whose body is wrong, called thrice": (
        "LN0102",
        """
op M(in: Points) -> Points {
    half = Scale(«inn», factor = 0.5)
    out = PathTracer(half)
}
d = Direct(Lights())
image M(d) + M(M(d))
""",
    ),
    "macro whose body has a syntax error": (
        "LN0101",
        """
op M(in: Points) -> Points {
    half = Scale(in, «=» 0.5)
    out = PathTracer(half)
}
d = Direct(Lights())
image M(d) + M(M(d))
""",
    ),
    "macro whose head is wrong": (
        "LN0101",
        """
op M(in «Points») -> Points {
    half = Scale(in)
    out = PathTracer(half)
}
d = Direct(Lights())
a = M(d)
image a + M(a)
""",
    ),
    "macro misspelt": (
        "LN0102",
        """
op Twice(in: Points) -> Points {
    out = PathTracer(in)
}
d = Direct(Lights())
image «Twise»(d) + d
""",
    ),
    "macro parameter misspelt": (
        "LN0103",
        """
op M(in: Points, n = 3) -> Points {
    out = PathTracer(in, max_depth = n)
}
d = Direct(Lights())
a = M(d, «m» = 4)
image a + d
""",
    ),
    "macro with a wrong value, called twice": (
        "LN0104",
        """
op M(in: Points, n = 3) -> Points {
    out = PathTracer(in, max_depth = n)
}
d = Direct(Lights())
a = M(d, n = «5cm»)
image a + d
""",
    ),
    "file of macros that is missing": (
        "LN0111",
        """
«use "no_such_file.ln"»
d = Direct(Lights())
a = Gouraud(d)
image a + PathTracer(a)
""",
    ),
    "annotation that is no representation": (
        "LN0102",
        """
light = Lights()
«direct»: Pints = Direct(light)
image direct
""",
    ),
    "cast to no representation": (
        "LN0102",
        """
light = Lights()
map = ParticleTracer(light) as «FotonMap»
image NNDensity(map) + NNDensity(map)
""",
    ),
    "cast that leads nowhere": (
        "LN0201",
        """
light = Lights()
map = «light as PhotonMap»
image NNDensity(map) + NNDensity(map)
""",
    ),
    "emission where Points are wanted, twice used": (
        "LN0201",
        """
light = Lights()
pt = PathTracer(«light»)
image pt + PathTracer(pt)
""",
    ),
    "emission in a sum": (
        "LN0201",
        """
light = Lights()
direct = Direct(light)
pt = PathTracer(direct + «light»)
image pt + direct
""",
    ),
    "bracket never closed": (
        "LN0101",
        """
light = Lights()
direct = Direct«(»light
pt = PathTracer(direct + pt)
image direct + pt
""",
    ),
    "brace never closed": (
        "LN0101",
        """
op M(in: Points) -> Points «{»
    out = PathTracer(in)

light = Lights()
""",
    ),
    "brace too many": (
        "LN0101",
        """
light = Lights()
«}»
image Direct(light)
""",
    ),
    "string never closed": (
        "LN0101",
        """
tag mirror = material «"Mirror»
light = Lights()
image Direct(light, to = mirror)
""",
    ),
    "letter as a name": (
        "LN0101",
        """
«L» = Lights()
image Direct(L)
""",
    ),
    "letter as a name, read before": (
        "LN0101",
        """
tag t = mesh "a"
image Direct(S, to = t) + Direct(S)
«S» = Lights()
""",
    ),
    "statement misspelt": (
        "LN0101",
        """
light = Lights()
imagee «Direct»(light)
""",
    ),
    "comment of another language": (
        "LN0101",
        """
«#» a comment
light = Lights()
image Direct(light)
""",
    ),
    "cycle of sums, read by others": (
        "LN0402",
        """
light = Lights()
d = Direct(light)
a = «Scale(d + b, factor = 0.5)»
b = Scale(a, factor = 0.5)
image a + b + PathTracer(b)
""",
    ),
    "tap with a wrong ending": (
        "LN0104",
        """
light = Lights()
d = Direct(light)
tap d -> «"d.png"»
image d
""",
    ),
    "expect with an unknown tag": (
        "LN0102",
        """
light = Lights()
expect L D@«mirror» E | L G@mirror E
image Direct(light)
""",
    ),
    "expect with a syntax error": (
        "LN0101",
        """
light = Lights()
expect L S*«*» E
image Direct(light)
""",
    ),
    "direct light forgotten": (
        "LN0302",
        """
light = Lights()
direct = Direct(light)
pt = PathTracer(direct + pt)
expect L@area (D|G|S)* E | L@delta (D|G) (D|G|S)* E
«image pt»
""",
    ),
    "direct light twice": (
        "LN0301",
        """
light = Lights()
direct = Direct(light)
pt = PathTracer(direct + pt)
expect L@area (D|G|S)* E | L@delta (D|G) (D|G|S)* E
«image direct + pt + direct»
""",
    ),
    "dark wire, read by others": (
        "LN0304",
        """
tag mirror = mesh "M*"
light = Lights()
near = Direct(light, to = mirror)
dark = «PathTracer(near, via = D@!mirror)»
more = PathTracer(dark)
expect <= L .* E
image near + dark + more + PathTracer(more)
""",
    ),
    "event that irradiance has not, in a cycle": (
        "LN0305",
        """
light = Lights()
soft = NNDensity(ParticleTracer(light))
pt = PathTracer(soft, via = «S»)
expect <= L .* E
image pt + PathTracer(pt)
""",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_one_message(name: str, library: Library) -> None:
    code, marked = WRONG[name]
    start, end = marked.index("«"), marked.index("»") - 1
    found = compile_network(SourceFile("wrong.ln", marked.replace("«", "").replace("»", "")), library).diagnostics
    shown = [(d.code, d.span.line, d.message) for d in found]
    assert [d.code for d in found] == [code], shown
    assert start <= found[0].span.start <= end, shown


SEVERAL = {
    "a parameter, and a cycle elsewhere": """
light = Lights()
direct = Direct(light)
a = Radiosity(direct, «eror» = 1%)
b = Radiosity(«direct + c»)
c = QuadTreeToPoints(b)
image direct + a + b
""",
    "a statement that cannot be read, and a wire without a way": """
light = Lights()
direct = Direct(light) «*» 2
map = ParticleTracer(light)
image direct
tap NNDensity(«light») -> "n.exr"
""",
    "names, and light that another wire lacks": """
light = Lights()
direct = Direct(light)
gathered = «Gathr»(direct)
«expect direct: L | L D»
image direct + PathTracer(«gatherd»)
""",
    "a tap, and light that the picture counts twice": """
light = Lights()
direct = Direct(light)
tap direct -> «"d.png"»
expect <= L .* E
«image direct + direct»
""",
    "an event that irradiance has not, and light that a sound picture counts twice": """
light = Lights()
direct = Direct(light)
soft = NNDensity(ParticleTracer(light))
seen = PathTracer(soft, via = «S»)
tap seen -> "seen.exr"
«image direct + direct»
""",
    "an annotation, a cast, a cycle and an input": """
light = Lights()
direct = Direct(light)
tree: TriMesh = «PointsToQuadTree(direct)»
map = «light as PhotonMap»
loop = «Scale(loop, factor = 0.5)»
lost = «Radiosity()»
image NNDensity(map) + QuadTreeToPoints(tree) + loop + lost
""",
}


@pytest.mark.parametrize("name", SEVERAL)
def test_all_in_one_run(name: str, library: Library) -> None:
    """Each marked place has its message, and there is no other."""
    parts = SEVERAL[name].replace("»", "«").split("«")
    found = compile_network(SourceFile("wrong.ln", "".join(parts)), library).diagnostics
    starts = [len("".join(parts[:i])) for i in range(1, len(parts), 2)]
    places = [(start, start + len(part)) for start, part in zip(starts, parts[1::2], strict=True)]
    shown = [(d.code, d.span.line, d.message) for d in found]
    assert len(found) == len(places), shown
    for d, (start, end) in zip(found, places, strict=True):
        assert start <= d.span.start <= end, shown
