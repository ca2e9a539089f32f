// Inputs of vio's benchmarks: images and a filter in steady state, both seeded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/tracks/ransac.h"
#include "services/vio/core/tracks/tracks.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio::bench {

/// Images of 752 × 480 of a textured wall that passes at 3.5 pixels per frame. The sequence runs
/// forwards and backwards without end.
class PassingImages {
 public:
  PassingImages();
  const cv::Mat& next();

 private:
  std::vector<cv::Mat> images_;
  std::size_t at_ = 0;
};

/// Returns 150 matches over one frame, a fifth of them wrong; R_now_before is the identity.
std::vector<Match> someMatches();

/// A simulated drive at 20 Hz with 150 points in each image, and a filter after its first 100
/// frames. The window and the points of the state are full.
class RunningFilter {
 public:
  explicit RunningFilter(bool stereo);

  const Options& options() const { return options_; }
  const test::SimulatedDrive& drive() const { return drive_; }
  const ImuBuffer& imu() const { return imu_; }

  /// The estimator after 100 frames.
  const Estimator& estimator() const { return warm_; }
  /// Returns another estimator in the same condition as estimator().
  Estimator warmed() const;
  /// The next frame for estimator().
  const FrameInput& input() const { return inputs_[kWarm]; }
  /// All frames of the drive after the first 100.
  std::vector<FrameInput> inputs() const { return {inputs_.begin() + kWarm, inputs_.end()}; }

  /// The state of estimator(), propagated to input() and cloned there.
  const State& cloned() const { return cloned_; }
  /// The observations of the window's frames and of input().
  const FeatureDatabase& database() const { return database_; }
  /// Returns the longest tracks of database() that are not in the state, at most `count`.
  std::vector<const Track*> tracks(std::size_t count) const;

 private:
  static constexpr std::size_t kWarm = 100, kFrames = 340;
  Options options_;
  test::SimulatedDrive drive_;
  ImuBuffer imu_;
  std::vector<FrameInput> inputs_;
  Estimator warm_;
  State cloned_;
  FeatureDatabase database_;
};

}  // namespace perdure::vio::bench
