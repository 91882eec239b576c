"""What glTF has and Mitsuba has not: Schlick mirrors, the metallic-roughness BSDF, the spot light's falloff.

`register()` must be called after `mi.set_variant(...)`. As Python classes they are fast in the llvm variants, where
they are traced once, and slow in the scalar ones.

Against our runtime: `ln_rough` follows Appendix B of the glTF specification (GGX, height-correlated Smith masking, a
Lambertian base weighted by 1 - F); it does not give back the energy that multiple scattering between microfacets
carries, which our runtime does, so glossy surfaces of our pictures are a little brighter.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi


def register() -> None:
    """Define the plug-ins `ln_mirror`, `ln_rough` and `ln_spot` for the current variant."""

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

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> Any:
            cosine = mi.Frame3f.cos_theta(si.wi)
            active &= cosine != 0
            bs = mi.BSDFSample3f()
            bs.wo = mi.reflect(si.wi)
            bs.pdf = 1.0
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DeltaReflection)
            bs.sampled_component = mi.UInt32(0)
            return bs, schlick(self.f0, 1.0, dr.abs(cosine)) & active

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            return mi.Color3f(0.0)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            return mi.Float(0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            return mi.Color3f(0.0), mi.Float(0.0)

        def to_string(self) -> str:
            return "ln_mirror"

    class Rough(mi.BSDF):  # type: ignore[misc]
        """Metal or coated Lambertian base after glTF 2.0, Appendix B, on both sides."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            color = mi.Color3f(props["color_r"], props["color_g"], props["color_b"])
            metallic = props["metallic"]
            self.albedo = color * (1 - metallic)
            self.f0 = metallic * color + (1 - metallic) * props["f0"]
            self.f90 = metallic + (1 - metallic) * props["f90"]
            self.alpha = props["roughness"] ** 2
            self.diffuse_share = 0.5 * (1 - metallic)
            sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            self.m_components = [mi.BSDFFlags.GlossyReflection | sides, mi.BSDFFlags.DiffuseReflection | sides]
            self.m_flags = self.m_components[0] | self.m_components[1]

        def distribution(self) -> Any:
            return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any) -> Any:
            side = flip_sign(si.wi)
            wi = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side)
            diffuse = sample1 < self.diffuse_share
            m, _ = self.distribution().sample(wi, sample2)
            wo = dr.select(diffuse, mi.warp.square_to_cosine_hemisphere(sample2), mi.reflect(wi, m))
            value, pdf = self.evaluate(wi, wo)
            active &= (wi.z > 0) & (wo.z > 0) & (pdf > 0)
            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(wo.x, wo.y, wo.z * side)
            bs.pdf = pdf
            bs.eta = 1.0
            kinds = mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection
            bs.sampled_type = dr.select(diffuse, mi.UInt32(+kinds[0]), mi.UInt32(+kinds[1]))
            bs.sampled_component = dr.select(diffuse, mi.UInt32(1), mi.UInt32(0))
            return bs, dr.select(active, value / pdf, 0.0)

        def evaluate(self, wi: Any, wo: Any) -> Any:
            """The BSDF times the cosine, and the pdf, for directions on the upper side."""
            h = dr.normalize(wi + wo)
            distribution = self.distribution()
            d = distribution.eval(h)
            a2 = self.alpha**2
            # Height-correlated Smith masking over 4 cos cos: V_GGX of the specification.
            vi = wo.z * dr.sqrt(a2 + (1 - a2) * dr.square(wi.z))
            vo = wi.z * dr.sqrt(a2 + (1 - a2) * dr.square(wo.z))
            visibility = 0.5 / dr.maximum(vi + vo, 1e-20)
            fresnel = schlick(self.f0, self.f90, dr.maximum(dr.dot(wi, h), 0.0))
            # The base is weighted by one number for all channels, as F0 of a dielectric is grey.
            base = self.albedo * (1 - dr.mean(fresnel)) * dr.inv_pi
            valid = (wi.z > 0) & (wo.z > 0)
            value = dr.select(valid, (base + fresnel * d * visibility) * wo.z, 0.0)
            glossy_pdf = distribution.pdf(wi, h) / dr.maximum(4 * dr.dot(wo, h), 1e-20)
            pdf = self.diffuse_share * wo.z * dr.inv_pi + (1 - self.diffuse_share) * glossy_pdf
            return value, dr.select(valid, pdf, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            side = flip_sign(si.wi)
            value, pdf = self.evaluate(
                mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side), mi.Vector3f(wo.x, wo.y, wo.z * side)
            )
            return dr.select(active, value, 0.0), dr.select(active, pdf, 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any) -> Any:
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
            ds.emitter = mi.EmitterPtr(self)
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
