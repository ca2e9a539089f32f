// Sets anchors along the way of the odometry, each with the increment from the one before.
#pragma once

#include <optional>

#include "common/mapping/frames/anchor.h"
#include "common/mapping/frames/relative_error.h"
#include "common/mapping/parameters.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

/// Poses of one session, in order.
class AnchorBuilder {
 public:
  explicit AnchorBuilder(const AnchorParameters& parameters)
      : parameters_(parameters), error_({parameters.walk_position, parameters.walk_yaw}) {}

  /// Goes on from the newest anchor of a session after a break: the way since it is taken for
  /// straight, and for walked as by poses that come without increments.
  void resume(const Anchor& last);

  /// Returns an anchor at the body if one is due: at the first pose, then by way, turn or
  /// uncertainty of yaw since the last one. `next` is its id. None at rest but the first, none
  /// while the odometry initialises.
  std::optional<Anchor> add(const Odometry& odometry, AnchorId next);

  /// The body, levelled, relative to the last anchor, with the covariance of what the odometry may
  /// be off by since then. Nothing before the first anchor.
  const std::optional<LevelGaussian>& sinceLast() const { return since_; }
  const std::optional<Anchor>& last() const { return last_; }
  /// Driven so far. Motion within two centimetres of where it was last counted adds nothing: that
  /// is noise of a body at rest.
  double way_m() const { return way_m_; }

 private:
  /// Returns what the way grew by.
  double countWay(const Eigen::Vector3d& p_W);
  bool isDue() const;
  Anchor setAnchor(const Odometry& odometry, AnchorId id);

  AnchorParameters parameters_;
  std::optional<Anchor> last_;
  std::optional<LevelGaussian> since_;
  std::optional<Odometry> before_;
  RelativeError error_;                                  ///< of the body since the last anchor
  Eigen::Vector3d counted_W_ = Eigen::Vector3d::Zero();  ///< where the way was last counted
  double way_m_ = 0.0;
};

}  // namespace perdure::mapping
