"""Whole programs: networks that carry the same light agree, pictures do not depend on threads, and a program costs
little more than one written by hand."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr
from conftest import ROOT, SCENES
from lnc.build import BuildOptions, build_program
from lnc.locations import library_folders

SIZE = ("--size", "80x60")


def block_means(image: np.ndarray, rows: int, columns: int) -> np.ndarray:
    height, width, _ = image.shape
    return image.reshape(rows, height // rows, columns, width // columns, 3).mean(axis=(1, 3, 4))


@pytest.mark.parametrize(
    ("size", "paths", "estimates", "first"),
    [("40x30", "256", "16", 1), pytest.param("80x60", "512", "64", 0, marks=pytest.mark.slow)],
)
def test_photon_density_agrees_with_path_tracing(compiled_network, run_program, size, paths, estimates, first):
    """In a closed diffuse box, at default settings: the mean within 1.5 %, corners and edges too within their noise.
    With few samples not the first row of blocks, where the noise is that of the lamp's edge in a pixel."""
    pictures = []
    for network, samples in (("path_tracing", paths), ("photon_density", estimates)):
        run = run_program(compiled_network(network), SCENES / "closed_box.gltf", "--size", size, "--samples", samples)
        assert run.status == 0, run.stderr
        pictures.append(exr.read(run.picture))
    truth, found = pictures
    assert found.mean() / truth.mean() == pytest.approx(1, rel=0.015)
    np.testing.assert_allclose(block_means(found, 6, 8)[first:], block_means(truth, 6, 8)[first:], rtol=0.06)


BY_PATHS = """
network caustics_by_paths
light    = Lights()
direct   = Direct(light)
specular = PathTracer(direct + specular, via = S)
expect L S* E | L (D|G) S* E | L@area S+ (D|G) S* E
image  direct + specular
"""


def test_caustics_agree_with_the_same_paths_traced_from_the_eye(compiled_network, run_program):
    """Photons through mirror and glass against a path tracer that is restricted to the same light."""
    by_paths, by_photons = compiled_network("caustics_by_paths", text=BY_PATHS), compiled_network("caustics")
    pictures = []
    for program, options in (
        (by_paths, ("--samples", "512")),
        (by_photons, ("--samples", "32", "--set", "photons.count=500k")),
    ):
        run = run_program(program, SCENES / "mirror_glass.glb", *SIZE, *options)
        assert run.status == 0, run.stderr
        pictures.append(exr.read(run.picture))
    expected, picture = pictures
    ratios = block_means(picture, 3, 4) / block_means(expected, 3, 4)
    np.testing.assert_allclose(ratios, 1, atol=0.05)
    assert picture.mean() / expected.mean() == pytest.approx(1, rel=0.01)


@pytest.mark.parametrize(("network", "scene"), [("path_tracing", "glossy_tags.glb"), ("caustics", "mirror_glass.glb")])
def test_threads_do_not_matter(compiled_network, run_program, network, scene):
    """The same seed gives the same bytes with 1, 2 and 5 threads, another seed another picture."""
    program = compiled_network(network)
    files = {}
    for threads, seed in ((1, 7), (2, 7), (5, 7), (2, 8)):
        options = ["--threads", str(threads), "--seed", str(seed)]
        if network == "caustics":
            options += ["--set", "photons.count=20k"]
        run = run_program(program, SCENES / scene, "--size", "40x30", "--samples", "6", *options)
        assert run.status == 0, run.stderr
        files[threads, seed] = run.picture.read_bytes()
    assert files[1, 7] == files[2, 7] == files[5, 7]
    assert files[2, 8] != files[2, 7]


def build_monolith(program: Path, options: BuildOptions) -> Path:
    """benchmarks/monolith/path_tracing.cpp, compiled as networks are."""
    cpp = (ROOT / "benchmarks" / "monolith" / "path_tracing.cpp").read_text()
    build_program(cpp, library_folders(()), program, options, quiet=True)
    return program


@pytest.fixture(scope="module")
def monolith(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_monolith(tmp_path_factory.mktemp("monolith") / "path_tracing", BuildOptions())


@pytest.mark.parametrize("scene", ["cornell_box.gltf", "glossy_tags.glb"])
def test_the_monolith_computes_the_same(compiled_network, run_program, monolith, scene):
    """Same rays, same picture up to rounding."""
    options = ("--size", "40x30", "--samples", "8", "--threads", "1")
    by_hand = run_program(monolith, SCENES / scene, *options)
    expected, rays = exr.read(by_hand.picture), by_hand.stats["rays"]
    run = run_program(compiled_network("path_tracing"), SCENES / scene, *options)
    found = exr.read(run.picture)
    assert found.mean() == pytest.approx(expected.mean(), rel=1e-4)
    assert (np.abs(found - expected) <= 1e-3 * expected + 1e-5).mean() > 0.999
    # A decision of the roulette may fall to the other side by rounding.
    for kind, count in rays.items():
        assert run.stats["rays"][kind] == pytest.approx(count, rel=1e-4), kind


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="counts instructions with valgrind")
def test_overhead_over_the_monolith(tmp_path):
    """At most 5 % more instructions than the program by hand; few pixels, so that no pass is cut by time.

    Portable programs: valgrind does not know the instructions of every processor.
    """

    def instructions(program: Path) -> int:
        command = [
            "valgrind",
            "--tool=callgrind",
            f"--callgrind-out-file={tmp_path / 'out'}",
            program,
            SCENES / "cornell_box.gltf",
        ]
        options = [
            "-o",
            tmp_path / "out.exr",
            "--size",
            "32x24",
            "--samples",
            "64",
            "--threads",
            "1",
            "--progress",
            "none",
        ]
        done = subprocess.run([*command, *options], capture_output=True, text=True, check=True)
        return int(done.stderr.split("Collected :")[1].split()[0])

    network = tmp_path / "network"
    subprocess.run(
        [sys.executable, "-m", "lnc", "compile", ROOT / "examples" / "path_tracing.ln", "--portable", "-o", network],
        cwd=ROOT,
        check=True,
    )
    by_hand = build_monolith(tmp_path / "monolith", BuildOptions(portable=True))
    assert instructions(network) <= 1.05 * instructions(by_hand)
