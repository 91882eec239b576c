#pragma once
// What is asked of the private wires of irradiance gradients.

#include "ln/irradiance_records.hpp"
#include "ln/request.hpp"

namespace ln {

/// "What irradiance arrives there, and how does it change around?" `share`: of the usual number of directions; `step`: as of
/// `integrate`; `depth` as in Request.
class HemisphereRequest {
 public:
  using Answer = IrradianceSample;

  HemisphereRequest(Tracer& tracer, const Receiver& where, std::uint32_t key, float share, float step, std::uint32_t depth = 1)
      : tracer_(tracer), where_(where), key_(key), share_(share), step_(step), depth_(depth) {}

  Tracer& tracer() { return tracer_; }
  const Receiver& where() const { return where_; }
  std::uint32_t key() const { return key_; }  // of its random numbers
  float share() const { return share_; }
  float step() const { return step_; }
  std::uint32_t depth() const { return depth_; }

 private:
  Tracer& tracer_;
  const Receiver& where_;
  std::uint32_t key_;
  float share_, step_;
  std::uint32_t depth_;
};

/// "Which records may be used there?" Calls `visit(record, weight)` for each of them.
template <class Visit>
class RecordRequest {
 public:
  using Answer = void;

  RecordRequest(Tracer& tracer, const SampleStream& random, const Interaction& at, std::uint32_t depth, Visit& visit)
      : visit(visit), tracer_(tracer), random_(random), at_(at), depth_(depth) {}

  Tracer& tracer() { return tracer_; }
  const SampleStream& random() const { return random_; }
  const Interaction& at() const { return at_; }
  std::uint32_t depth() const { return depth_; }

  Visit& visit;

 private:
  Tracer& tracer_;
  const SampleStream& random_;
  const Interaction& at_;
  std::uint32_t depth_;
};

}  // namespace ln
