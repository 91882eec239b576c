"""Every operator against its declaration: `--verify-paths` compares the energy on its wire with that of its light
paths, found by plain particles from the emitters. The scene has diffuse, glossy and specular surfaces, tags, and area,
point and directional lights.

A new operator gets a wire in one of the networks, and a line in WIRES.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from conftest import ROOT, SCENES
from lnc.library import snake_case

SCENE = SCENES / "glossy_tags.glb"

TAGS = """
tag small
tag lamp  = node "Lamp"
tag floor = mesh "Floor"

light  = Lights()
direct = Direct(light)
"""


QUICK = f"""network quick
{TAGS}
lamps  = Lights(from = lamp)
lit    = Direct(lamps)
twice  = Direct(light, samples = 2, to = floor)
gather = Gather(direct, samples = 2, from = floor)
glossy = Gather(direct, via = (D|G)@!floor)
once   = PathTracer(direct, via = D|S, from = floor)
pt     = PathTracer(direct + pt)
three  = PathTracer(direct + three, max_depth = 2)
sum    = direct + pt
tapped = WireTap(direct, layer = "direct")
scaled = Scale(direct, factor = 1)
best   = mis(direct, Direct(light, samples = 4))
either = ByDistance(direct, Direct(light, samples = 4), distance = 1m)
close  = Gather(either)
change = Difference(sum, gather)

photons = ParticleTracer(light, count = 4k, via = (D|S)@!small S?)
stored  = CachePhotons(photons, file = "photons.lncache")
sheets  = PhotonSurfSort(stored)
sorted  = CacheSortedPhotons(sheets, file = "sorted.lncache")
nearest = KDPhotonTree(photons)
map     = CachePhotonMap(nearest, file = "map.lncache")
second  = SecondaryTracer(direct, count = 4k, via = S?)

sampled = PointsToQuadTree(direct, depth = 2, samples = 4)
tree    = CacheQuadTree(sampled, file = "tree.lncache")
cells   = QuadTreeToPoints(tree)
corners = QuadTreeToTriMesh(tree)
mesh    = CacheTriMesh(corners, file = "mesh.lncache")
smooth  = TriMeshToPoints(mesh)

tap lit -> "lit.exr"
tap twice -> "twice.exr"
tap gather -> "gather.exr"
tap glossy -> "glossy.exr"
tap once -> "once.exr"
tap three -> "three.exr"
tap tapped -> "tapped.exr"
tap scaled -> "scaled.exr"
tap best -> "best.exr"
tap close -> "close.exr"
tap change -> "change.exr"
tap second -> "second.ply"
tap NNDensity(map) -> "map.exr"
tap TriMeshToPoints(SurfaceDE(sorted)) -> "sorted.exr"
tap cells -> "cells.exr"
tap smooth -> "smooth.exr"
"""

DENSITY = f"""network density
{TAGS}
photons  = ParticleTracer(light, via = (D|S)@!small S?)
density  = NNDensity(photons)
constant = NNDensity(photons, kernel = constant)
every    = NNDensity(photons, every = 4)
varying  = LepskiDensity(photons)
fitted   = SurfaceDE(photons)
reduced  = TriMeshReducer(fitted)

tap reduced -> "reduced.glb"
tap density -> "density.exr"
tap constant -> "constant.exr"
tap every -> "every.exr"
tap varying -> "varying.exr"
"""

GRADIENTS = f"""network gradients
{TAGS}
asked     = IGSampler(direct, samples = 64)
kept      = IGCache(asked)
gradients = IGInterpolator(kept)

tap gradients -> "gradients.exr"
"""

RADIOSITY = f"""network radiosity
{TAGS}
tree    = PointsToQuadTree(direct, depth = 4)
bounced = Radiosity(tree, from = floor, error = 5%)
average = AverageAmbient(bounced, to = small)

tap average -> "average.exr"
"""

# Of IGSampler and IGCache, only what IGInterpolator makes of them can be asked for at any point.
WIRES = {
    "Lights": ["lit"],
    "Direct": ["direct", "lit", "twice"],
    "Gather": ["gather", "glossy"],
    "PathTracer": ["once", "pt", "three"],
    "Sum": ["sum"],
    "WireTap": ["tapped"],
    "Scale": ["scaled"],
    "mis": ["best"],
    "ByDistance": ["either", "close"],
    "Difference": ["change"],
    "ParticleTracer": ["photons"],
    "CachePhotonMap": ["map"],
    "CachePhotons": ["stored"],
    "CacheSortedPhotons": ["sorted"],
    "PhotonSurfSort": ["sheets"],
    "KDPhotonTree": ["nearest"],
    "SecondaryTracer": ["second"],
    "PointsToQuadTree": ["sampled"],
    "CacheQuadTree": ["tree"],
    "QuadTreeToPoints": ["cells"],
    "QuadTreeToTriMesh": ["corners"],
    "CacheTriMesh": ["mesh"],
    "TriMeshToPoints": ["smooth"],
    "NNDensity": ["density", "constant", "every"],
    "LepskiDensity": ["varying"],
    "SurfaceDE": ["fitted"],
    "TriMeshReducer": ["reduced"],
    "IGSampler": ["gradients"],
    "IGCache": ["gradients"],
    "IGInterpolator": ["gradients"],
    "Radiosity": ["bounced"],
    "AverageAmbient": ["average"],
}

NETWORKS = {"quick": QUICK, "density": DENSITY, "gradients": GRADIENTS, "radiosity": RADIOSITY}

# The classes of surfaces that a network tells apart; no surface is a lamp.
CLASSES = {
    "quick": ("small", "floor", "other"),
    "density": ("small", "other"),
    "gradients": ("all",),
    "radiosity": ("small", "floor", "other"),
}


class Row(NamedTuple):
    """Energies of a wire on a class of surfaces [W], deviation and what is allowed of it [ratio]."""

    found: float
    expected: float
    deviation: float
    allowed: float
    deviates: bool


Table = dict[str, dict[str, Row]]
"""Rows by wire and class of surfaces; none for wires that are not compared."""


def verify(program: Path, folder: Path, *options: str) -> Table:
    """What a program says of its wires; its exit status must agree."""
    command = [str(program), str(SCENE), "--verify-paths", "--progress", "none", *options]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=3000, check=False)
    table: Table = {}
    for line in done.stdout.splitlines()[1:]:
        wire, *rest = line.split()
        rows = table.setdefault(wire, {})
        if rest[:2] == ["not", "compared:"]:
            continue
        surfaces, found, expected, deviation, allowed = rest[:5]
        rows[surfaces] = Row(
            float(found), float(expected), _ratio(deviation), _ratio(allowed), rest[5:] == ["DEVIATES"]
        )
    assert done.returncode == any(row.deviates for rows in table.values() for row in rows.values()), done.stderr
    assert table, done.stderr
    return table


def _ratio(percent: str) -> float:
    return 0 if percent == "-" else float(percent.rstrip("%")) / 100


@pytest.fixture(scope="module")
def tables(compiled_network, tmp_path_factory) -> Callable[[str], Table]:
    """tables("quick"): the table of that network."""

    @cache
    def table(name: str) -> Table:
        folder = tmp_path_factory.mktemp(name)
        program = compiled_network(name, text=NETWORKS[name])
        found = verify(program, folder, "--samples", "4096" if name == "quick" else "2048", "--size", "32x24")
        assert not list(folder.iterdir())  # no picture, no tap, no cache
        return found

    return table


def test_every_operator_is_verified(library):
    """None is forgotten: add a wire of yours to a network, and its name to WIRES."""
    assert sorted(WIRES) == sorted(library.operators)


def cases() -> Iterator:
    """Network, wire and class of surfaces for each wire of WIRES."""
    for operator, wires in WIRES.items():
        for wire in wires:
            name = next(name for name, text in NETWORKS.items() if re.search(rf"^{wire} += ", text, re.M))
            for surfaces in ("all",) if wire in ("map", "nearest") else CLASSES[name]:
                marks = [pytest.mark.slow] if name != "quick" else []
                yield pytest.param(name, wire, surfaces, id=f"{operator}-{wire}-{surfaces}", marks=marks)


@pytest.mark.parametrize(("name", "wire", "surfaces"), list(cases()))
def test_energy_is_that_of_the_declared_paths(tables, name, wire, surfaces):
    row = tables(name)[wire][surfaces]
    assert not row.deviates, row


# The quality parameter, coarse and fine, of operators whose bias shows in energies.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "wire", "coarse", "fine"),
    [
        pytest.param("density", "density", "photons.count=4k", "photons.count=200k", id="NNDensity"),
        pytest.param("gradients", "gradients", "kept.error=100%", "kept.error=5%", id="IGCache"),
    ],
)
def test_bias_shrinks_with_quality(compiled_network, tmp_path, name, wire, coarse, fine):
    program = compiled_network(name, text=NETWORKS[name])

    def bias(setting: str) -> float:
        """Where most of the light is, so that the noise of what it is compared with is small."""
        rows = verify(program, tmp_path, "--samples", "2048", "--size", "32x24", "--set", setting)[wire]
        return abs(max(rows.values(), key=lambda row: row.expected).deviation)

    assert bias(fine) < 0.75 * bias(coarse)


def test_errors_are_small_enough_to_see_what_is_wrong(tables):
    """Where most of a wire's light is, a wrong path would show."""
    for wire, rows in tables("quick").items():
        most = max(rows.values(), key=lambda row: row.expected)
        assert 0 < most.allowed < 0.15, (wire, most)


def test_factors(compiled_network, tmp_path):
    """A factor that the compiler knows of is not compared; another is found to be one."""
    text = """light = Lights()
direct = Direct(light)
half   = Scale(direct, factor = 0.5)
once   = Scale(direct, factor = 1)
tap half -> "half.exr"
tap once -> "once.exr"
"""
    program = compiled_network("factors", text=text)
    table = verify(program, tmp_path, "--samples", "512", "--set", "once.factor=2")
    assert table["half"] == {}
    assert not table["direct"]["all"].deviates
    assert table["once"]["all"].deviates
    assert table["once"]["all"].deviation == pytest.approx(1, abs=0.2)


# --- Lies -------------------------------------------------------------------------------------------------------------


class Lie(NamedTuple):
    """An operator with a wrong line: in its file of this kind, `line` becomes `wrong`. It stands as NAME(inputs)."""

    folder: str
    kind: str
    line: str
    wrong: str
    inputs: str


LIES = {
    "WrongEvent": Lie("propagate/secondary_tracer", ".ln", "= light D via", "= light G via", "direct, count = 2k"),
    "MissingEvent": Lie("propagate/secondary_tracer", ".ln", "= light D via", "= light via", "direct, count = 2k"),
    "WrongClass": Lie("propagate/direct", ".ln", "radiance = light@area", "radiance = light@delta D", "light"),
    "ForgottenClass": Lie("propagate/direct", ".ln", "    paths samples  = light@delta\n", "", "light"),
    "ForgottenTag": Lie("propagate/gather", ".ln", "light via@from", "light via", "direct, from = floor"),
    "TooManyPaths": Lie(
        "propagate/particle_tracer", ".ln", "= light via", "= light D? via", "light, count = 2k, via = S?"
    ),
    "LostFactor": Lie("combine/sum", ".hpp", "sum += terms(request)", "sum += 0.5f * terms(request)", "direct"),
    "NoBias": Lie("convert/average_ambient", ".ln", "bias 50%", "bias 0", "tree"),
}


def tell(lie: Lie, name: str, ops: Path) -> None:
    """The operator under another name, with its wrong line; nothing else takes it for the true one."""
    stem = Path(lie.folder).name
    true = "".join(word.capitalize() for word in stem.split("_"))
    folder = ops / Path(lie.folder).parent / snake_case(name)
    folder.mkdir(parents=True)
    for kind in (".ln", ".hpp"):
        text = (ROOT / "ops_library" / lie.folder / f"{stem}{kind}").read_text()
        if kind == lie.kind:
            assert text.count(lie.line) == 1
            text = text.replace(lie.line, lie.wrong)
        text = re.sub(r"\n    (overloads|converter) .*", "", text)
        text = text.replace(f"operator {true}(", f"operator {name}(").replace(f"struct {true} ", f"struct {name} ")
        (folder / f"{snake_case(name)}{kind}").write_text(text)


@pytest.fixture(scope="module")
def lies(compiled_network, tmp_path_factory) -> Table:
    """All lies in one network, each on a wire of its name."""
    folder = tmp_path_factory.mktemp("lies")
    lines = [TAGS, "tree = PointsToQuadTree(direct, depth = 1)"]
    for name, lie in LIES.items():
        tell(lie, name, folder / "ops")
        lines += [f"lie_{name} = {name}({lie.inputs})"]
        lines += [f'tap lie_{name} -> "{name}.{"ply" if "tracer" in lie.folder else "exr"}"']
    return verify(compiled_network("lies", text="\n".join(lines), ops=folder / "ops"), folder, "--samples", "1024")


@pytest.mark.parametrize("name", LIES)
def test_a_wrong_declaration_is_found(lies, name):
    assert any(row.deviates for row in lies[f"lie_{name}"].values())


def test_what_lies_read_is_true(lies):
    assert not any(row.deviates for row in lies["direct"].values())
