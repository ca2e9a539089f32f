// How often the network found an track, by where it was looked at from. P_D is of the class; its
// instances differ, and what a network misses from one side today it missed from there yesterday.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "services/semantic_filter/core/belief/view_change.h"

namespace perdure::semantic_filter {

/// Copied with every belief that is kept for late detections: what earlier visits counted is
/// shared.
class DetectionRate {
 public:
  static constexpr std::size_t kMostViews = 96;  ///< of one visit, and of those before it

  /// A look that P_D and visibility expect to show the track with probability `expected`.
  void add(const ViewRay& from, double expected, bool found, const ViewScales& scales);
  /// The track comes back into the picture: what was counted until then speaks for this visit.
  /// Within one visit misses in a row do not excuse each other: the thing may have gone.
  void beginVisit(const ViewScales& scales);
  /// By how much P_D is to be multiplied from there: the mean of a beta prior that is worth `prior`
  /// looks, after what earlier visits found from about there; 1 where there were none. Where the
  /// track is in the image does not count.
  double factor(const ViewRay& from, double prior, const ViewScales& scales) const;
  /// Takes in the looks at what turned out to be the same track.
  void join(const DetectionRate& other, const ViewScales& scales);
  std::size_t views() const { return (before_ ? before_->size() : 0) + now_.size(); }

 private:
  struct Count {
    Eigen::Vector3f ray_W;
    float log_distance = 0.0F, expected = 0.0F, found = 0.0F;
  };
  using Counts = std::vector<Count>;
  static void addTo(Counts& counts, const Count& count, const ViewScales& scales);

  std::shared_ptr<const Counts> before_;
  Counts now_;
};

}  // namespace perdure::semantic_filter
