"""TriMeshReducer: its bound (in C++), and that it is kept from program to picture."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

NETWORK = """
network reducer
light   = Lights()
photons = ParticleTracer(light, count = 20k)
mesh    = TriMeshReducer(SurfaceDE(photons), error = 0)
expect  <= L (D|G|S)* E
image   mesh
"""


def test_known_answers(unit_test):
    unit_test("test_photon_mesh", "--test-case=a reduced*")


def test_the_error_is_bounded_in_the_picture(compiled_network, run_program):
    program = compiled_network("reducer", text=NETWORK)

    def picture(error):
        run = run_program(
            program, SCENES / "closed_box.gltf", "--size", "48x36", "--samples", "1", "--set", f"mesh.error={error}"
        )
        assert run.status == 0, run.stderr
        return exr.read(run.picture)

    exact = picture("0")
    for error in (0.05, 0.3):
        change = abs(picture(f"{error}") - exact).max()
        # Radiance is albedo / pi times irradiance; the room's mean irradiance: about pi / albedo times the picture's.
        assert 0 < change < 1.5 * error * exact.mean()
