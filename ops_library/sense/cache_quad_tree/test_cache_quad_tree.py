"""The same picture from what was kept, without sampling it again."""

NETWORK = """
network kept_quad_tree
light  = Lights()
direct = Direct(light)
cells  = PointsToQuadTree(direct, error = 5%, depth = 4)
kept   = CacheQuadTree(cells, file = "cells.cache")
expect <= L (D|G|S)* E
image  kept
"""


def test_read_back(kept_wire):
    kept_wire("kept_quad_tree", NETWORK, change="cells.error=6%")
