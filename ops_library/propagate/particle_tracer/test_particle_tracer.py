"""ParticleTracer: its ledger, energy and path expressions (in C++), and the photon rays of a whole program."""

from pathlib import Path

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

NETWORK = """
network photons
light   = Lights()
photons = ParticleTracer(light, count = 1000, via = {via})
density = NNDensity(photons)
expect  <= L (D|G|S)* E
image   density
"""


def test_known_answers(unit_test):
    unit_test("test_photon_tracer")


def photon_rays(compiled_network, run_program, name, via, *options):
    program = compiled_network(name, text=NETWORK.format(via=via))
    run = run_program(program, SCENES / "closed_box.gltf", "--size", "8x6", "--samples", "1", *options)
    assert run.status == 0, run.stderr
    return run.stats["rays"]["photon"]


def test_rays_follow_the_path_expression(compiled_network, run_program):
    # In a closed diffuse room every particle hits something; without further events that is its only ray.
    assert photon_rays(compiled_network, run_program, "photons_s", "S*") == 1000
    assert photon_rays(compiled_network, run_program, "photons_all", "(D|G|S)*") > 1500
    assert photon_rays(compiled_network, run_program, "photons_all", "(D|G|S)*", "--set", "photons.count=10") < 100


def test_too_many_photons_are_refused(compiled_network, run_program):
    program = compiled_network("photons_all", text=NETWORK.format(via="(D|G|S)*"))
    run = run_program(program, SCENES / "closed_box.gltf", "--set", "photons.count=1000000000000")
    assert run.status in (1, 2)
    assert not run.picture.exists()
