// View-dependent detection probability: how often earlier visits detected a track, by viewpoint.
// Derivation: tools/docs/maths/detectability.md.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/base/shared_vector.h"
#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

/// Copies, as beliefs are kept for late detections, share the counts of earlier visits.
class DetectionRate {
 public:
  /// at most, of one visit and of all earlier visits
  static constexpr std::size_t kMostViews = 96;

  /// Adds an observation in which a detection had the probability `expected`.
  void add(const ViewRay& from, double expected, bool found, const ViewScales& scales);
  /// Begins a visit: the counts so far apply from now on. Within one visit, misses do not excuse
  /// each other, because the object may have gone.
  void beginVisit(const ViewScales& scales);
  /// Returns the factor on P_D at this viewpoint: the mean of a beta prior of `prior` observations,
  /// updated by earlier visits from similar viewpoints; 1 without any.
  double factor(const ViewRay& from, double prior, const ViewScales& scales) const;
  /// Adds the counts of a track that proved to be the same object.
  void join(const DetectionRate& other, const ViewScales& scales);
  std::size_t views() const { return (before_ ? before_->size() : 0) + now_.size(); }

 private:
  struct Count {
    ViewRay from;
    double expected = 0.0, found = 0.0;
  };
  using Counts = std::vector<Count>;
  static void addTo(Counts& counts, const Count& count, const ViewScales& scales);

  std::shared_ptr<const Counts> before_;
  SharedVector<Count> now_;
};

}  // namespace perdure::semantic_filter
