"""Radiosity: closed forms (in C++), and agreement with path tracing in two rooms."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")


def picture(run_program, program, *options, scene="cornell_box.gltf"):
    run = run_program(program, SCENES / scene, "--size", "40x30", *options)
    assert run.status == 0, run.stderr
    return exr.read(run.picture)


@pytest.mark.parametrize("unit", ["test_form_factor", "test_radiosity"])
def test_known_answers(unit_test, unit):
    unit_test(unit)


@pytest.mark.slow
def test_known_answers_of_many_surfaces(unit_test):
    unit_test("test_radiosity", "--no-skip", "--test-case=slow*")


@pytest.mark.parametrize("scene", ["cornell_box.gltf", "closed_box.gltf"])
def test_mean_agrees_with_path_tracing(compiled_network, run_program, scene):
    radiosity = picture(run_program, compiled_network("radiosity"), "--samples", "64", scene=scene)
    paths = picture(run_program, compiled_network("path_tracing"), "--samples", "256", scene=scene)
    assert radiosity.mean() == pytest.approx(paths.mean(), rel=0.01)  # half of it is direct; the declared bias is 2 %
    assert abs(radiosity - paths).mean() < 0.04 * paths.mean()


def test_the_threads_change_nothing(compiled_network, run_program):
    options = ("--samples", "1", "--set", "indirect.error=0.1", "--set", "direct_tree.cell=1m")
    pictures = [picture(run_program, compiled_network("radiosity"), *options, "--threads", str(n)) for n in (1, 3)]
    assert (pictures[0] == pictures[1]).all()
