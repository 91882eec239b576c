"""PointsToQuadTree: known functions (in C++), and agreement with what it samples on a lit plane."""

import csv
import itertools
import math
from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

CELLS = """
light  = Lights()
direct = Direct(light)
cells  = direct as QuadTree
image cells
"""


def picture(run_program, program, *options, scene="plane_area.gltf"):
    run = run_program(program, SCENES / scene, "--size", "40x30", "--samples", "64", *options)
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


def test_known_answers(unit_test):
    unit_test("test_quad_tree")


def test_the_picture_is_that_of_the_samples(compiled_network, run_program):
    cells = picture(run_program, compiled_network("cells", text=CELLS))
    direct = picture(run_program, compiled_network("direct"))
    assert cells.mean() == pytest.approx(direct.mean(), rel=0.01)
    assert abs(cells - direct).mean() < 0.03 * direct.mean()


def test_no_light_comes_through_the_walls_of_a_closed_box(compiled_network, run_program, tmp_path):
    text = CELLS.replace("image cells", 'probe cells at "sensors.csv" -> "cells.csv"')
    low, high = (-2.0, -1.5, -3.0), (2.0, 1.5, 2.0)
    shares = (0.001, 0.01, 0.3, 0.5, 0.77, 0.99, 0.999)  # of the walls' extents: next to edges and corners, too
    outer, inner = [], []
    for axis, (wall, outwards), u, v in itertools.product(range(3), ((low, -1.0), (high, 1.0)), shares, shares):
        share = [u, v]
        share.insert(axis, 0.0)
        at = [a + s * (b - a) for a, b, s in zip(low, high, share, strict=True)]
        for side, sensors in ((1.0, outer), (-1.0, inner)):
            at[axis] = wall[axis] + 1e-4 * side * outwards
            sensors.append([*at, *(side * outwards if k == axis else 0.0 for k in range(3))])
    rows = (",".join(map(repr, row)) + "\n" for row in outer + inner)
    (tmp_path / "sensors.csv").write_text("".join(rows))
    run = run_program(compiled_network("furnace_cells", text=text), SCENES / "furnace.gltf")
    assert run.status == 0, run.stderr
    with (tmp_path / "cells.csv").open() as file:
        found = [float(row["E_g"]) for row in csv.DictReader(file)]
    assert found[: len(outer)] == [0.0] * len(outer)
    assert found[len(outer) :] == pytest.approx([math.pi] * len(inner), rel=0.01)


def test_the_seed_decides_not_the_threads(compiled_network, run_program):
    program = compiled_network("cells", text=CELLS)
    pictures = [picture(run_program, program, "--samples", "1", "--threads", str(n)) for n in (1, 3)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] != picture(run_program, program, "--samples", "1", "--seed", "1")).any()


def test_fewer_cells_for_a_larger_error(compiled_network, run_program):
    program = compiled_network("cells", text=CELLS)
    direct = picture(run_program, compiled_network("direct"))
    options = ("--set", "cells.cell=2m", "--set", "cells.samples=64")
    errors = [
        abs(picture(run_program, program, *options, "--set", f"cells.error={e}") - direct).mean() / direct.mean()
        for e in (0.01, 0.3)
    ]
    assert errors[0] < 0.02
    assert 0.05 < errors[1] < 0.3


def test_a_part_of_the_scene(compiled_network, run_program, tmp_path):
    """Sampled on walls only, the tree holds nothing elsewhere, and there the same as a whole one, to its error."""
    text = """
network part_of_scene
tag walls = mesh "Wall*"
direct = Direct(Lights())
tree   = PointsToQuadTree(direct, to = walls)
part   = QuadTreeToPoints(tree)
there  = QuadTreeToPoints(tree, to = walls)
whole  = QuadTreeToPoints(PointsToQuadTree(direct), to = walls)
tap    part -> "part.exr"
tap    there -> "there.exr"
tap    whole -> "whole.exr"
"""
    program = compiled_network("part_of_scene", text=text)
    run = run_program(program, SCENES / "glossy_tags.glb", "--size", "40x30", "--samples", "64")
    assert run.status == 0, run.stderr
    part, there, whole = (exr.read(tmp_path / f"{name}.exr") for name in ("part", "there", "whole"))
    assert (part == there).all() and whole.max() > 0
    assert part.mean() == pytest.approx(whole.mean(), rel=0.01)
    assert abs(part - whole).mean() < 0.03 * whole.mean()


def test_only_what_is_read_is_sampled(compiled_network, run_program):
    """An inserted converter samples the surfaces that scatter, one that is written out all."""
    text = """
network {name}
tag walls = mesh "Wall*"
direct   = Direct(Lights())
indirect = Radiosity({source}, from = walls, error = 20%)
expect <= L S* E | L D@walls+ D S* E
image  indirect
"""
    rays = {}
    for name, source in (("narrow", "direct"), ("wide", "PointsToQuadTree(direct)")):
        program = compiled_network(name, text=text.format(name=name, source=source))
        run = run_program(program, SCENES / "glossy_tags.glb", "--size", "8x6", "--samples", "4")
        assert run.status == 0, run.stderr
        rays[name] = next(node["rays"] for node in run.stats["nodes"] if node["op"] == "Direct")
    assert 0 < rays["narrow"] < 0.6 * rays["wide"]
