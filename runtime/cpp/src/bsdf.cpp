#include "ln/bsdf.hpp"

#include "ln/dielectric_table.hpp"
#include "ln/fresnel.hpp"

namespace ln {

namespace {

/// Rough refraction needs a bend: without any, microfacets of any slope leave the light as it is.
constexpr float kMinBend = 1.01f;
constexpr float kMaxIor = 1e3f;

float unit(float x) { return std::min(std::max(0.0f, x), 1.0f); }
Color unit(const Color& c) { return {unit(c.x), unit(c.y), unit(c.z)}; }
Color least(const Color& c, float x) { return {std::min(c.x, x), std::min(c.y, x), std::min(c.z, x)}; }
Color positive(const Color& c) { return {std::max(c.x, 0.0f), std::max(c.y, 0.0f), std::max(c.z, 0.0f)}; }

/// Share of the light missing after one bounce that facets of average reflectance `f` return after several, if white ones
/// reflect `e` on average at the first (Kulla and Conty 2017, with one more f for the second bounce as Hill 2018).
Color multiple_share(const Color& f, float e) { return f * f * e / (1.0f - f * (1 - e)); }

}  // namespace

/// Directions for light that bounced several times: what is missing after one bounce is about 1 / (1 + (mu / alpha)^2).
struct Grazing {
  float alpha2, log_ratio;
  explicit Grazing(float alpha) : alpha2(alpha * alpha), log_ratio(std::log(1 + 1 / alpha2)) {}

  Vec3 sample(const Vec2& u) const {
    const float z2 = std::min(alpha2 * (std::exp(u.x * log_ratio) - 1), 1.0f);
    const Vec2 c = unit_circle(u.y) * std::sqrt(1 - z2);
    return {c.x, c.y, std::sqrt(z2)};
  }
  float pdf_w(float z) const { return z * kInvPi / ((z * z + alpha2) * log_ratio); }
};

/// What the transmissive surface does to light that meets it under one cosine.
struct Bsdf::Interface {
  Color reflected;    // times share
  Color transmitted;  // times share and tint
  float cos_t;

  /// Probability of following the reflection, `facet` being what opaque facets add to it.
  float reflection_probability(const Color& facet) const {
    const float up = mean_component(facet + reflected), down = mean_component(transmitted);
    return down > 0 ? up / (up + down) : 1;
  }
};

/// What depends on wo alone: albedos, and the probabilities of the lobes in the mask.
struct Bsdf::View {
  FacetAlbedo facets;
  Color below{0};  // share that the specular layer lets through to the diffuse base
  Color solid_deficit{0};
  float reach = 0;  // Ggx::reach(wo.z)
  float cap_share = 1;
  // Their sum is 1, or 0 where nothing scatters.
  float p_diffuse = 0, p_facet = 0, p_multiple_up = 0, p_multiple_down = 0;
};

Bsdf::Bsdf(const BsdfParameters& p, bool outside, const DielectricTable* table) {
  const Color base = unit(p.base_color);
  const float metallic = unit(p.metallic), transmission = unit(p.transmission), specular = unit(p.specular);
  if (metallic == 0 && transmission == 0 && specular == 0) {
    *this = lambertian(base);
    return;
  }
  const float roughness = unit(p.roughness);
  const float ior = p.ior > 0 ? std::min(p.ior, kMaxIor) : 0;
  const float metal = metallic, opaque = (1 - metallic) * (1 - transmission);
  rough_ = roughness >= kMinRoughness;
  outside_ = outside;

  const Color specular_color = positive(p.specular_color);
  const Color dielectric_f0 = least(normal_reflectance(ior) * specular_color, 1) * specular;
  facet_f0_ = metal * base + opaque * dielectric_f0;
  facet_f90_ = metal + opaque * specular;
  layer_f0_ = dielectric_f0;
  layer_f90_ = specular;

  // Bounces between microfacets.
  FacetAlbedo average{0, kSchlickAverage};
  if (rough_) {
    alpha_ = roughness * roughness;
    row_ = albedo_table::Row(roughness);
    average = albedo_table::facets_average(roughness);
    const float e = 1 - average.deficit;
    const auto schlick_average = [](const Color& f0, float f90) { return f0 + (f90 - f0) * kSchlickAverage; };
    layer_multiple_ = multiple_share(schlick_average(dielectric_f0, specular), e);
    multiple_up_ = metal * multiple_share(schlick_average(base, 1), e) + opaque * layer_multiple_;
    multiple_norm_ = kInvPi / average.deficit;
  }

  // The diffuse base gets what the layer lets through.
  const Color entering = below_layer(average);
  for (int c = 0; c < 3; c++) {
    base_[c] = entering[c] > 1e-6f ? opaque * base[c] : 0;
    diffuse_[c] = base_[c] > 0 ? base_[c] * kInvPi / entering[c] : 0;
  }

  transmission_ = (1 - metallic) * transmission;
  if (transmission_ > 0 && ior == 0) {
    // Nothing enters: what the interface does not reflect is lost.
    facet_f0_ += transmission_ * dielectric_f0;
    facet_f90_ += transmission_ * specular;
    multiple_up_ += transmission_ * layer_multiple_;
    transmission_ = 0;
  }
  if (transmission_ > 0) {
    wall_ = p.solid ? Wall::solid : Wall::thin;
    tint_ = transmission_ * base;
    ior_ = ior;
    coating_ = unit(specular * specular_color);
    if (wall_ == Wall::solid) {
      if (rough_ && ior_ > 1 / kMinBend && ior_ < kMinBend) ior_ = ior_ < 1 ? 1 / kMinBend : kMinBend;
      const float n2 = ior_ * ior_;
      const float front_average = ior_ > 1 ? fresnel_average(ior_) : 1 - (1 - fresnel_average(1 / ior_)) * n2;
      table_ = rough_ ? table : nullptr;
      if (table_) {
        // Reciprocity ties the two directions: (share transmitted * average deficit * index^2) must be the same from
        // both sides. The least of the bounds keeps both shares below 1.
        const Vec2 front = table_->average(true, roughness), back = table_->average(false, roughness);
        for (int c = 0; c < 3; c++) {
          const float k = coating_[c];
          const float a = std::max(front.x + k * (front.y - front.x), 1e-12f),
                      b = std::max(back.x + k * (back.y - back.x), 1e-12f);
          const float crossing = (1 - k * front_average) * std::min({a, b, n2 * b});
          const float down = outside ? crossing / a : crossing / (n2 * b);
          solid_up_[c] = transmission_ * (1 - down) * kInvPi / (outside ? a : b);
          multiple_down_[c] = tint_[c] * down * kInvPi / (outside ? b : a);
          solid_up_share_ += (1 - down) / 3;
        }
      }
    } else if (rough_) {
      const Color returned = slab_reflectance(coating_ * fresnel_average(std::max(ior_, 1.0f)));
      multiple_up_ += transmission_ * returned;
      multiple_down_ = tint_ * (1.0f - returned);
    }
    eta_ = wall_ == Wall::thin || outside ? ior_ : 1 / ior_;
  }

  if (!is_black(diffuse_)) events_ = events_ | Events::D;
  if (!is_black(facet_f0_) || facet_f90_ > 0 || transmission_ > 0) events_ = events_ | (rough_ ? Events::G : Events::S);
  kind_ = any(events_) ? Kind::layered : Kind::black;
}

FacetAlbedo Bsdf::facets(float cosine) const {
  return rough_ ? albedo_table::facets(row_, alpha_, cosine) : FacetAlbedo{0, schlick_weight(cosine)};
}

Color Bsdf::below_layer(const FacetAlbedo& f) const {
  return positive(1.0f - (layer_f0_ * (1 - f.deficit - f.schlick) + layer_f90_ * f.schlick + layer_multiple_ * f.deficit));
}

Color Bsdf::solid_deficit(float cosine, bool side_of_wo) const {
  const Vec2 d = table_->deficit(side_of_wo == outside_, std::sqrt(alpha_), cosine);
  return d.x + coating_ * (d.y - d.x);
}

Bsdf::Interface Bsdf::at_interface(float cosine, float eta) const {
  if (wall_ == Wall::opaque) return {Color(0), Color(0), 0};
  const Fresnel fresnel = fresnel_dielectric(cosine, eta);
  // A coating reduces the reflection of an interface that transmits; it cannot undo total internal reflection.
  const bool total = fresnel.transmittance == 0;
  Color r = total ? Color(1) : coating_ * fresnel.reflectance;
  Color t = total ? Color(0) : fresnel.transmittance + (1.0f - coating_) * fresnel.reflectance;
  if (wall_ == Wall::thin) r = slab_reflectance(r), t = slab_transmittance(t);
  return {transmission_ * r, tint_ * t, fresnel.cos_t};
}

Bsdf::View Bsdf::view(const Vec3& wo, Events mask) const {
  View v;
  v.facets = facets(wo.z);
  v.below = below_layer(v.facets);
  float diffuse = 0, facet = 0, up = 0, down = 0;
  if (any(mask & events_ & Events::D)) diffuse = mean_component(base_ * v.below);
  if (any(mask & events_ & (Events::G | Events::S))) {
    const FacetAlbedo& f = v.facets;
    facet = mean_component(facet_f0_) * (1 - f.deficit - f.schlick) + facet_f90_ * f.schlick;
    if (wall_ != Wall::opaque) {
      const Interface i = at_interface(wo.z, eta_);
      facet += mean_component(i.reflected + i.transmitted);
    }
    if (rough_) {
      const Ggx ggx(alpha_);
      v.reach = ggx.reach(wo.z);
      if (wall_ == Wall::opaque) v.cap_share = ggx.cap_share(wo);
      up = mean_component(multiple_up_) * f.deficit;
      if (wall_ == Wall::thin) down = mean_component(multiple_down_) * f.deficit;
      if (table_) {
        v.solid_deficit = solid_deficit(wo.z, true);
        const float d = mean_component(v.solid_deficit);
        up += transmission_ * solid_up_share_ * d;
        down = mean_component(tint_) * (1 - solid_up_share_) * d;
      }
    }
  }
  const float sum = diffuse + facet + up + down;
  if (sum > 0) {
    v.p_diffuse = diffuse / sum;
    v.p_facet = facet / sum;
    v.p_multiple_up = up / sum;
    v.p_multiple_down = down / sum;
  }
  return v;
}

template <bool kValue, bool kDensity>
BsdfValue Bsdf::evaluate_smooth(const View& v, const Vec3& wo, const Vec3& wi, Events mask, Carried carried) const {
  BsdfValue result;
  const bool glossy = rough_ && any(mask & Events::G);
  if (wi.z > 0) {
    const FacetAlbedo at_wi = kValue ? facets(wi.z) : FacetAlbedo{};
    if (any(mask & events_ & Events::D)) {
      if (kValue) result.f_cos += diffuse_ * v.below * below_layer(at_wi) * wi.z;
      if (kDensity) result.pdf_w += v.p_diffuse * wi.z * kInvPi;
    }
    if (!glossy) return result;

    const Ggx ggx(alpha_);
    const Vec3 h = wo + wi;
    const float om = 0.5f * glm::length(h);  // = wo.h / |h|, but the same for wo and wi exchanged
    const float density = ggx.density(h);
    const Interface interface = at_interface(om, eta_);
    const Color facet = facet_f0_ + (facet_f90_ - facet_f0_) * schlick_weight(om);
    if (kValue) {
      result.f_cos += (facet + interface.reflected) * (density * Ggx::visibility(wo.z, v.reach, wi.z, ggx.reach(wi.z)) * wi.z);
      result.f_cos += multiple_up_ * (multiple_norm_ * v.facets.deficit * at_wi.deficit * wi.z);
      if (table_) result.f_cos += solid_up_ * v.solid_deficit * solid_deficit(wi.z, true) * wi.z;
    }
    if (kDensity) {
      const float p = v.p_facet * interface.reflection_probability(facet);
      result.pdf_w +=
          p * density * Ggx::reflection_pdf(wo.z, v.reach, v.cap_share) + v.p_multiple_up * Grazing(alpha_).pdf_w(wi.z);
    }
    return result;
  }

  if (!glossy || wall_ == Wall::opaque || !(wi.z < 0)) return result;
  const Ggx ggx(alpha_);
  const float z_i = -wi.z;
  if (wall_ == Wall::thin) {
    // A reflection whose direction passes to the other side.
    const Vec3 h = wo + Vec3(wi.x, wi.y, z_i);
    const float om = 0.5f * glm::length(h);  // = wo.h / |h|, but the same for wo and wi exchanged
    const float density = ggx.density(h);
    const Interface interface = at_interface(om, eta_);
    if (kValue) {
      result.f_cos = interface.transmitted * (density * Ggx::visibility(wo.z, v.reach, z_i, ggx.reach(z_i)) * z_i);
      result.f_cos += multiple_down_ * (multiple_norm_ * v.facets.deficit * facets(z_i).deficit * z_i);
    }
    if (kDensity) {
      const Color facet = facet_f0_ + (facet_f90_ - facet_f0_) * schlick_weight(om);
      const float p = v.p_facet * (1 - interface.reflection_probability(facet));
      result.pdf_w = p * density * Ggx::reflection_pdf(wo.z, v.reach, 1) + v.p_multiple_down * Grazing(alpha_).pdf_w(z_i);
    }
    return result;
  }

  // Refraction (Walter et al. 2007, eqs. 16, 17, 21). Half vector, cosine and Fresnel term are computed as from outside
  // on either side, so that rounding is reciprocal, too.
  const bool radiance = carried == Carried::radiance;
  const float n2 = ior_ * ior_;
  const Vec3 h = outside_ ? wo + ior_ * wi : wi + ior_ * wo;
  const float side = h.z < 0 ? -1.0f : 1.0f;
  const float oh = side * glm::dot(wo, h), ih = -side * glm::dot(wi, h);
  if (oh > 0 && ih > 0) {
    const float hh = glm::dot(h, h);
    const float cosine_outside = (outside_ ? oh : ih) / std::sqrt(hh);
    const Interface interface = at_interface(cosine_outside, ior_);
    const float core = ggx.density(h) * oh * ih / (hh * hh);
    if (kValue) {
      const float masking = Ggx::masking(wo.z, v.reach) * Ggx::masking(z_i, ggx.reach(z_i));
      result.f_cos = interface.transmitted * (core * masking / wo.z * (outside_ != radiance ? n2 : 1));
    }
    if (kDensity) {
      const Color facet = facet_f0_ + (facet_f90_ - facet_f0_) * schlick_weight(oh / std::sqrt(hh));
      const float p = v.p_facet * (1 - interface.reflection_probability(facet));
      result.pdf_w = p * core * 2 / (wo.z + v.reach) * (outside_ ? n2 : 1);
    }
  }
  const float to_radiance = radiance ? 1 / (eta_ * eta_) : 1;
  if (table_) {
    if (kValue) result.f_cos += multiple_down_ * v.solid_deficit * solid_deficit(z_i, false) * (z_i * to_radiance);
    if (kDensity) result.pdf_w += v.p_multiple_down * Grazing(alpha_).pdf_w(z_i);
  }
  return result;
}

Color Bsdf::layered_f_cos(const Vec3& wo, const Vec3& wi, Events mask, Carried carried) const {
  return evaluate_smooth<true, false>(view(wo, mask), wo, wi, mask, carried).f_cos;
}

float Bsdf::layered_pdf_w(const Vec3& wo, const Vec3& wi, Events mask) const {
  return evaluate_smooth<false, true>(view(wo, mask), wo, wi, mask, Carried::flux).pdf_w;
}

BsdfValue Bsdf::layered_evaluate(const Vec3& wo, const Vec3& wi, Events mask, Carried carried) const {
  return evaluate_smooth<true, true>(view(wo, mask), wo, wi, mask, carried);
}

bool Bsdf::layered_sample(const Vec3& wo, float u_lobe, const Vec2& u, Events mask, Carried carried, BsdfSample& sample) const {
  const View v = view(wo, mask);
  const float to_radiance = carried == Carried::radiance && wall_ == Wall::solid ? 1 / (eta_ * eta_) : 1;
  if (u_lobe < v.p_diffuse || v.p_diffuse == 1) {
    sample.wi = sample_cosine(u);
    sample.event = Events::D;
  } else if (u_lobe -= v.p_diffuse; u_lobe < v.p_facet || v.p_multiple_up + v.p_multiple_down == 0) {
    if (v.p_facet == 0) return false;
    u_lobe /= v.p_facet;
    const Vec3 m = rough_ ? Ggx(alpha_).sample_visible(wo, u, v.cap_share) : Vec3(0, 0, 1);
    const float om = glm::dot(wo, m);
    if (!(om > 0)) return false;
    const Interface interface = at_interface(om, eta_);
    const Color facet = facet_f0_ + (facet_f90_ - facet_f0_) * schlick_weight(om);
    const float p_reflection = interface.reflection_probability(facet);
    const bool reflects = u_lobe < p_reflection || p_reflection == 1;
    if (reflects || wall_ == Wall::thin) {
      sample.wi = 2 * om * m - wo;
      if (rough_ && sample.wi.z <= 0) return false;
      if (!reflects) sample.wi = rough_ ? Vec3(sample.wi.x, sample.wi.y, -sample.wi.z) : -wo;
    } else {
      sample.wi = (om / eta_ - interface.cos_t) * m - wo / eta_;
      if (sample.wi.z >= 0) return false;
    }
    sample.event = rough_ ? Events::G : Events::S;
    if (!rough_) {
      const float probability = v.p_facet * (reflects ? p_reflection : 1 - p_reflection);
      sample.pdf_w = 0;
      sample.weight = (reflects ? facet + interface.reflected : interface.transmitted * to_radiance) / probability;
      return true;
    }
  } else if (u_lobe -= v.p_facet; u_lobe < v.p_multiple_up || v.p_multiple_down == 0) {
    sample.wi = Grazing(alpha_).sample(u);
    sample.event = Events::G;
  } else {
    sample.wi = Grazing(alpha_).sample(u);
    sample.wi.z = -sample.wi.z;
    sample.event = Events::G;
  }
  const BsdfValue value = evaluate_smooth<true, true>(v, wo, sample.wi, mask, carried);
  if (!(value.pdf_w > 0)) return false;
  sample.pdf_w = value.pdf_w;
  sample.weight = value.f_cos / value.pdf_w;
  return true;
}

Color Bsdf::layered_diffuse_reflectance(const Vec3& wo) const { return base_ * below_layer(facets(wo.z)); }

Color Bsdf::layered_albedo(const Vec3& wo, Events mask) const {
  const FacetAlbedo f = facets(wo.z);
  Color sum{0};
  if (any(mask & events_ & Events::D)) sum += base_ * below_layer(f);
  if (!any(mask & events_ & (Events::G | Events::S))) return sum;
  sum += facet_f0_ * (1 - f.deficit - f.schlick) + facet_f90_ * f.schlick + multiple_up_ * f.deficit;
  if (wall_ == Wall::opaque) return sum;
  const Interface i = at_interface(wo.z, eta_);
  const Color once = i.reflected + i.transmitted;
  if (wall_ == Wall::thin) return sum + once * (1 - f.deficit) + multiple_down_ * f.deficit;
  if (!table_) return sum + once;
  const Color d = solid_deficit(wo.z, true);
  return sum + once * (1.0f - d) + d * (transmission_ * solid_up_share_ + tint_ * (1 - solid_up_share_));
}

}  // namespace ln
