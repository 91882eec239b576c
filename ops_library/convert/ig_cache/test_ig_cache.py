"""IGCache: octree and series of bounces (in C++), the same bits with any number of threads, its cost, its file."""

import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
sys.path.insert(0, str(SCENES))
import make_scenes  # noqa: E402

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


def test_known_answers(unit_test):
    unit_test("test_irradiance_records")


def test_the_seed_decides_not_the_threads(run):
    options = ("--size", "40x30", "--samples", "2", *FEW)
    pictures = [run("mirror_glass.glb", *options, "--threads", str(n))[0] for n in (1, 2, 5)]
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[0] != run("mirror_glass.glb", *options, "--seed", "1")[0]).any()


def test_cost_hardly_depends_on_the_size_of_the_picture(run):
    """Rays of the records alone: those that each sample of a pixel takes are known from a second one."""

    def rays_of_records(size: str) -> int:
        one, two = (run("cornell_box.gltf", "--size", size, "--samples", n)[1]["gather"] for n in ("1", "2"))
        return 2 * one - two

    assert rays_of_records("320x240") < 1.3 * rays_of_records("160x120")


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


def room_with_closet(path: Path) -> Path:
    """A room of 4 x 3 x 3 m, its lamp 2 cm below the ceiling. A partition without thickness at x = 1.2 divides off a
    closet that no light can get into."""
    scene = make_scenes.GltfWriter("closet")
    white = scene.add_lambert("White", (0.7, 0.7, 0.7))
    make_scenes.add_room(scene, (-2.0, 0.0, -1.5), (2.0, 3.0, 1.5), dict.fromkeys(make_scenes.WALL_NAMES, white))
    sheet = scene.add_material("Sheet", (0.7, 0.7, 0.7), specular=0.0, double_sided=True)
    scene.add_object("Partition", make_scenes.quad((1.2, 0.0, -1.5), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0)), sheet)
    lamp = scene.add_emitter("Lamp", (9.0, 9.0, 9.0))
    scene.add_object("Lamp", make_scenes.ceiling_light((-0.5, 2.98, 0.0), 1.0, 0.6), lamp)
    scene.write(path)
    return path


def test_neither_light_nor_shadow_leaks(compiled_network, run_program, tmp_path):
    """Sensors on the floor, from the middle of the room to the closet's far wall; then on the ceiling above the lamp,
    and on the lamp: black in the closet and above the lamp, elsewhere as bright as by path tracing."""
    xs = np.linspace(-1.0, 1.96, 38)  # those next to the partition: 4 cm before and behind it
    rows = [f"{x:.4f},0,{z},0,1,0" for z in (-0.9, 0.3) for x in xs]
    rows += [f"{x:.4f},{y},{z},0,-1,0" for y in (3, 2.98) for z in (-0.1, 0.1) for x in np.linspace(-0.8, -0.2, 13)]
    (tmp_path / "sensors.csv").write_text("x,y,z,nx,ny,nz\n" + "\n".join(rows) + "\n")
    scene = room_with_closet(tmp_path / "closet.glb")
    done = run_program(compiled_network("measured", text=MEASURED), scene, "--samples", "1024")
    assert done.status == 0, done.stderr
    smooth, traced = (np.genfromtxt(tmp_path / f"{n}.csv", delimiter=",", names=True) for n in ("smooth", "traced"))
    truth, brightest = traced["lux"], traced["lux"].max()
    lit = truth > 0.01 * brightest
    assert lit.sum() == 2 * (xs < 1.2).sum() + 26
    assert smooth["lux"][~lit].max() < 0.01 * brightest
    assert (np.abs(smooth["lux"] - truth)[lit] < 4 * traced["stderr"][lit] + 0.03 * brightest).all()


KEPT = """
network kept
light   = Lights()
photons = CachePhotons(ParticleTracer(light, count = 5k), file = "photons.cache")
around  = Gather(NNDensity(photons))
samples = IGSampler(around, samples = 16)
records = IGCache(samples, file = "records.cache")
smooth  = IGInterpolator(records)
cells   = CacheQuadTree(PointsToQuadTree(smooth, depth = 2), file = "cells.cache")
expect <= L (D|G|S)* E
image  cells
tap    records -> "records.csv"
tap    smooth -> "smooth.exr"
probe  smooth at "sensors.csv" -> "smooth.csv"
"""
TAPS = ("records.csv", "smooth.exr", "smooth.csv")


@pytest.fixture
def kept(compiled_network, run_program, tmp_path):
    """kept(scene, options...): all files of a run but its caches; rays of nodes; notes about each cache."""
    program = compiled_network("kept_records", text=KEPT)
    (tmp_path / "sensors.csv").write_text(SENSORS)

    def run(scene="cornell_box.gltf", *options):
        done = run_program(program, SCENES / scene, "--size", "12x9", "--samples", "4", *options)
        assert done.status == 0, done.stderr
        files = [done.picture.read_bytes()] + [(tmp_path / name).read_bytes() for name in TAPS]
        notes = {
            line.split(":")[1].strip(): line for line in done.stderr.splitlines() if "this cache is not used" in line
        }
        return files, {node["name"]: node["rays"] for node in done.stats["nodes"]}, notes

    return run


def test_kept_records_make_the_same_picture_without_work(kept, tmp_path):
    """Every file has the same bits, and no ray is cast for records."""
    first, rays, notes = kept()
    assert rays["records"] > 100 and not notes
    again, rays_again, notes = kept("cornell_box.gltf", "--threads", "1")
    assert again == first and not notes
    assert rays_again["records"] == 0
    # What lies between records is sampled on the spot: a small part of the work.
    assert rays_again["around"] < 0.1 * rays["around"]


@pytest.mark.parametrize(
    ("options", "stale", "reason"),
    [
        (("cornell_box.gltf", "--seed", "3"), {"photons", "records", "cells"}, "it was made with seed 0"),
        (("cornell_box.gltf", "--size", "13x9"), {"records", "cells"}, "it was made for another camera, size"),
        (
            ("cornell_box.gltf", "--set", "records.error=25%"),
            {"records", "cells"},
            "it was made by another network, or with",
        ),
        (
            ("cornell_box.gltf", "--set", "photons_tracer.count=6k"),
            {"photons", "records", "cells"},
            "it was made by another network",
        ),
    ],
)
def test_stale_records(kept, options, stale, reason):
    """Also what is made of records is stale then: cells know what their records looked at."""
    kept()
    fresh, _, notes = kept(*options)
    assert set(notes) == {f"{name}.cache" for name in stale}
    assert all(reason in note for note in notes.values()), notes
    again, _, notes = kept(*options)
    assert again == fresh and not notes


def test_other_sensors_make_records_stale(kept, tmp_path):
    kept()
    (tmp_path / "sensors.csv").write_text(SENSORS.replace("1.5,0,-2.7", "1.4,0,-2.7"))
    assert set(kept()[2]) == {"records.cache", "cells.cache"}


def test_damaged_records(kept, tmp_path):
    first, _, _ = kept()
    cache = tmp_path / "records.cache"
    whole = cache.read_bytes()
    for content in (b"", whole[:200], whole[:-1], whole + b"x", whole[:300] + bytes([whole[300] ^ 1]) + whole[301:]):
        cache.write_bytes(content)
        files, _, notes = kept()
        assert files == first and set(notes) == {"records.cache"}
        assert cache.read_bytes() == whole
