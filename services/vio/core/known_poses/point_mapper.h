// Maps points from tracks and given poses, and estimates how they agree. Derivation:
// tools/docs/maths/vio-known-poses.md.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "services/vio/core/state/options.h"
#include "services/vio/core/state/row_motion.h"
#include "services/vio/core/tracks/tracks.h"
#include "services/vio/core/update/triangulation.h"

namespace perdure::vio {

/// Counts of the tracks of one image, by the result of their triangulation.
struct Mapped {
  std::size_t contradicted = 0;  ///< rays that do not meet before the cameras, or fail the gate
  std::size_t far = 0;           ///< points beyond VisionOptions::max_depth_m
  std::size_t sure = 0;          ///< landmarks, and tracks that an update has used
};

/// Whether poses agree with the images, by the tracks with parallax.
class Agreement {
 public:
  enum class Verdict { kGood, kContradicted, kFar };

  /// Adds the next image. scale: residuals relative to those of exact poses, at least 1. moved:
  /// whether the poses have moved recently. If they have not, the image is ignored.
  void add(const Mapped& mapped, double scale, bool moved);
  /// Verdict on about the last two seconds of motion, at 20 Hz.
  Verdict verdict() const;
  void clear() { *this = {}; }

 private:
  double contradicted_ = 0.0, far_ = 0.0, sure_ = 0.0, scale_ = 1.0;
  std::size_t images_ = 0;
};

struct KnownPose {
  RigidTransform T_WB;
  Matrix6d covariance = Matrix6d::Zero();                ///< covariance of [θ, p], as in Odometry
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero();  ///< m/s; used only with rolling shutters
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();      ///< rad/s; used only with rolling shutters
};

class PointMapper {
 public:
  /// readout_s: read-out time of each camera, 0 for a global shutter; empty: all global.
  PointMapper(const VisionOptions& options, const WindowOptions& window,
              std::vector<RigidTransform> T_BC, std::vector<double> readout_s = {});

  void add(const KnownPose& pose, const TrackedFrame& tracked);
  /// Points of the newest image with known position, by rising id, without misfits.
  const std::vector<Landmark>& landmarks() const { return landmarks_; }
  const Mapped& mapped() const { return mapped_; }
  /// Ratio of the tracks' residuals to VisionOptions::sigma_px, at least 1.
  double scale() const { return scale_; }
  /// Whether the body moved between the oldest and the newest stored pose.
  bool moved() const;
  /// Standard deviation of a tracked point from its projection, px; grows with the poses' errors.
  double noisePx() const { return scale_ * options_.sigma_px; }
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
  std::vector<View> views_;  ///< oldest first; always contains the newest image
  FeatureDatabase database_;
  std::uint64_t frame_ = 0;
  double scale_ = 1.0;  ///< ratio of the residuals to sigma_px
  std::vector<Landmark> landmarks_;
  Mapped mapped_;
};

}  // namespace perdure::vio
