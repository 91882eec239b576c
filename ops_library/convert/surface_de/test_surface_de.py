"""SurfaceDE: closed forms (in C++), and agreement with path tracing in a closed diffuse room, corners included."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")


def test_known_answers(unit_test):
    unit_test("test_photon_mesh")


def blocks(picture):
    """Means of 8 x 6 blocks of a picture of 64 x 48."""
    return picture.reshape(6, 8, 8, 8, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("scene", ["closed_box.gltf", "cornell_box.gltf"])
@pytest.mark.parametrize("count", ["100k", pytest.param("1M", marks=pytest.mark.slow)])
def test_mean_agrees_with_path_tracing(compiled_network, run_program, scene, count):
    pictures = []
    for network, options in (
        ("density_estimation", ("--samples", "4", "--set", f"photons.count={count}")),
        ("path_tracing", ("--samples", "256")),
    ):
        run = run_program(compiled_network(network), SCENES / scene, "--size", "64x48", *options)
        assert run.status == 0, run.stderr
        pictures.append(exr.read(run.picture))
    mesh, paths = pictures
    assert mesh.mean() == pytest.approx(paths.mean(), rel=0.015)
    if scene == "closed_box.gltf" and count == "1M":
        # No shadows; only right beside the lamp the light varies faster than kernels are wide.
        errors = abs(blocks(mesh) / blocks(paths) - 1)
        assert (errors < 0.025).mean() > 0.95
        assert errors.max() < 0.09
