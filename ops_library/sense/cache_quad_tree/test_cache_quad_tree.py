"""The same picture from what was kept, without sampling it again."""

from pathlib import Path

SCENE = Path(__file__).resolve().parents[3] / "examples" / "scenes" / "cornell_box.gltf"
NETWORK = """
network kept_quad_tree
light  = Lights()
direct = Direct(light)
cells  = PointsToQuadTree(direct, error = 5%, depth = 4)
kept   = CacheQuadTree(cells, file = "cells.cache")
expect <= L (D|G|S)* E
image  kept
"""


def test_read_back(compiled_network, run_program):
    program = compiled_network("kept_quad_tree", text=NETWORK)
    first = run_program(program, SCENE, "--size", "6x4", "--samples", "2")
    picture = first.picture.read_bytes()
    again = run_program(program, SCENE, "--size", "6x4", "--samples", "2")
    assert first.status == again.status == 0, first.stderr + again.stderr
    assert again.picture.read_bytes() == picture
    assert first.stats["rays"]["shadow"] > 1000 and again.stats["rays"]["shadow"] == 0
    assert "cache" not in first.stderr + again.stderr
    other = run_program(program, SCENE, "--size", "6x4", "--samples", "2", "--set", "cells.error=6%")
    assert "made by another network, or with other parameters" in other.stderr
