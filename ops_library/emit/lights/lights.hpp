#pragma once

#include "ln/operator.hpp"

namespace ln::ops {

/// The emitters of the scene; see lights.ln.
struct Lights {
  NodeId node;
  TagSelection from;

  void prepare(PrepareContext& context) {
    if (from.everything()) {
      emitters_ = &context.scene().emitters();
    } else {
      owned_ = context.scene().selected_emitters(from);
      emitters_ = owned_.get();
    }
  }

  /// The Emission wire.
  const Emitters& emission() const { return *emitters_; }

  // State.
  std::unique_ptr<Emitters> owned_ = nullptr;
  const Emitters* emitters_ = nullptr;
};

}  // namespace ln::ops
