"""The tools of benchmarks/: picture files, error measures, and that Mitsuba gets the scene that the glTF file means.

Those marked `mitsuba` need it (`pip install mitsuba`) and are skipped otherwise. They use its scalar variant, which
needs no LLVM.
"""

from __future__ import annotations

import math
import struct
import sys
import zlib
from pathlib import Path
from typing import Any

import pytest

np = pytest.importorskip("numpy")

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "examples" / "scenes"
sys.path[:0] = [str(ROOT), str(SCENES)]

import closed_forms  # noqa: E402
import make_scenes  # noqa: E402

from benchmarks import exr, gltf, image_error  # noqa: E402
from benchmarks.facet_albedo import facet_albedo  # noqa: E402


@pytest.fixture(scope="module")
def mi() -> Any:
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def picture(height: int = 21, width: int = 13, seed: int = 1) -> Any:
    return np.random.default_rng(seed).gamma(0.5, size=(height, width, 3)).astype(np.float32).astype(np.float64)


# ---- picture files ----


def test_exr_round_trip(tmp_path: Path) -> None:
    image, layer = picture(), picture(seed=2)
    exr.write(tmp_path / "a.exr", image, {"variance": layer})
    assert (exr.read(tmp_path / "a.exr") == image).all()
    assert (exr.read(tmp_path / "a.exr", "variance") == layer).all()
    assert [p.name for p in tmp_path.iterdir()] == ["a.exr"]


def test_exr_that_is_smooth_is_really_zipped(tmp_path: Path) -> None:
    image = np.ones((40, 30, 3))
    exr.write(tmp_path / "a.exr", image)
    assert (tmp_path / "a.exr").stat().st_size < 2000
    assert (exr.read(tmp_path / "a.exr") == image).all()


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n"])
def test_not_an_exr_file(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.exr").write_bytes(content)
    with pytest.raises(exr.ExrError, match="not an OpenEXR file"):
        exr.read(tmp_path / "a.exr")


def test_missing_layer_names_the_others(tmp_path: Path) -> None:
    exr.write(tmp_path / "a.exr", picture())
    with pytest.raises(exr.ExrError, match=r"no channel 'direct\.R'; there are B, G, R"):
        exr.read(tmp_path / "a.exr", "direct")


@pytest.mark.mitsuba
def test_exr_against_mitsuba(tmp_path: Path, mi: Any) -> None:
    image = picture().astype(np.float32)
    exr.write(tmp_path / "ours.exr", image)
    theirs = np.array(mi.Bitmap(str(tmp_path / "ours.exr")).convert(component_format=mi.Struct.Type.Float32))
    assert (theirs == image).all()
    mi.Bitmap(image).write(str(tmp_path / "theirs.exr"))
    assert (exr.read(tmp_path / "theirs.exr") == image).all()


def test_png(tmp_path: Path) -> None:
    pixels = exr.tone_mapped(np.array([[[0.0, 0.5, 1.0], [2.0, np.nan, 0.0031308]]]))
    assert pixels.tolist() == [[[0, 188, 255], [255, 0, 10]]]
    assert exr.tone_mapped(np.full((1, 1, 3), 0.25), exposure=2)[0, 0, 0] == 255
    exr.write_png(tmp_path / "a.png", pixels)
    data = (tmp_path / "a.png").read_bytes()
    assert struct.unpack_from(">II", data, 16) == (2, 1)
    start = data.index(b"IDAT") + 4
    size = struct.unpack_from(">I", data, start - 8)[0]
    assert zlib.decompress(data[start : start + size]) == b"\0" + pixels.tobytes()


# ---- error measures ----


def test_rel_mse_takes_off_the_noise_of_the_reference() -> None:
    rng = np.random.default_rng(3)
    truth = np.full((100, 120, 3), 0.5)
    reference = truth + rng.normal(0, 0.03, truth.shape)
    image = truth + rng.normal(0, 0.03, truth.shape)
    expected = 0.03**2 / (0.5**2 + 0.01)
    assert image_error.rel_mse(image, truth) == pytest.approx(expected, rel=0.05)
    assert image_error.rel_mse(image, reference) == pytest.approx(2 * expected, rel=0.1)
    assert image_error.rel_mse(image, reference, np.full(truth.shape, 0.03**2)) == pytest.approx(expected, rel=0.1)


def test_blocks_of_equal_pictures_pass_and_a_wrong_block_is_found() -> None:
    rng = np.random.default_rng(4)
    truth = picture(48, 64) + 0.1
    ours, reference = ([truth + rng.normal(0, 0.05, truth.shape) for _ in range(8)] for _ in range(2))
    a, b = image_error.mean_and_variance(ours), image_error.mean_and_variance(reference)
    assert image_error.block_test(*a, *b).passed
    a[0][16:24, 40:48] += 0.02
    test = image_error.block_test(*a, *b)
    assert not test.passed
    assert test.worst()[0][:2] == (2, 5)


# ---- scenes ----


@pytest.mark.parametrize("file", sorted(make_scenes.SCENES))
def test_loader_reads_every_scene(file: str) -> None:
    model = gltf.load(SCENES / file)
    assert len(model.cameras) == 1
    for triangles in model.triangles:
        smooth = any(word in triangles.name for word in ("ball", "Reflector"))
        assert (triangles.normals is not None) == smooth, triangles.name


def test_loader_places_nodes_and_materials() -> None:
    model = gltf.load(SCENES / "cornell_box.gltf")
    light = next(t for t in model.triangles if t.name == "Light")
    assert light.material.emission == pytest.approx((20, 16, 11))
    assert set(light.positions[:, 1]) == {np.float64(np.float32(4.98))}
    block = next(t for t in model.triangles if t.name == "Tall block")
    assert np.ptp(block.positions, axis=0)[1] == pytest.approx(3.2)
    assert np.mean(block.positions, axis=0) == pytest.approx([-1.1, 1.6, -3.7], abs=1e-6)
    assert block.material.specular == 0 and block.material.metallic == 0
    mirror = gltf.load(SCENES / "mirror_glass.glb").triangles
    ball = next(t for t in mirror if t.name == "Mirror ball")
    assert np.linalg.norm(ball.positions - [-1.4, 1.1, -3.8], axis=1) == pytest.approx(1.1, abs=1e-5)
    reflector = gltf.load(SCENES / "reflectors_figure3.glb").triangles
    names = [t.name for t in reflector]
    dish, bulb = (reflector[names.index(f"{kind} green")] for kind in ("Reflector", "Bulb"))
    opening = dish.positions[-64:].mean(axis=0) - dish.positions[0]
    focus = bulb.positions.mean(axis=0) - dish.positions[0]
    assert np.linalg.norm(focus) == pytest.approx(0.2, abs=1e-5)
    assert np.dot(focus, opening) == pytest.approx(0.2 * np.linalg.norm(opening), abs=1e-5)


def test_facet_albedo_known_values() -> None:
    # Seen along the normal, GGX of alpha 1 reflects 1 - ln 2.
    rough = facet_albedo(1.0, columns=17, samples=128)
    assert rough.white[-1] == pytest.approx(1 - math.log(2), abs=2e-4)
    smooth = facet_albedo(1e-3, samples=64)
    assert smooth.average_white == pytest.approx(1, abs=2e-3)
    assert smooth.average_schlick == pytest.approx(1 / 21, rel=0.02)


@pytest.mark.mitsuba
@pytest.mark.parametrize("name", closed_forms.NAMES)
def test_mitsuba_renders_the_closed_forms(name: str, mi: Any) -> None:
    from benchmarks.gltf_to_mitsuba import load_scene
    from benchmarks.reference import render

    width, height = 32, 24
    image = render(load_scene(SCENES / f"{name}.gltf", width, height), 64, 1)
    expected = np.array(closed_forms.expected_image(name, width, height))
    assert image.mean() == pytest.approx(expected.mean(), rel=1e-2)
    if name == "plane_point":
        assert image == pytest.approx(expected, rel=0.05)  # 64 points of a large pixel


@pytest.mark.mitsuba
def test_mitsuba_furnace(mi: Any) -> None:
    from benchmarks.gltf_to_mitsuba import load_scene
    from benchmarks.reference import render

    image = render(load_scene(SCENES / "furnace.gltf", 16, 12), 64, 1)
    assert image.mean() == pytest.approx(closed_forms.furnace_radiance(), rel=5e-3)


@pytest.mark.mitsuba
@pytest.mark.parametrize("material", [{"metallic": 1.0}, {"metallic": 0.0}, {"metallic": 0.5}])
@pytest.mark.parametrize("roughness", [0.3, 1.0])
def test_rough_white_surfaces_lose_no_light(material: dict[str, float], roughness: float, mi: Any) -> None:
    from benchmarks import gltf_to_mitsuba, mitsuba_plugins

    mitsuba_plugins.register()
    white = gltf.Material(color=(1.0, 1.0, 1.0), roughness=roughness, **material)
    bsdf = mi.load_dict(gltf_to_mitsuba.bsdf(white))
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(math.sin(0.9), 0, math.cos(0.9))
    weights = []
    for lobe, u, v in np.random.default_rng(5).random((4000, 3)):
        weights.append(float(bsdf.sample(mi.BSDFContext(), si, float(lobe), mi.Point2f(u, v))[1][0]))
    error = np.std(weights) / math.sqrt(len(weights))
    assert error < 0.02
    assert np.mean(weights) == pytest.approx(1, abs=4 * error)


@pytest.mark.mitsuba
def test_coloured_mirror_follows_schlick(mi: Any) -> None:
    from benchmarks import gltf_to_mitsuba, mitsuba_plugins

    mitsuba_plugins.register()
    bsdf = mi.load_dict(gltf_to_mitsuba.bsdf(gltf.Material(color=(0.9, 0.5, 0.1), roughness=0.0)))
    si = mi.SurfaceInteraction3f()
    for cosine in (1.0, 0.3, -0.3):
        si.wi = mi.Vector3f(math.sqrt(1 - cosine**2), 0, cosine)
        sample, weight = bsdf.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.5, 0.5))
        schlick = [f0 + (1 - f0) * (1 - abs(cosine)) ** 5 for f0 in (0.9, 0.5, 0.1)]
        assert list(weight) == pytest.approx(schlick, rel=1e-5)
        assert list(sample.wo) == pytest.approx([-si.wi[0], 0, cosine], abs=1e-6)
