"""KDPhotonTree: it finds what a search of all photons finds (in C++), and is inserted where it is left out."""

from pathlib import Path

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"


def test_known_answers(unit_test):
    unit_test("test_photon_map")


def test_inserted_or_written_out_it_is_the_same(compiled_network, run_program):
    text = """
network {name}
light   = Lights()
photons = ParticleTracer(light, count = 2000)
density = NNDensity({map})
expect  <= L (D|G|S)* E
image   density
"""
    pictures = []
    for name, tree in (("inserted", "photons"), ("written", "KDPhotonTree(photons)")):
        program = compiled_network(f"tree_{name}", text=text.format(name="tree", map=tree))
        run = run_program(program, SCENES / "closed_box.gltf", "--size", "16x12", "--samples", "1")
        assert run.status == 0, run.stderr
        pictures.append(run.stats["rays"])
    assert pictures[0] == pictures[1]
