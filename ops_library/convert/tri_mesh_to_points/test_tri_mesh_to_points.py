"""TriMeshToPoints: interpolation is exact for linear functions (in C++)."""


def test_known_answers(unit_test):
    unit_test("test_tri_mesh")
