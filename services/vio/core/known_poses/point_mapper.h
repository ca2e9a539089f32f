// Points from tracks whose poses somebody else knows: each is triangulated from the views that add
// a baseline. Nothing is estimated of the poses but how well the tracks agree with them.
// Derivation: tools/docs/maths/vio-known-poses.md. Knows no images, threads or clocks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "services/vio/core/agreement.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/row_motion.h"
#include "services/vio/core/tracks/tracks.h"
#include "services/vio/core/update/landmark.h"
#include "services/vio/core/update/triangulation.h"

namespace perdure::vio {

/// The body at one image, by who knows it.
struct KnownPose {
  RigidTransform T_WB;
  Matrix6d covariance = Matrix6d::Zero();                ///< of [θ, p], as in Odometry
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero();  ///< m/s; of use with rolling shutters
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();      ///< rad/s; likewise
};

class PointMapper {
 public:
  /// readout_s: of each camera, 0 where all rows are exposed at once; empty: all are.
  PointMapper(const VisionOptions& options, const WindowOptions& window,
              std::vector<RigidTransform> T_BC, std::vector<double> readout_s = {});

  /// The next image, and what was tracked in it.
  void add(const KnownPose& pose, const TrackedFrame& tracked);
  /// Points seen in the newest image whose position is known, by rising id. Those that do not fit
  /// their poses as the others do are left out: they move, or were followed wrongly.
  const std::vector<LandmarkEstimate>& landmarks() const { return landmarks_; }
  /// Of the newest image.
  const Mapped& mapped() const { return mapped_; }
  /// How much worse tracks agree with the poses than VisionOptions::sigma_px says; at least 1.
  double scale() const { return scale_; }
  /// Between the oldest and the newest pose that are kept.
  bool moved() const;
  /// Deviation of a tracked point from where pose and place put it, in pixels: at least
  /// VisionOptions::sigma_px; more where the poses have errors of their own.
  double noisePx() const { return scale_ * options_.sigma_px; }
  /// Forgets poses and views: another frame of reference begins.
  void clear();

 private:
  struct View {
    std::uint64_t frame = 0;
    KnownPose pose;
  };
  struct Candidate {
    const TrackedPoint* seen;
    Triangulated point;
  };
  void forgetEnded();
  void forgetOne();
  std::vector<Ray> raysOf(const Track& track) const;
  RigidTransform cameraOf(const View& view, std::size_t camera, double row) const;
  void note(const Reason& why);
  bool isSure(const Triangulated& point) const;
  void learnScale(const std::vector<Candidate>& candidates);

  VisionOptions options_;
  WindowOptions window_;
  std::vector<RigidTransform> T_BC_;
  std::vector<double> readout_s_;
  std::vector<View> views_;  ///< oldest first; the newest image is always there
  FeatureDatabase database_;
  std::uint64_t frame_ = 0;
  double scale_ = 1.0;  ///< of the residuals
  std::vector<LandmarkEstimate> landmarks_;
  Mapped mapped_;
};

}  // namespace perdure::vio
