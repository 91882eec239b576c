"""The same picture from what was kept, without sampling it again."""

NETWORK = """
network kept_tri_mesh
light  = Lights()
direct = Direct(light)
cells  = PointsToQuadTree(direct, error = 5%, depth = 4)
mesh   = QuadTreeToTriMesh(cells)
kept   = CacheTriMesh(mesh, file = "mesh.cache")
expect <= L (D|G|S)* E
image  kept
"""


def test_read_back(kept_wire):
    kept_wire("kept_tri_mesh", NETWORK, change="cells.error=6%")
