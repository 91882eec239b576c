"""TriMeshToPoints: interpolation is exact for linear functions (in C++)."""

import subprocess


def test_known_answers(runtime_tool):
    done = subprocess.run([runtime_tool("test_tri_mesh")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
