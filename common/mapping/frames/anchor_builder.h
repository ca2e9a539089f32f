// Sets anchors along the trajectory of the odometry, each with the increment from the previous one.
#pragma once

#include <optional>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/frames/relative_error.h"
#include "common/mapping/parameters.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

/// Processes the poses of one session, in order.
class AnchorBuilder {
 public:
  explicit AnchorBuilder(const AnchorParameters& parameters)
      : parameters_(parameters), error_({parameters.walk_position, parameters.walk_yaw}) {}

  /// Continues from the newest anchor of a session after an interruption. The trajectory since then
  /// is assumed to be straight, with the errors of poses without increments.
  void resume(const Anchor& last);

  /// Returns an anchor at the body if one is due. The first pose creates an anchor; later ones
  /// depend on distance travelled, turn or yaw uncertainty since the last anchor. `next` is its id.
  /// At rest, and while the odometry initialises, there are no further anchors.
  std::optional<Anchor> add(const Odometry& odometry, AnchorId next);

  /// The levelled pose of the body relative to the last anchor, with the covariance of the odometry
  /// error since then. Returns nothing before the first anchor.
  const std::optional<LevelGaussian>& sinceLast() const { return since_; }
  const std::optional<Anchor>& last() const { return last_; }
  /// Distance travelled so far. Motion within two centimetres of the last counted position adds
  /// nothing, because it is noise of a body at rest.
  double way_m() const { return way_m_; }

 private:
  /// Returns the increase in distance travelled.
  double countWay(const Eigen::Vector3d& p_W);
  bool isDue() const;
  Anchor setAnchor(const Odometry& odometry, AnchorId id);

  AnchorParameters parameters_;
  std::optional<Anchor> last_;
  std::optional<LevelGaussian> since_;
  std::optional<Odometry> before_;
  RelativeError error_;                                  ///< error since the last anchor
  Eigen::Vector3d counted_W_ = Eigen::Vector3d::Zero();  ///< last position that was counted
  double way_m_ = 0.0;
};

}  // namespace perdure::mapping
