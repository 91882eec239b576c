"""Read and write OpenEXR pictures as numpy arrays, and show them:

    python -m benchmarks.exr IN.exr OUT.png [--exposure STOPS]

Reads single-part scan-line files, uncompressed or zipped, without any library: that is what our programs write. Other
files are handed to Mitsuba where it is installed.
"""

from __future__ import annotations

import argparse
import os
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float64]
"""Height x width x channels, top row first."""

MAGIC = 20000630
PIXEL_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
NO_COMPRESSION, ZIP_LINE, ZIP_BLOCK = 0, 2, 3
LINES_PER_BLOCK = {NO_COMPRESSION: 1, ZIP_LINE: 1, ZIP_BLOCK: 16}


class ExrError(ValueError):
    """The file is not one that this module reads."""


def read(path: str | os.PathLike[str], layer: str = "") -> Image:
    """The channels R, G, B of a picture, or `layer.R`, `layer.G`, `layer.B`, as height x width x 3."""
    channels = read_channels(path)
    prefix = f"{layer}." if layer else ""
    try:
        return np.stack([channels[prefix + c] for c in "RGB"], axis=-1).astype(np.float64)
    except KeyError as missing:
        raise ExrError(f"{path}: no channel {missing}; there are {', '.join(channels)}") from None


def read_channels(path: str | os.PathLike[str]) -> dict[str, NDArray[np.float32]]:
    """Every channel of a picture by its name, height x width."""
    data = Path(path).read_bytes()
    if len(data) < 8 or struct.unpack_from("<I", data)[0] != MAGIC:
        raise ExrError(f"{path}: not an OpenEXR file")
    if struct.unpack_from("<I", data, 4)[0] & 0x1A00:  # tiles, deep data or several parts
        return _read_with_mitsuba(path)
    attributes, position = _attributes(data, 8)
    compression = attributes["compression"][0]
    if compression not in LINES_PER_BLOCK:
        return _read_with_mitsuba(path)
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    channels = _channel_list(attributes["channels"])
    image = {name: np.zeros((height, width), np.float32) for name, _ in channels}
    lines = LINES_PER_BLOCK[compression]
    blocks = (height + lines - 1) // lines
    for offset in struct.unpack_from(f"<{blocks}Q", data, position):
        y, size = struct.unpack_from("<2i", data, offset)
        count = min(lines, y1 + 1 - y)
        line_size = width * sum(kind.itemsize for _, kind in channels)
        content = data[offset + 8 : offset + 8 + size]
        if compression != NO_COMPRESSION and size < count * line_size:
            content = _unzip(content)
        if len(content) != count * line_size:
            raise ExrError(f"{path}: scan lines from {y}: {len(content)} bytes instead of {count * line_size}")
        start = 0
        for line in range(y - y0, y - y0 + count):
            for name, kind in channels:
                image[name][line] = np.frombuffer(content, kind, width, start)
                start += width * kind.itemsize
    return image


def write(path: str | os.PathLike[str], image: Image, layers: Mapping[str, Image] | None = None) -> None:
    """Write R, G, B and named RGB layers as 32-bit floats, zipped; renamed into place when complete."""
    channels = {c: image[..., i] for i, c in enumerate("RGB")}
    for layer, values in (layers or {}).items():
        channels |= {f"{layer}.{c}": values[..., i] for i, c in enumerate("RGB")}
    height, width = image.shape[:2]
    names = sorted(channels)
    listing = b"".join(n.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for n in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<II", MAGIC, 2)
    for name, kind, value in (
        ("channels", "chlist", listing),
        ("compression", "compression", bytes([ZIP_BLOCK])),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ):
        header += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    planes = np.stack([channels[n] for n in names], axis=1).astype("<f4")  # height x channels x width
    lines = LINES_PER_BLOCK[ZIP_BLOCK]
    blocks = []
    for y in range(0, height, lines):
        raw = planes[y : y + lines].tobytes()
        packed = _zip(raw)
        content = packed if len(packed) < len(raw) else raw
        blocks.append(struct.pack("<2i", y, len(content)) + content)
    starts = np.cumsum([len(header) + 8 * len(blocks), *(len(b) for b in blocks)])[:-1]
    unfinished = Path(f"{os.fspath(path)}.part")
    unfinished.write_bytes(header + starts.astype("<u8").tobytes() + b"".join(blocks))
    unfinished.replace(path)


def _attributes(data: bytes, position: int) -> tuple[dict[str, bytes], int]:
    attributes = {}
    while data[position] != 0:
        name_end = data.index(0, position)
        kind_end = data.index(0, name_end + 1)
        (size,) = struct.unpack_from("<i", data, kind_end + 1)
        attributes[data[position:name_end].decode()] = data[kind_end + 5 : kind_end + 5 + size]
        position = kind_end + 5 + size
    return attributes, position + 1


def _channel_list(data: bytes) -> list[tuple[str, np.dtype[np.generic]]]:
    channels = []
    position = 0
    while data[position] != 0:
        end = data.index(0, position)
        kind, _, x_step, y_step = struct.unpack_from("<iB3xii", data, end + 1)
        if (x_step, y_step) != (1, 1):
            raise ExrError("a subsampled channel")
        channels.append((data[position:end].decode(), PIXEL_TYPES[kind]))
        position = end + 17
    return channels


def _unzip(content: bytes) -> bytes:
    """Undo zlib, the difference of neighbouring bytes, and the sorting into even and odd bytes."""
    delta = np.frombuffer(zlib.decompress(content), np.uint8).astype(np.int64)
    delta[1:] -= 128
    summed = np.cumsum(delta).astype(np.uint8)
    half = (len(summed) + 1) // 2
    result = np.empty_like(summed)
    result[0::2], result[1::2] = summed[:half], summed[half:]
    return result.tobytes()


def _zip(content: bytes) -> bytes:
    values = np.frombuffer(content, np.uint8)
    ordered = np.concatenate([values[0::2], values[1::2]]).astype(np.int64)
    delta = ordered.copy()
    delta[1:] += 128 - ordered[:-1]
    return zlib.compress(delta.astype(np.uint8).tobytes())


def _read_with_mitsuba(path: str | os.PathLike[str]) -> dict[str, NDArray[np.float32]]:
    try:
        import mitsuba as mi
    except ImportError:
        raise ExrError(f"{path}: tiled, deep, or packed in another way than zip; install mitsuba to read it") from None
    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    bitmap = mi.Bitmap(os.fspath(path)).convert(component_format=mi.Struct.Type.Float32)
    values = np.array(bitmap, copy=False)
    return {field.name: values[..., i] for i, field in enumerate(bitmap.struct_())}


# ---- showing ----


def tone_mapped(image: Image, exposure: float = 0.0) -> NDArray[np.uint8]:
    """sRGB bytes of a scene-linear picture, brightened by `exposure` stops and clipped."""
    linear = np.clip(np.nan_to_num(image) * 2.0**exposure, 0, 1)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * srgb).astype(np.uint8)


def write_png(path: str | os.PathLike[str], pixels: NDArray[np.uint8]) -> None:
    """Write height x width x 3 bytes."""
    height, width = pixels.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    Path(path).write_bytes(data)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exr", description="Show an EXR picture as a PNG.")
    parser.add_argument("input")
    parser.add_argument("output")
    parser.add_argument("--exposure", type=float, default=0.0, help="stops, default 0")
    parser.add_argument("--layer", default="", help="a layer instead of the picture")
    options = parser.parse_args()
    write_png(options.output, tone_mapped(read(options.input, options.layer), options.exposure))


if __name__ == "__main__":
    main()
