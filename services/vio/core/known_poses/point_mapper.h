// Maps points from tracks and given poses, and estimates how well tracks and poses agree.
// Derivation: tools/docs/maths/vio-known-poses.md.
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
  std::size_t contradicted = 0;  ///< rays do not meet in front of the cameras, or fail the gate
  std::size_t far = 0;           ///< point is beyond VisionOptions::max_depth_m
  std::size_t sure = 0;          ///< track is a landmark, or was used by an update
};

/// Judges from the tracks with parallax whether the poses agree with the images.
class Agreement {
 public:
  enum class Verdict { kGood, kContradicted, kFar };

  /// Adds the next image. scale: ratio of the residuals to those of exact poses, at least 1. moved:
  /// true if the body has moved recently; otherwise the image is ignored.
  void add(const Mapped& mapped, double scale, bool moved);
  /// Returns the verdict on the last 40 images or so in which the body moved.
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
  /// readout_s is the read-out time of each camera, 0 for a global shutter; empty if all are
  /// global.
  PointMapper(const VisionOptions& options, const WindowOptions& window,
              std::vector<RigidTransform> T_BC, std::vector<double> readout_s = {});

  void add(const KnownPose& pose, const TrackedFrame& tracked);
  /// Returns the points of the newest image whose position is known and fits, in order of rising
  /// id.
  const std::vector<Landmark>& landmarks() const { return landmarks_; }
  const Mapped& mapped() const { return mapped_; }
  /// Returns the ratio of the tracks' residuals to VisionOptions::sigma_px, at least 1.
  double scale() const { return scale_; }
  /// Returns true if the oldest and the newest stored pose differ by more than 0.05 m or 0.05 rad.
  bool moved() const;
  /// Returns the standard deviation, in px, of a tracked point from its projection. It grows with
  /// the errors of the poses.
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
