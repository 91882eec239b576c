"""QuadTreeToPoints: cells are constant, and the mean is that of the light."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

NETWORK = """
light = Lights()
tree  = PointsToQuadTree(Direct(light), cell = 0.625m, depth = 6, error = 0%)
cells = QuadTreeToPoints(tree)
image cells
"""


def test_cells_are_constant(compiled_network, run_program):
    program = compiled_network("constant_cells", text=NETWORK)
    run = run_program(program, SCENES / "plane_area.gltf", "--size", "80x60", "--samples", "1")
    assert run.status == 0, run.stderr
    values = exr.read(run.picture)[..., 0]
    lit = values[values > 0]
    assert lit.size > 1000
    assert 30 <= len(set(lit)) <= 8 * 6  # of cells of 0.625 m in 4 m x 3 m
