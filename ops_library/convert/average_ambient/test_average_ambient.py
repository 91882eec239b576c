"""AverageAmbient: in the furnace the closed form, and what the tags say in a room."""

import math
from pathlib import Path

import numpy as np
import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

NETWORK = """
tag blocks = mesh "* block"
tag floor  = mesh "Floor"

light   = Lights()
cells   = PointsToQuadTree(Direct(light), cell = 0.5m)
ambient = AverageAmbient(cells, from = floor, to = blocks)
image ambient
tap   AverageAmbient(cells) -> "everywhere.exr"
"""


def test_known_answers(unit_test):
    unit_test("test_ambient")


def picture(run_program, program, scene):
    run = run_program(program, SCENES / scene, "--size", "40x30", "--samples", "1")
    assert run.status == 0, run.stderr
    return exr.read(run.picture), exr.read(run.picture.parent / "everywhere.exr")


def test_the_furnace_has_the_same_irradiance_everywhere(compiled_network, run_program):
    # Emission 1 all around is the irradiance pi, of which the walls reflect one half: 1 + 1/2.
    text = NETWORK.replace("image ambient\n", "image AverageAmbient(cells)\n")
    image, _ = picture(run_program, compiled_network("furnace_ambient", text=text), "furnace.gltf")
    assert np.allclose(image, 1.5, rtol=0.005)


def test_as_much_light_is_given_as_there_was(compiled_network, run_program):
    """Direct light of the closed box, on all surfaces: not on the outside of the room, nor inside of the blocks."""
    text = "cells = PointsToQuadTree(Direct(Lights()), cell = 0.5m)\nambient = AverageAmbient(cells)\nimage ambient\n"
    program = compiled_network("ambient_everywhere", text=text)
    run = run_program(program, SCENES / "closed_box.gltf", "--verify-paths", "--samples", "256")
    assert run.status == 0, run.stderr
    found = {line.split()[0]: float(line.split()[2]) for line in run.stdout.splitlines()[1:]}
    given, was = found["ambient"], found["cells"]
    assert given == pytest.approx(was, rel=0.02), run.stdout


def test_tags_say_what_is_averaged_and_who_gets_it(compiled_network, run_program):
    blocks, everywhere = picture(run_program, compiled_network("ambient", text=NETWORK), "cornell_box.gltf")
    dark = 5.0  # the lamp is brighter
    values = {round(v, 5) for v in blocks[..., 0].ravel() if 0 < v < dark}
    assert len(values) == 1  # both blocks, and nothing else
    assert 0.1 < (blocks[..., 0] > 0).mean() < 0.6
    on_blocks = (blocks[..., 0] > 0) & (blocks[..., 0] < dark)
    assert (blocks[on_blocks, 1] > 1.2 * everywhere[on_blocks, 1]).all(), "the floor is brighter than most"
    assert math.isclose(blocks[on_blocks, 1].max() / blocks[on_blocks, 1].min(), 1, rel_tol=1e-5)
