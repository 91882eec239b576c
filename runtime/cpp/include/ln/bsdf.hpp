#pragma once
// How a surface scatters light: the materials of glTF as one small value, evaluated, sampled and classified by events.
//
// Directions are unit vectors in the shading frame: z is the shading normal on the side of `wo`, so that wo.z > 0 always;
// wi.z < 0 is transmitted. Models, formulas and sources: docs/materials.md. The Lambertian case is inline, all else is
// in bsdf.cpp.

#include "ln/albedo_table.hpp"
#include "ln/math.hpp"
#include "ln/microfacet.hpp"

namespace ln {

/// Scattering events of a light path, as a set: D diffuse, G glossy, S ideal specular.
enum class Events : std::uint8_t { none = 0, D = 1, G = 2, DG = 3, S = 4, all = 7 };
constexpr Events operator&(Events a, Events b) {
  return static_cast<Events>(static_cast<unsigned>(a) & static_cast<unsigned>(b));
}
constexpr Events operator|(Events a, Events b) {
  return static_cast<Events>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}
constexpr bool any(Events e) { return e != Events::none; }

/// What is carried along the ray: `radiance` (traced from the eye) is scaled by 1/eta^2 where it is refracted, `flux` (traced
/// from a light) is not.
enum class Carried : std::uint8_t { radiance, flux };

class DielectricTable;

/// The values of a glTF material at a point, after textures. Values outside their ranges are clamped, NaN counts as 0.
struct BsdfParameters {
  Color base_color{1};
  float metallic = 0, roughness = 1;
  float specular = 1;  // KHR_materials_specular
  Color specular_color{1};
  float ior = 1.5f;        // KHR_materials_ior; 0: infinite
  float transmission = 0;  // KHR_materials_transmission
  bool solid = false;      // KHR_materials_volume: the surface bounds a solid; otherwise it is a thin wall
};

struct BsdfSample {
  Vec3 wi{0};
  float pdf_w = 0;              // density of all smooth lobes of the mask together; 0: an ideal specular direction
  Color weight{0};              // BSDF * |cos(wi)| / pdf_w, of an S lobe: its value over its selection probability
  Events event = Events::none;  // kind of the lobe that was picked
};

struct BsdfValue {
  Color f_cos{0};
  float pdf_w = 0;
};

class Bsdf {
 public:
  /// Black.
  Bsdf() = default;

  /// `outside`: wo is on the outer (front) side of a solid. `table`: for rough solids, made for `ior`; it must outlive
  /// the BSDF. Without it they lose the light that bounces more than once between microfacets.
  Bsdf(const BsdfParameters& parameters, bool outside, const DielectricTable* table = nullptr);

  static Bsdf lambertian(const Color& albedo) {
    Bsdf b;
    if (is_black(albedo)) return b;
    b.kind_ = Kind::lambert;
    b.events_ = Events::D;
    b.diffuse_ = albedo * kInvPi;
    return b;
  }

  /// The kinds of lobes that exist, whatever wo.
  Events events() const { return events_; }

  /// Radiance where wo is over what it was outside: n^2 within a solid of index n > 1.
  float concentration() const { return eta_ < 1 ? 1 / sqr(eta_) : 1; }

  /// Is it Lambertian, black included? So it is where the scene has no event but D.
  bool is_lambertian() const { return kind_ == Kind::lambert || !any(events_); }

  /// Is there no choice between lobes, so that `sample` does not use its first number?
  bool single_lobe() const { return kind_ != Kind::layered; }

  /// Can smooth lobes send light through the surface?
  bool transmits_smoothly() const { return wall_ != Wall::opaque && rough_ && any(events_ & Events::G); }

  /// BSDF times |cos(wi)| of the smooth lobes (D, G) in the mask.
  Color f_cos(const Vec3& wo, const Vec3& wi, Events mask = Events::all, Carried carried = Carried::radiance) const {
    if (kind_ == Kind::lambert) return any(mask & Events::D) && wi.z > 0 ? diffuse_ * wi.z : Color(0);
    if (!any(mask & events_ & Events::DG)) return Color(0);
    return layered_f_cos(wo, wi, mask, carried);
  }

  /// Density per solid angle with which `sample(wo, ..., mask)` yields `wi` from a smooth lobe; where S lobes are in the
  /// mask, they take their share of the probability.
  float pdf_w(const Vec3& wo, const Vec3& wi, Events mask = Events::all) const {
    if (kind_ == Kind::lambert) return any(mask & Events::D) && wi.z > 0 ? wi.z * kInvPi : 0.0f;
    if (!any(mask & events_ & Events::DG)) return 0;
    return layered_pdf_w(wo, wi, mask);
  }

  /// Both at once, which costs little more than one of them.
  BsdfValue evaluate(const Vec3& wo, const Vec3& wi, Events mask = Events::all, Carried carried = Carried::radiance) const {
    if (kind_ == Kind::lambert) return {f_cos(wo, wi, mask), pdf_w(wo, wi, mask)};
    if (!any(mask & events_ & Events::DG)) return {};
    return layered_evaluate(wo, wi, mask, carried);
  }

  /// Samples a direction from the lobes in the mask. False: the light is absorbed.
  bool sample(const Vec3& wo, float u_lobe, const Vec2& u, Events mask, Carried carried, BsdfSample& sample) const {
    if (kind_ == Kind::lambert) {
      if (!any(mask & Events::D)) return false;
      sample.wi = sample_cosine(u);
      sample.pdf_w = sample.wi.z * kInvPi;
      sample.weight = diffuse_ * kPi;
      sample.event = Events::D;
      return true;
    }
    if (!any(mask & events_)) return false;
    return layered_sample(wo, u_lobe, u, mask, carried, sample);
  }

  /// Directional-hemispherical reflectance of the diffuse lobe.
  Color diffuse_reflectance(const Vec3& wo) const {
    if (kind_ == Kind::lambert) return diffuse_ * kPi;
    if (!any(events_ & Events::D)) return Color(0);
    return layered_diffuse_reflectance(wo);
  }

  /// Share of flux arriving from wo that the lobes in the mask scatter. Exact to the tables' 0.1 %, but for tinted or
  /// coated rough transmission, where it is an estimate.
  Color albedo(const Vec3& wo, Events mask = Events::all) const {
    if (kind_ == Kind::lambert) return any(mask & Events::D) ? diffuse_ * kPi : Color(0);
    if (!any(mask & events_)) return Color(0);
    return layered_albedo(wo, mask);
  }

 private:
  enum class Kind : std::uint8_t { black, lambert, layered };
  enum class Wall : std::uint8_t { opaque, thin, solid };
  struct Interface;
  struct View;

  Color layered_f_cos(const Vec3& wo, const Vec3& wi, Events mask, Carried carried) const;
  float layered_pdf_w(const Vec3& wo, const Vec3& wi, Events mask) const;
  BsdfValue layered_evaluate(const Vec3& wo, const Vec3& wi, Events mask, Carried carried) const;
  bool layered_sample(const Vec3& wo, float u_lobe, const Vec2& u, Events mask, Carried carried, BsdfSample& sample) const;
  Color layered_diffuse_reflectance(const Vec3& wo) const;
  Color layered_albedo(const Vec3& wo, Events mask) const;

  template <bool kValue, bool kDensity>
  BsdfValue evaluate_smooth(const View& view, const Vec3& wo, const Vec3& wi, Events mask, Carried carried) const;
  View view(const Vec3& wo, Events mask) const;
  Interface at_interface(float cosine, float eta) const;
  FacetAlbedo facets(float cosine) const;
  Color below_layer(const FacetAlbedo& facets) const;
  Color solid_deficit(float cosine, bool side_of_wo) const;

  Kind kind_ = Kind::black;
  Events events_ = Events::none;
  Wall wall_ = Wall::opaque;
  bool rough_ = false;
  bool outside_ = true;
  Color diffuse_{0};  // Lambertian: albedo / pi; else share * albedo / (pi (1 - average albedo of the layer above))
  Color base_{0};     // share * albedo of the diffuse base
  float alpha_ = 0;
  albedo_table::Row row_;
  // The specular layer above the diffuse base: Schlick's Fresnel, and what returns after several bounces, per deficit.
  Color layer_f0_{0}, layer_multiple_{0};
  float layer_f90_ = 0;
  // All reflection from opaque facets, metal and dielectric by their shares.
  Color facet_f0_{0}, multiple_up_{0};
  float facet_f90_ = 0;
  float multiple_norm_ = 0;  // 1 / (pi average deficit)
  // Transmission.
  float transmission_ = 0;    // share
  float ior_ = 1;             // index inside over the index outside
  float eta_ = 1;             // index on the other side over the index on the side of wo; thin: as from outside
  Color tint_{0};             // share * base colour
  Color coating_{1};          // factor of the dielectric's reflectance (KHR_materials_specular)
  Color multiple_down_{0};    // transmitted after several bounces; thin: per deficit; solid: per deficit at wo and at wi
  Color solid_up_{0};         // solid: reflected after several bounces, per deficit at wo and at wi
  float solid_up_share_ = 0;  // of what bounces several times
  const DielectricTable* table_ = nullptr;
};

}  // namespace ln
