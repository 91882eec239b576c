"""`lnc compile --reference EXPR`: expressions that make no picture, and pictures against closed forms and networks."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks import exr
from conftest import ROOT, SCENES
from lnc.cli import main

sys.path.insert(0, str(SCENES))
import closed_forms
import gltf_writer
import shapes

SEEDS = 8
BLOCKS = (3, 4)
WIDTH, HEIGHT = 24, 18


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """reference("L D E", tags="tag t = ..."): the program of an expression."""
    folder = tmp_path_factory.mktemp("references")

    @cache
    def compiled(expression: str, tags: str = "") -> Path:
        program = folder / str(abs(hash((expression, tags))))
        command = [sys.executable, "-m", "lnc", "compile", "--reference", expression, "-o", str(program)]
        if tags:
            file = program.with_suffix(".ln")
            file.write_text(tags)
            command.insert(4, str(file))
        done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
        assert done.returncode == 0, done.stderr
        return program

    return compiled


@pytest.fixture
def pictures(run_program) -> Callable[..., np.ndarray]:
    """pictures(program, scene, options...): block means of SEEDS pictures, seeds x rows x columns x 3."""

    def render(program: Path, scene: Path, *options: str, blocks: tuple[int, int] = BLOCKS) -> np.ndarray:
        found = []
        for seed in range(SEEDS):
            run = run_program(program, scene, "--size", f"{WIDTH}x{HEIGHT}", "--seed", str(seed), *options)
            assert run.status == 0, run.stderr
            found.append(block_means(exr.read(run.picture), *blocks))
        return np.array(found)

    return render


def block_means(image: np.ndarray, rows: int, columns: int) -> np.ndarray:
    height, width, _ = image.shape
    return image.reshape(rows, height // rows, columns, width // columns, 3).mean(axis=(1, 3))


def assert_same_mean(found: np.ndarray, expected: np.ndarray, precision: float) -> None:
    """Equal means by Welch's t-test in every block; `expected` is another set of samples, or exact.

    `precision`: the mean relative standard error that the test must reach, or it shows nothing.
    """
    exact = expected.ndim < found.ndim
    truth = expected if exact else expected.mean(axis=0)
    variance = found.var(axis=0, ddof=1) / len(found)
    if not exact:
        variance = variance + expected.var(axis=0, ddof=1) / len(expected)
    error = np.sqrt(variance)
    assert error.mean() < precision * truth.mean()
    difference = np.abs(found.mean(axis=0) - truth)
    assert (difference <= 6 * error + 1e-5 * truth).all(), difference / error
    t = difference[error > 0] / error[error > 0]
    if t.size > 0:
        assert np.sqrt((t**2).mean()) < 1.6, t


# --- Expressions ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("L S*", "begins at L and ends at E"),
        ("S* E", "begins at L and ends at E"),
        ("L D E E", "begins at L and ends at E"),
        ("L D L E", "begins at L and ends at E"),
        ("L* D E", "begins at L and ends at E"),
        ("L D E | L D", "begins at L and ends at E"),
        ("L D@area E", "no tag is called 'area'"),
        ("L D@florr E", "did you mean 'floor'?"),
        ("L D E)", "LN0101"),
        ("", "LN0101"),
        ("L D E\nimage x", "a single light path is wanted"),
        ("L (D|G|S){300} E", "more than 256 states"),
    ],
)
def test_expressions_that_make_no_picture(tmp_path, capsys, expression, message):
    tags = tmp_path / "tags.ln"
    tags.write_text('tag floor = mesh "Floor"\n')
    program = tmp_path / "program"
    assert main(["compile", str(tags), "--reference", expression, "-o", str(program)]) == 2
    assert message in capsys.readouterr().err
    assert not program.exists()


@pytest.mark.parametrize(
    ("expression", "lost"),
    [
        ("L (D|G|S)* E", "L@deltaSDSE"),
        ("L@delta S D S D@floor S E", "L@deltaSDSD@floorSE"),
        ("L@delta S+ E | L@delta S D E | L@delta D S E | L@delta S D G S E | L@area S D S E", None),
    ],
)
def test_light_that_cannot_be_found_is_named(tmp_path, capsys, expression, lost):
    tags = tmp_path / "tags.ln"
    tags.write_text('tag floor = mesh "Floor"\n')
    options = ["--emit-cpp", str(tmp_path / "reference.cpp")]
    assert main(["compile", str(tags), "--reference", expression, *options]) == 0
    message = capsys.readouterr().err
    assert message.startswith(f"lnc: warning: {lost}: ") if lost else message == ""


# --- Closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "radiance"), [("L D{2} E", 0.25), ("L(D|G|S)*E", closed_forms.furnace_radiance())]
)
def test_furnace(reference, pictures, expression, radiance):
    """Albedo 1/2, emission 1: every event halves the light."""
    found = pictures(reference(expression), SCENES / "furnace.gltf", "--samples", "64")
    assert_same_mean(found, np.full(found.shape[1:], radiance), 0.005)


@pytest.mark.parametrize("scene", ["plane_point", "plane_spot", "plane_area"])
def test_plane(reference, pictures, scene):
    expected = np.array(closed_forms.expected_image(scene, WIDTH, HEIGHT, 8))
    found = pictures(reference("L(D|G|S)*E"), SCENES / f"{scene}.gltf", "--samples", "64")
    assert_same_mean(found, block_means(expected, *BLOCKS), 0.01)


ALBEDO, INTENSITY, LAMP, CEILING = 0.6, 5.0, (0.2, 1.0, 0.1), 2.0


@pytest.fixture(scope="module")
def under_a_mirror(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor at y = 0, a mirror at y = 2 that faces down, a point light between them, and two cameras."""
    scene = gltf_writer.GltfWriter("A point light under a mirror")
    floor = shapes.quad((-20.0, 0.0, -20.0), (0.0, 0.0, 40.0), (40.0, 0.0, 0.0))
    mirror = shapes.quad((-40.0, CEILING, -40.0), (80.0, 0.0, 0.0), (0.0, 0.0, 80.0))
    scene.add_object("Floor", floor, scene.add_lambert("Floor", (ALBEDO,) * 3))
    scene.add_object("Mirror", mirror, scene.add_mirror("Mirror", (1.0, 1.0, 1.0)))
    scene.add_light("Lamp", "point", INTENSITY, position=LAMP)
    scene.add_camera("Oblique", (0.0, 1.5, 2.5), (0.0, 0.0, 0.0), 30.0)
    scene.add_orthographic_camera("Above", (0.0, 0.5, 0.0), (0.0, 0.0, 0.0), 1.5, up=(0.0, 0.0, -1.0))
    file = tmp_path_factory.mktemp("scenes") / "under_a_mirror.glb"
    scene.write(file)
    return file


def seen_on_the_floor(camera: str) -> np.ndarray:
    """Points of y = 0 in the centres of 8 x 8 parts of each pixel, rows x columns x 3."""
    parts = 8
    x = ((np.arange(WIDTH * parts) + 0.5) / (WIDTH * parts) * 2 - 1)[None, :] * (WIDTH / HEIGHT)
    y = (1 - (np.arange(HEIGHT * parts) + 0.5) / (HEIGHT * parts) * 2)[:, None]
    x, y = np.broadcast_arrays(x, y)
    if camera == "Above":
        return np.stack([1.5 * x, np.zeros_like(x), -1.5 * y], axis=-1)
    eye = np.array([0.0, 1.5, 2.5])
    forward = -eye / np.linalg.norm(eye)
    right = np.array([1.0, 0.0, 0.0])
    up = np.cross(right, forward)
    scale = math.tan(math.radians(15.0))
    rays = forward + scale * (x[..., None] * right + y[..., None] * up)
    return eye - rays * (eye[1] / rays[..., 1:2])


@pytest.mark.parametrize("camera", ["Oblique", "Above"])
def test_image_source(reference, pictures, under_a_mirror, camera):
    """A point light and its image in a mirror, found by particles that the camera sees: E = I cos / d^2."""
    d = np.array([LAMP[0], 2 * CEILING - LAMP[1], LAMP[2]]) - seen_on_the_floor(camera)
    radiance = ALBEDO / math.pi * INTENSITY * d[..., 1] / np.linalg.norm(d, axis=-1) ** 3
    expected = block_means(np.repeat(radiance[..., None], 3, axis=-1), 6, 8)
    options = ("--camera", camera, "--samples", "1", "--set", "particles.count=500k")
    found = pictures(reference("L@delta S D E"), under_a_mirror, *options, blocks=(6, 8))
    assert_same_mean(found, expected, 0.02)


@pytest.fixture(scope="module")
def corner(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A floor, and walls that do not touch it, lit by way of a mirror; seen in another, or from its image place."""
    files = {}
    for name in ("in a mirror", "directly"):
        scene = gltf_writer.GltfWriter(f"A corner, seen {name}")
        white = scene.add_lambert("White", (0.8, 0.7, 0.6))
        floor = shapes.quad((-1.0, 0.0, -1.0), (0.0, 0.0, 2.0), (2.0, 0.0, 0.0))
        scene.add_object("Floor", floor, white)
        scene.add_object("Left", shapes.quad((-1.3, 0.0, -1.0), (0.0, 1.5, 0.0), (0.0, 0.0, 2.0)), white)
        scene.add_object("Back", shapes.quad((-1.0, 0.0, -1.3), (0.0, 1.5, 0.0), (2.0, 0.0, 0.0)), white)
        mirror = scene.add_mirror("Mirror", (1.0, 1.0, 1.0))
        first = shapes.quad((-0.5, 2.0, -0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        scene.add_object("First", first, mirror)
        scene.add_light("Lamp", "point", 10.0, position=(0.1, 1.4, 0.0))
        if name == "directly":
            scene.add_camera("Camera", (0.0, 1.8, 4.0), (0.0, 0.0, 0.0), 9.0)
        else:
            second = shapes.quad((-2.0, -1.0, 3.0), (0.0, 4.0, 0.0), (4.0, 0.0, 0.0))
            scene.add_object("Second", second, mirror)
            scene.add_camera("Camera", (0.0, 1.8, 2.0), (0.0, 0.0, 6.0), 9.0)
        files[name] = tmp_path_factory.mktemp("scenes") / "corner.glb"
        scene.write(files[name])
    return files


def test_connected_paths_are_those_seen_without_the_mirror(reference, pictures, corner):
    """L S D D S E by connections of eye paths and particles, against L S D D E by particles that the camera sees."""
    tags = 'tag second = mesh "Second"'
    connected = reference("L@delta S@!second D D S@second E", tags)
    in_mirror = pictures(connected, corner["in a mirror"], "--samples", "256")
    direct = pictures(reference("L@delta S D D E"), corner["directly"], "--samples", "1", "--set", "particles.count=1M")
    assert_same_mean(in_mirror[:, :, ::-1], direct, 0.05)


# --- Networks, parts, tags --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", ["cornell_box.gltf", "mirror_glass.glb"])
def test_all_light_is_that_of_path_tracing(compiled_network, reference, pictures, scene):
    by_network = pictures(compiled_network("path_tracing"), SCENES / scene, "--samples", "128")
    assert_same_mean(pictures(reference("L(D|G|S)*E"), SCENES / scene, "--samples", "128"), by_network, 0.03)


@pytest.mark.slow
def test_parts_add_up(reference, pictures):
    """All kinds of surfaces and lights: disjoint expressions, found in different ways, sum up to the whole."""
    parts = ["L S* E", "L@area S* D S* E", "L@delta S* D S* E", "L S* G S* E", "L S* (D|G) S* (D|G) (D|G|S)* E"]
    options = ("--samples", "64", "--set", "particles.count=100k")
    found = sum(pictures(reference(part), SCENES / "glossy_tags.glb", *options) for part in parts)
    whole = pictures(reference("L(D|G|S)*E"), SCENES / "glossy_tags.glb", *options, "--samples", "128")
    assert_same_mean(found, whole, 0.03)


def test_tags_of_surfaces_and_lights(reference, run_program):
    """A tag and its complement: each pixel of a diffuse box belongs to one surface; lights are told apart."""
    tags = 'tag floor = mesh "Floor"\ntag lamp = node "Lamp"\n'

    def render(expression: str, scene: str) -> np.ndarray:
        run = run_program(reference(expression, tags), SCENES / scene, "--size", "24x18", "--samples", "64")
        assert run.status == 0, run.stderr
        return exr.read(run.picture)

    every = render("L D@floor E | L D@!floor E", "closed_box.gltf")
    floor, rest = render("L D@floor E", "closed_box.gltf"), render("L D@!floor E", "closed_box.gltf")
    np.testing.assert_allclose(floor + rest, every, rtol=1e-6)
    assert (floor[-2:, 8:16] == every[-2:, 8:16]).all() and (floor[:9] == 0).all()
    lamp, others = render("L@lamp D E", "glossy_tags.glb"), render("L@!lamp D E", "glossy_tags.glb")
    both = render("L@lamp D E | L@!lamp D E", "glossy_tags.glb")
    assert 0 < lamp.mean() < both.mean() / 2
    assert (lamp + others).mean() == pytest.approx(both.mean(), rel=0.01)


def test_threads_do_not_matter(reference, run_program):
    program = reference("L(D|G|S)*E")
    options = ("--size", "24x18", "--samples", "3", "--seed", "5", "--set", "particles.count=20k")
    files = []
    for threads in ("1", "2", "5"):
        run = run_program(program, SCENES / "glossy_tags.glb", "--threads", threads, *options)
        assert run.status == 0, run.stderr
        files.append(run.picture.read_bytes())
    assert files[0] == files[1] == files[2]
