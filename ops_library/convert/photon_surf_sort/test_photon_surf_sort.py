"""PhotonSurfSort: known answers (in C++), and it is inserted where it is left out."""

from pathlib import Path

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"

NETWORK = """
network surf_sort
light   = Lights()
photons = ParticleTracer(light, count = 2000)
mesh    = SurfaceDE({photons})
expect  <= L (D|G|S)* E
image   mesh
"""


def test_known_answers(unit_test):
    unit_test("test_photon_mesh", "--test-case=photons are sorted*")


def test_inserted_or_written_out_it_is_the_same(compiled_network, run_program):
    rays = []
    for name, photons in (("inserted", "photons"), ("written", "PhotonSurfSort(photons)")):
        program = compiled_network(f"surf_sort_{name}", text=NETWORK.format(photons=photons))
        run = run_program(program, SCENES / "closed_box.gltf", "--size", "16x12", "--samples", "1")
        assert run.status == 0, run.stderr
        rays.append(run.stats["rays"])
    assert rays[0] == rays[1]
