"""Directional albedo of a rough surface after one bounce between its microfacets, by numerical integration.

For GGX with height-correlated Smith masking: E(mu) of white facets, and S(mu), the same with Schlick's weight
(1 - cos)^5 as reflectance. An albedo with F0 and F90 is F0 (E - S) + F90 S. What is missing from E = 1 bounces more
than once (Kulla and Conty, Revisiting physically based shading at Imageworks, 2017).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SCHLICK_AVERAGE = 1 / 21
"""2 * integral over mu of mu (1 - mu)^5."""


@dataclass(frozen=True)
class FacetAlbedo:
    """Values at equal steps of `column(mu)`, and their averages 2 * integral of mu f(mu)."""

    white: Array
    schlick: Array
    average_white: float
    average_schlick: float


def column(mu: Array, alpha: float) -> Array:
    """Rises from 0 to 1 with mu, fast at grazing angles, where the functions vary on the scale of alpha."""
    return np.asarray(0.5 * mu + 0.5 * np.sqrt(mu * (1 + alpha) / (mu + alpha)))


def facet_albedo(alpha: float, columns: int = 129, samples: int = 128) -> FacetAlbedo:
    """Integrates over a grid of `samples`^2 visible normals for each of `columns` cosines."""
    u = np.linspace(0, 1, columns)
    fine = (np.arange(200_000) + 0.5) / 200_000
    at = column(fine, alpha)
    mu = np.interp(u, at, fine)
    mu[-1] = 1.0
    white, schlick = np.array([_integrate(float(m), alpha, samples) for m in mu]).T
    averages = [float(np.mean(2 * fine * np.interp(at, u, values))) for values in (white, schlick)]
    return FacetAlbedo(white, schlick, *averages)


def _integrate(mu: float, alpha: float, samples: int) -> tuple[float, float]:
    """The mean of G2 / G1, and of it times Schlick's weight, over visible normals (Heitz 2018) seen from cosine mu."""
    grid = (np.arange(samples) + 0.5) / samples
    # 1 - t^2 instead of u1 makes the steep edge of the disc of visible normals smooth.
    t, u2 = (a.ravel() for a in np.meshgrid(grid, grid))
    u1, weight = 1 - t * t, 2 * t
    wo = np.array([np.sqrt(1 - mu * mu), 0.0, mu])
    stretched = np.array([alpha * wo[0], 0.0, wo[2]])
    stretched /= np.linalg.norm(stretched)
    r, phi = np.sqrt(u1), 2 * np.pi * u2
    t1, t2 = r * np.cos(phi), r * np.sin(phi)
    s = 0.5 * (1 + stretched[2])
    t2 = (1 - s) * np.sqrt(1 - t1**2) + s * t2
    # The frame about the stretched direction, which lies in the xz plane: t1 along y, t2 across.
    axis = np.array([-stretched[2], 0.0, stretched[0]])
    h = np.outer(t1, [0.0, 1.0, 0.0]) + np.outer(t2, axis)
    h += np.outer(np.sqrt(np.maximum(1 - t1**2 - t2**2, 0)), stretched)
    m = np.stack([alpha * h[:, 0], alpha * h[:, 1], np.maximum(h[:, 2], 0)], axis=1)
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    cosine = m @ wo
    z_i = 2 * cosine * m[:, 2] - mu
    up = z_i > 0
    z_i = np.where(up, z_i, 1.0)

    def reach(z: Array) -> Array:
        return np.asarray(np.sqrt(alpha**2 + (1 - alpha**2) * z * z))

    reach_o, reach_i = reach(np.array(mu)), reach(z_i)
    masking = 2 * mu / (mu + reach_o)
    both = 2 * mu * z_i / (mu * reach_i + z_i * reach_o)
    ratio = np.where(up, weight * both / masking, 0.0)
    return float(ratio.mean()), float((ratio * (1 - cosine) ** 5).mean())
