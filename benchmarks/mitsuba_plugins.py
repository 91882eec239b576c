"""What glTF has and Mitsuba has not: Schlick mirrors, the metallic-roughness BSDF, the spot light's falloff.

`register()` must be called after `mi.set_variant(...)`. As Python classes they are fast in the llvm variants, where
they are traced once, and slow in the scalar ones.

`ln_rough` is the runtime's model, written again from its formulas with tables of its own: GGX with height-correlated
Smith masking and Schlick's Fresnel (glTF 2.0, Appendix B), plus the light that bounces several times between
microfacets (Kulla and Conty), above a Lambertian base that gets what this layer lets through, both ways.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi

from benchmarks.facet_albedo import SCHLICK_AVERAGE, facet_albedo


def register() -> None:
    """Define the plug-ins `ln_mirror`, `ln_rough` and `ln_spot` for the current variant."""
    is_vectorized = not mi.variant().startswith("scalar")

    def schlick(f0: Any, f90: float, cosine: Any) -> Any:
        return f0 + (f90 - f0) * dr.square(dr.square(1 - cosine)) * (1 - cosine)

    def flip_sign(wi: Any) -> Any:
        return dr.select(mi.Frame3f.cos_theta(wi) < 0, -1.0, 1.0)

    class Mirror(mi.BSDF):  # type: ignore[misc]
        """An ideal mirror on both sides whose Fresnel term is Schlick's with F0 = `f0`, F90 = 1."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.f0 = mi.Color3f(props["f0_r"], props["f0_g"], props["f0_b"])
            self.m_components = [mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            cosine = mi.Frame3f.cos_theta(si.wi)
            active &= cosine != 0
            bs = mi.BSDFSample3f()
            bs.wo = mi.reflect(si.wi)
            bs.pdf = 1.0
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DeltaReflection)
            bs.sampled_component = mi.UInt32(0)
            return bs, schlick(self.f0, 1.0, dr.abs(cosine)) & active

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0), mi.Float(0.0)

        def to_string(self) -> str:
            return "ln_mirror"

    class Rough(mi.BSDF):  # type: ignore[misc]
        """Metal, or a rough clear coat on a Lambertian base, on both sides; no light is lost between microfacets."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            color = mi.Color3f(props["color_r"], props["color_g"], props["color_b"])
            metallic = props["metallic"]
            coat_f0, coat_f90 = props["f0"], props["f90"]
            self.f0 = metallic * color + (1 - metallic) * coat_f0
            self.f90 = metallic + (1 - metallic) * coat_f90
            self.coat_f0, self.coat_f90 = coat_f0, coat_f90
            self.alpha = props["roughness"] ** 2
            table = facet_albedo(self.alpha)
            self.white = mi.Float(table.white) if is_vectorized else table.white
            self.schlick = mi.Float(table.schlick) if is_vectorized else table.schlick
            self.columns = len(table.white)
            e = table.average_white

            # Kulla and Conty 2017: the missing light, with the reflectances of two and more bounces.
            def several_bounces(f0: Any, f90: float) -> Any:
                f = f0 + (f90 - f0) * SCHLICK_AVERAGE
                return f * f * e / (1 - f * (1 - e))

            self.coat_multiple = several_bounces(coat_f0, coat_f90)
            multiple = metallic * several_bounces(color, 1.0) + (1 - metallic) * self.coat_multiple
            self.multiple = multiple / (math.pi * (1 - e))
            entering = 1 - self.coat_albedo(e, table.average_schlick)
            self.base = color * ((1 - metallic) / (math.pi * entering))
            self.cosine_share = 0.1 + 0.4 * (1 - metallic)
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [mi.BSDFFlags.GlossyReflection | sides, mi.BSDFFlags.DiffuseReflection | sides]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def coat_albedo(self, white: Any, schlick: Any) -> Any:
            return self.coat_f0 * (white - schlick) + self.coat_f90 * schlick + self.coat_multiple * (1 - white)

        def facets(self, mu: Any) -> tuple[Any, Any]:
            """E and S at the cosine `mu`, from the tables."""
            x = (0.5 * mu + 0.5 * dr.sqrt(mu * (1 + self.alpha) / (mu + self.alpha))) * (self.columns - 1)
            i = dr.clip(dr.floor(x), 0, self.columns - 2)
            t = x - i
            i = mi.UInt32(i)

            def at(table: Any, index: Any) -> Any:
                return dr.gather(mi.Float, table, index) if is_vectorized else float(table[index])

            return tuple(dr.lerp(at(v, i), at(v, i + 1), t) for v in (self.white, self.schlick))

        def distribution(self) -> Any:
            return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            side = flip_sign(si.wi)
            wi = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side)
            cosine = sample1 < self.cosine_share
            m, _ = self.distribution().sample(wi, sample2)
            wo = dr.select(cosine, mi.warp.square_to_cosine_hemisphere(sample2), mi.reflect(wi, mi.Normal3f(m)))
            value, pdf = self.evaluate(wi, wo)
            active &= (wi.z > 0) & (wo.z > 0) & (pdf > 0)
            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(wo.x, wo.y, wo.z * side)
            bs.pdf = pdf
            bs.eta = 1.0
            kinds = mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection
            bs.sampled_type = dr.select(cosine, mi.UInt32(+kinds[0]), mi.UInt32(+kinds[1]))
            bs.sampled_component = dr.select(cosine, mi.UInt32(1), mi.UInt32(0))
            return bs, dr.select(active, value / dr.maximum(pdf, 1e-20), 0.0)

        def evaluate(self, wi: Any, wo: Any) -> Any:
            """The BSDF times the cosine, and the pdf, for directions on the upper side."""
            valid = (wi.z > 0) & (wo.z > 0)
            h = dr.normalize(wi + wo)
            distribution = self.distribution()
            a2 = self.alpha**2
            # Height-correlated Smith masking over 4 cos cos: V_GGX of the glTF specification.
            vi = wo.z * dr.sqrt(a2 + (1 - a2) * dr.square(wi.z))
            vo = wi.z * dr.sqrt(a2 + (1 - a2) * dr.square(wo.z))
            fresnel = schlick(self.f0, self.f90, dr.clip(dr.dot(wi, h), 0.0, 1.0))
            facet = fresnel * (distribution.eval(h) * 0.5 / dr.maximum(vi + vo, 1e-20))
            white_i, schlick_i = self.facets(dr.clip(wi.z, 1e-6, 1.0))
            white_o, schlick_o = self.facets(dr.clip(wo.z, 1e-6, 1.0))
            multiple = self.multiple * ((1 - white_i) * (1 - white_o))
            below = (1 - self.coat_albedo(white_i, schlick_i)) * (1 - self.coat_albedo(white_o, schlick_o))
            value = dr.select(valid, (facet + multiple + self.base * below) * wo.z, 0.0)
            glossy_pdf = distribution.pdf(wi, h) / dr.maximum(4 * dr.dot(wo, h), 1e-20)
            pdf = self.cosine_share * wo.z * dr.inv_pi + (1 - self.cosine_share) * glossy_pdf
            return value, dr.select(valid, pdf, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            side = flip_sign(si.wi)
            value, pdf = self.evaluate(
                mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side), mi.Vector3f(wo.x, wo.y, wo.z * side)
            )
            return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def to_string(self) -> str:
            return "ln_rough"

    class Spot(mi.Emitter):  # type: ignore[misc]
        """A point light along +z of `to_world` with the falloff of KHR_lights_punctual's reference code."""

        def __init__(self, props: Any) -> None:
            mi.Emitter.__init__(self, props)
            self.intensity = mi.Color3f(props["intensity_r"], props["intensity_g"], props["intensity_b"])
            self.position = mi.Point3f(props["x"], props["y"], props["z"])
            self.direction = mi.Vector3f(props["dx"], props["dy"], props["dz"])
            inner, outer = props["inner"], props["outer"]
            self.scale = 1 / max(0.001, math.cos(inner) - math.cos(outer))
            self.offset = -math.cos(outer) * self.scale
            self.m_flags = mi.EmitterFlags.DeltaPosition

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds = mi.DirectionSample3f()
            ds.p = self.position
            ds.n = mi.Normal3f(0.0)
            ds.uv = mi.Point2f(0.0)
            ds.time = it.time
            ds.pdf = 1.0
            ds.delta = mi.Bool(True)
            ds.emitter = mi.EmitterPtr(self) if is_vectorized else self
            ds.d = ds.p - it.p
            squared = dr.squared_norm(ds.d)
            ds.dist = dr.sqrt(squared)
            ds.d /= ds.dist
            falloff = dr.square(dr.clip(dr.dot(self.direction, -ds.d) * self.scale + self.offset, 0.0, 1.0))
            return ds, self.intensity * (falloff / squared) & active

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0.0)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(0.0)

        def bbox(self) -> Any:
            return mi.BoundingBox3f(self.position)

        def to_string(self) -> str:
            return "ln_spot"

    mi.register_bsdf("ln_mirror", Mirror)
    mi.register_bsdf("ln_rough", Rough)
    mi.register_emitter("ln_spot", Spot)
