// What the benchmarks of vio run on: images and a filter in steady state, both of a seed.
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

/// A textured wall that passes by at 3.5 pixels a frame, 752 × 480, there and back for ever.
class PassingImages {
 public:
  PassingImages();
  const cv::Mat& next();

 private:
  std::vector<cv::Mat> images_;
  std::size_t at_ = 0;
};

/// 150 matches over one frame, a fifth of them wrong; R_now_before is the identity.
std::vector<Match> someMatches();

/// A simulated drive at 20 Hz with 150 points in each image, and a filter that has followed it for
/// 100 frames: the window and the points of the state are full.
class RunningFilter {
 public:
  explicit RunningFilter(bool stereo);

  const Options& options() const { return options_; }
  const test::SimulatedDrive& drive() const { return drive_; }
  const ImuBuffer& imu() const { return imu_; }

  /// After 100 frames.
  const Estimator& estimator() const { return warm_; }
  /// Another one like estimator().
  Estimator warmed() const;
  /// The frame that comes next for estimator().
  const FrameInput& input() const { return inputs_[kWarm]; }
  /// All of the drive's frames that come after the first 100.
  std::vector<FrameInput> inputs() const { return {inputs_.begin() + kWarm, inputs_.end()}; }

  /// The state of estimator(), propagated to input() and cloned there.
  const State& cloned() const { return cloned_; }
  /// What the window's frames and input() saw.
  const FeatureDatabase& database() const { return database_; }
  /// The longest tracks of database() that are not in the state, at most `count`.
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
