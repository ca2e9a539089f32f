// The frame M in which tracks live: odometry's frame W without the drift that known objects showed.
#pragma once

#include <optional>
#include <utility>

#include "common/math/rigid_transform.h"
#include "services/semantic_filter/core/memory/frame_alignment.h"

namespace perdure::semantic_filter {

/// T_MW; none: no drift was taken out, and M is W to the bit.
class MapFrame {
 public:
  const std::optional<RigidTransform>& T_MW() const { return T_MW_; }
  RigidTransform inM(const RigidTransform& T_WB) const { return T_MW_ ? *T_MW_ * T_WB : T_WB; }
  RigidTransform inW(const RigidTransform& T_MB) const {
    return T_MW_ ? T_MW_->inverse() * T_MB : T_MB;
  }
  ObjectBelief inM(ObjectBelief belief) const {
    return T_MW_ ? turned(*T_MW_, std::move(belief)) : belief;
  }
  ObjectBelief inW(ObjectBelief belief) const {
    return T_MW_ ? turned(T_MW_->inverse(), std::move(belief)) : belief;
  }
  /// Another frame takes the place of M; `step` maps points of the old one into it.
  void correct(const RigidTransform& step) { T_MW_ = step * inM(RigidTransform()); }

 private:
  std::optional<RigidTransform> T_MW_;
};

}  // namespace perdure::semantic_filter
