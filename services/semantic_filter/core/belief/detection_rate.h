// View-dependent detection probability: how often earlier visits detected a track, by viewpoint.
// Derivation: tools/docs/maths/detectability.md.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/base/shared_vector.h"
#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

/// Copies share the counts of earlier visits, because the history copies the belief at each frame.
class DetectionRate {
 public:
  /// most counts of one visit, and of all earlier visits together
  static constexpr std::size_t kMostViews = 96;

  /// Adds an observation in which a detection had the probability `expected`.
  void add(const ViewRay& from, double expected, bool found, const ViewScales& scales);
  /// Begins a visit: factor() uses the counts so far from now on. It ignores the misses of the
  /// present visit, because the object may have gone.
  void beginVisit(const ViewScales& scales);
  /// Returns the factor on P_D at this viewpoint: the mean of a beta prior of `prior` observations,
  /// updated by earlier visits from similar viewpoints; 1 if there was no earlier visit.
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
