"""The same picture from what was kept, without tracing photons again."""

NETWORK = """
network kept_photon_map
light   = Lights()
photons = ParticleTracer(light, count = 2k)
kept    = CachePhotonMap(KDPhotonTree(photons), file = "map.cache")
expect <= L (D|G|S)* E
image  NNDensity(kept, neighbours = 20)
"""


def test_read_back(kept_wire):
    kept_wire("kept_photon_map", NETWORK, change="photons.count=3k", rays="photon")
