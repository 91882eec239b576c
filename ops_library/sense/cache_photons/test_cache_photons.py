"""CachePhotons: the same picture without tracing again; and whatever is stale or damaged is said and made anew."""

import shutil
from pathlib import Path

import pytest

SCENES = Path(__file__).resolve().parents[3] / "examples" / "scenes"
NETWORK = """
network kept
light   = Lights()
photons = ParticleTracer(light, count = 5k)
cached  = CachePhotons(photons, file = "photons.cache")
density = NNDensity(cached, neighbours = 20)
expect <= L (D|G|S)* E
image  density
"""
OPTIONS = ("--size", "6x4", "--samples", "2")


@pytest.fixture
def kept(compiled_network, run_program, tmp_path):
    """kept(scene, options...): the picture's bytes, whether photons were traced, and what was said."""

    def run(scene="cornell_box.gltf", *options):
        done = run_program(compiled_network("kept", text=NETWORK), SCENES / scene, *OPTIONS, *options)
        assert done.status == 0, done.stderr
        return done.picture.read_bytes(), done.stats["rays"]["photon"] > 0, done.stderr

    return run


def test_read_back(kept, tmp_path):
    first, traced, said = kept()
    assert traced and "cache" not in said
    again, traced, said = kept("cornell_box.gltf", "--threads", "1")
    assert again == first and not traced and "cache" not in said


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("cornell_box.gltf", "--seed", "1"), "it was made with seed 0"),
        (("cornell_box.gltf", "--set", "photons.count=6k"), "it was made by another network, or with other parameters"),
        (("closed_box.gltf",), "it was made for another scene"),
    ],
)
def test_stale(kept, options, reason):
    kept()
    _, traced, said = kept(*options)
    assert traced and f"photons.cache: this cache is not used, {reason}; it is computed and written again" in said
    _, traced, said = kept(*options)
    assert not traced and "cache" not in said


def test_damage(kept, tmp_path):
    first, _, _ = kept()
    cache = tmp_path / "photons.cache"
    whole = cache.read_bytes()
    damaged = [b"", whole[:5], whole[:50], whole[:-1], whole + b"x"]
    for place in (9, 20, 40, 57, 70, 80, 90, 105, 200, len(whole) - 2):
        damaged.append(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
    for content in damaged:
        cache.write_bytes(content)
        picture, traced, said = kept()
        assert picture == first and traced
        assert "this cache is not used" in said
        assert cache.read_bytes() == whole


def test_what_is_no_cache_is_not_overwritten(compiled_network, run_program, tmp_path):
    cache = tmp_path / "photons.cache"
    for content in (b"my own notes", b"LNCACHE, a story\n" * 20):
        cache.write_bytes(content)
        done = run_program(compiled_network("kept", text=NETWORK), SCENES / "cornell_box.gltf", *OPTIONS)
        assert done.status == 1 and not done.picture.exists()
        assert "photons.cache: holds something else than a cache, which is not overwritten" in done.stderr
        assert cache.read_bytes() == content


def test_a_cache_that_cannot_be_written_is_a_warning(kept, tmp_path):
    (tmp_path / "photons.cache").mkdir()
    _, traced, said = kept()
    assert traced and "warning: photons.cache: " in said and "this cache is not kept" in said


def test_other_sources(kept, compiled_network, run_program, tmp_path):
    """An operator that has been changed makes the cache stale, though network and parameters are the same."""
    kept()
    family = tmp_path / "ops" / "mine"
    shutil.copytree(Path(__file__).parents[2] / "propagate" / "particle_tracer", family / "particle_tracer")
    header = family / "particle_tracer" / "particle_tracer.hpp"
    header.write_text(header.read_text() + "// changed\n")
    changed = compiled_network("kept_by_others", text=NETWORK, ops=tmp_path / "ops")
    run = run_program(changed, SCENES / "cornell_box.gltf", *OPTIONS)
    assert run.status == 0 and run.stats["rays"]["photon"] > 0
    assert "photons.cache: this cache is not used, it was made by another version of its operators" in run.stderr


TWO = """
network two
light  = Lights()
first  = CachePhotons(ParticleTracer(light, count = 1k), file = "first.cache")
second = CachePhotons(ParticleTracer(light, count = 2k), file = "second.cache")
expect <= L (D|G|S)* E
image  NNDensity(first) - NNDensity(second)
"""


def test_two_caches_want_two_files(compiled_network, run_program, tmp_path):
    program = compiled_network("two", text=TWO)
    for name in ("first.cache", "./first.cache", str(tmp_path / "first.cache")):
        run = run_program(program, SCENES / "cornell_box.gltf", *OPTIONS, "--set", f"second.file={name}")
        assert run.status == 1 and not run.picture.exists()
        assert "'first' and 'second' are to be kept in this one file" in run.stderr
        assert not (tmp_path / "first.cache").exists()
