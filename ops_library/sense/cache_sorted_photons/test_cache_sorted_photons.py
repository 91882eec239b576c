"""The same picture from what was kept, without tracing photons again."""

NETWORK = """
network kept_sorted_photons
light   = Lights()
photons = ParticleTracer(light, count = 2k)
kept    = CacheSortedPhotons(PhotonSurfSort(photons), file = "sorted.cache")
expect <= L (D|G|S)* E
image  SurfaceDE(kept)
"""


def test_read_back(kept_wire):
    kept_wire("kept_sorted_photons", NETWORK, change="photons.count=3k", rays="photon")
