"""QuadTreeToTriMesh: exactness and continuity (in C++), and that it smooths without changing the mean."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

NETWORK = """
light  = Lights()
cells  = PointsToQuadTree(Direct(light), samples = 256, cell = 0.625m, depth = 6, error = 0%)
smooth = QuadTreeToTriMesh(cells)
image smooth
tap   cells -> "cells.exr"
"""


def test_known_answers(unit_test):
    unit_test("test_quad_tree")


def test_nearer_to_the_light_than_its_cells(compiled_network, run_program):
    options = (SCENES / "plane_area.gltf", "--size", "40x30", "--samples", "64")
    run = run_program(compiled_network("direct"), *options)
    direct = exr.read(run.picture)
    run = run_program(compiled_network("smooth_cells", text=NETWORK), *options)
    assert run.status == 0, run.stderr
    smooth, cells = exr.read(run.picture), exr.read(run.picture.parent / "cells.exr")
    assert smooth.mean() == pytest.approx(direct.mean(), rel=0.01)
    assert abs(smooth - direct).mean() < 0.3 * abs(cells - direct).mean()
