"""How much two pictures differ: relMSE, ratio of means, and a test block by block whether it is more than noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from benchmarks.exr import Image


def rel_mse(image: Image, reference: Image, reference_variance: Image | None = None) -> float:
    """mean((x - r)^2 / (r^2 + 0.01)); the noise of the reference is taken off where its variance is given."""
    weight = 1 / (reference**2 + 0.01)
    error = (image - reference) ** 2
    if reference_variance is not None:
        error = error - reference_variance
    return float(np.mean(error * weight))


def noise(image: Image, variance: Image) -> float:
    """The relMSE that a picture has by its own noise, from the variance of its pixels."""
    return float(np.mean(variance / (image**2 + 0.01)))


def mean_ratio(image: Image, reference: Image) -> float:
    """Mean of the picture over mean of the reference, all channels together."""
    return float(image.mean() / reference.mean())


def mean_and_variance(images: Sequence[Image]) -> tuple[Image, Image]:
    """The mean of independent pictures, and the variance of that mean in every pixel."""
    if len(images) < 2:
        raise ValueError("the variance needs at least two independent pictures")
    stack = np.stack(images)
    return stack.mean(axis=0), stack.var(axis=0, ddof=1) / len(images)


@dataclass(frozen=True)
class BlockTest:
    """`z[i, j]` of each block, in the channel that is furthest off; chance exceeds `limit` with probability 1 %."""

    z: Image
    difference: Image
    limit: float

    @property
    def passed(self) -> bool:
        return bool(np.abs(self.z).max() <= self.limit)

    def worst(self, count: int = 5) -> list[tuple[int, int, float, float]]:
        """(row, column, z, relative difference) of the blocks with the largest |z|."""
        order = np.argsort(-np.abs(self.z), axis=None)[:count]
        rows, columns = np.unravel_index(order, self.z.shape)
        return [
            (int(i), int(j), float(self.z[i, j]), float(self.difference[i, j]))
            for i, j in zip(rows, columns, strict=True)
        ]


def block_test(
    a: Image, variance_a: Image, b: Image, variance_b: Image, size: int = 8, significance: float = 0.01
) -> BlockTest:
    """Compare the means of `size` x `size` blocks; Sidak's correction for so many tests.

    The pixels' errors must be independent, as a path tracer's are, and many enough for a normal distribution: heavy
    tails (fireflies) give false alarms. Partial blocks at the right and lower edge are left out.
    """
    mean_a, mean_b = _block_means(a, size), _block_means(b, size)
    variance = (_block_means(variance_a, size) + _block_means(variance_b, size)) / size**2
    # Differences below float precision are no evidence, whatever the variance (a furnace has none).
    floor = (1e-5 * np.maximum(np.abs(mean_a), np.abs(mean_b)) + 1e-9) ** 2
    z = (mean_a - mean_b) / np.sqrt(variance + floor)
    relative = (mean_a - mean_b) / np.maximum(np.abs(mean_b), 1e-9)
    channel = np.abs(z).argmax(axis=-1)[..., None]
    tests = z.size
    limit = NormalDist().inv_cdf(0.5 + 0.5 * (1 - significance) ** (1 / tests))
    return BlockTest(
        np.take_along_axis(z, channel, -1)[..., 0], np.take_along_axis(relative, channel, -1)[..., 0], limit
    )


def _block_means(image: Image, size: int) -> Image:
    rows, columns = image.shape[0] // size, image.shape[1] // size
    if rows == 0 or columns == 0:
        raise ValueError(f"the picture is smaller than one block of {size} x {size} pixels")
    whole = image[: rows * size, : columns * size]
    blocks: Image = whole.reshape(rows, size, columns, size, -1).mean(axis=(1, 3))
    return blocks
