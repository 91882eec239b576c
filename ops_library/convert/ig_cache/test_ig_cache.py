"""IGCache: its octree and its series of bounces (in C++); the same bits with any number of threads; what it costs."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
MEASURED = """
network measured
light  = Lights()
direct = Direct(light)
around = PathTracer(direct + smooth, via = D)
smooth = IGInterpolator(IGCache(IGSampler(around)))
traced = PathTracer(direct + traced, via = D)
expect <= L (D|G|S)*
probe smooth at "sensors.csv" -> "smooth.csv"
probe traced at "sensors.csv" -> "traced.csv"
"""
SENSORS = """x,y,z,nx,ny,nz
0,0,-2.7,0,1,0
1.5,0,-2.7,0,1,0
0,2.5,-5.5,0,0,1
0,1,-5.5,0,0,1
-3,2.5,-2.7,1,0,0
3,2.5,-2.7,-1,0,0
1.15,0,-1.9,0,1,0
"""
FEW = ("--set", "samples.samples=64")


@pytest.fixture
def run(compiled_network, run_program):
    def run(scene, *options):
        done = run_program(compiled_network("irradiance_gradients"), SCENES / scene, *options)
        assert done.status == 0, done.stderr
        return exr.read(done.picture), done.stats["rays"]

    return run


def test_known_answers(runtime_tool):
    done = subprocess.run([runtime_tool("test_irradiance_records")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_the_seed_decides_not_the_threads(run):
    options = ("--size", "40x30", "--samples", "2", *FEW)
    pictures = [run("mirror_glass.glb", *options, "--threads", str(n))[0] for n in (1, 2, 5)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[0] != run("mirror_glass.glb", *options, "--seed", "1")[0]).any()


def test_cost_hardly_depends_on_the_size_of_the_picture(run):
    """Rays of the records alone: those that each sample of a pixel takes are known from a second one."""

    def rays_of_records(size: str) -> int:
        one, two = (run("cornell_box.gltf", "--size", size, "--samples", n, *FEW)[1]["gather"] for n in ("1", "2"))
        return 2 * one - two

    assert rays_of_records("320x240") < 1.5 * rays_of_records("160x120")


def test_bounces_are_a_series(run):
    """Two rounds and the rest of the series give what eight give: in the box each further bounce is weaker by half."""
    means = [
        run("closed_box.gltf", "--size", "20x15", "--samples", "16", *FEW, "--set", f"records.bounces={n}")[0].mean()
        for n in (1, 2, 8)
    ]
    assert means[1] == pytest.approx(means[2], rel=0.02)
    assert means[0] < 0.97 * means[2]


def test_records_where_probes_measure(compiled_network, run_program, tmp_path):
    """Without a picture, the same light as path tracing finds; below a box on the floor (the last sensor) none."""
    (tmp_path / "sensors.csv").write_text(SENSORS)
    done = run_program(compiled_network("measured", text=MEASURED), SCENES / "cornell_box.gltf", "--samples", "4096")
    assert done.status == 0, done.stderr
    smooth, traced = (np.genfromtxt(tmp_path / f"{n}.csv", delimiter=",", names=True) for n in ("smooth", "traced"))
    lux, truth = smooth["lux"], traced["lux"]
    assert (np.abs(lux - truth) < 4 * traced["stderr"] + 0.02 * truth.max())[:-1].all(), lux / truth
    assert np.abs(lux[:-1] / truth[:-1] - 1).mean() < 0.04
    assert truth[-1] == 0
    assert lux[-1] < 0.06 * truth.max()
