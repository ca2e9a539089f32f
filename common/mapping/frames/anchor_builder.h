// Sets anchors along the trajectory of the odometry. Each has the increment from the previous one.
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

  /// Continues after an interruption from `last`, the newest anchor of the session. Assumes a
  /// straight trajectory from there, with the random walk of poses without increments.
  void resume(const Anchor& last);

  /// Returns an anchor with id `next` at the body if one is due: at the first pose, and when
  /// distance travelled, turn or yaw uncertainty since the last anchor reach their limits. A body
  /// at rest, or an odometry that initialises, gets no further anchors.
  std::optional<Anchor> add(const Odometry& odometry, AnchorId next);

  /// The levelled pose of the body relative to the last anchor, with the covariance of the odometry
  /// error since then. Returns nothing before the first anchor.
  const std::optional<LevelGaussian>& sinceLast() const { return since_; }
  const std::optional<Anchor>& last() const { return last_; }
  /// The distance travelled so far. Motion within two centimetres of the last counted position adds
  /// nothing, because a body at rest has that much noise.
  double way_m() const { return way_m_; }

 private:
  /// Adds the motion to the distance travelled and returns the increase, m.
  double countWay(const Eigen::Vector3d& p_W);
  bool isDue() const;
  Anchor setAnchor(const Odometry& odometry, AnchorId id);

  AnchorParameters parameters_;
  std::optional<Anchor> last_;
  std::optional<LevelGaussian> since_;
  std::optional<Odometry> before_;
  RelativeError error_;                                  ///< error since the last anchor
  Eigen::Vector3d counted_W_ = Eigen::Vector3d::Zero();  ///< last position that increased way_m_
  double way_m_ = 0.0;
};

}  // namespace perdure::mapping
