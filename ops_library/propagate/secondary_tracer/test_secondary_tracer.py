"""SecondaryTracer: closed forms (in C++), and whole programs that carry the same light by other ways."""

from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

exr = pytest.importorskip("benchmarks.exr")

ONCE_MORE = """
network {name}
light  = Lights()
direct = Direct(light)
{equations}
expect <= L (D|G|S)* E
image  {image}
"""


def test_known_answers(unit_test):
    unit_test("test_photon_tracer", "--test-case=secondary*")


def mean(compiled_network, run_program, name, equations, image, scene, samples):
    text = ONCE_MORE.format(name=name, equations=equations, image=image)
    program = compiled_network(name, text=text)
    run = run_program(program, SCENES / scene, "--size", "32x24", "--samples", str(samples))
    assert run.status == 0, run.stderr
    return exr.read(run.picture).mean()


@pytest.mark.parametrize("scene", ["closed_box.gltf", "cornell_box.gltf"])
def test_light_once_scattered_is_that_of_particles_from_emitters(compiled_network, run_program, scene):
    """L D by particles from what Direct lights, and by particles that were scattered once."""
    found, truth = (
        mean(
            compiled_network,
            run_program,
            f"once_by_{name}",
            f"photons = ParticleTracer({source}, count = 200k, via = {via})\n"
            "density = NNDensity(photons, neighbours = 30)",
            "density",
            scene,
            8,
        )
        for name, source, via in (("secondary", "direct", "()"), ("primary", "light", "D"))
    )
    assert found == pytest.approx(truth, rel=0.01)
