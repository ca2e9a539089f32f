#include "tools/data_check/motion_in.h"

#include <vector>

#include "common/base/algorithms/median.h"
#include "common/replay/data_check.h"
#include "tools/data_check/image_turn.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::tools {

double turningIn(const replay::Recording& recording, TimePoint from, TimePoint to) {
  if (recording.imu.size() < 2) return 0.0;
  constexpr Duration kStep = std::chrono::milliseconds(300);
  const TurnIntegral gyro(recording.imu);
  std::vector<Eigen::Vector3d> turns;
  for (TimePoint time = from; time + kStep <= to; time += kStep) {
    if (gyro.covers(time, time + kStep)) turns.push_back(gyro.between(time, time + kStep));
  }
  return turns.size() < 3 ? 0.0 : TurnPairs(turns, turns).turning();
}

double speedIn(const replay::Recording& recording, TimePoint from, TimePoint to) {
  std::vector<double> speeds;
  for (const SpeedSample& sample : recording.speed) {
    if (sample.time >= from && sample.time <= to) speeds.push_back(std::abs(sample.speed));
  }
  return medianOf(std::move(speeds));
}

double flowOf(const replay::Recording& recording, const replay::Recording::FrameFile& a,
              const replay::Recording::FrameFile& b) {
  const CameraCalibration& calibration = recording.calibration.cameras.front();
  const auto first = replay::monoImageOf(a), second = replay::monoImageOf(b);
  if (!first || !second || first->size() != second->size()) return 0.0;
  std::vector<double> steps;
  for (const Flow& flow :
       flowBetween(CameraModel(calibration), FollowedImage(*first), FollowedImage(*second))) {
    steps.push_back(calibration.fx * flow.step.norm());
  }
  return medianOf(std::move(steps));
}

double flowIn(const replay::Recording& recording, TimePoint from, TimePoint to) {
  std::vector<const replay::Recording::FrameFile*> frames;
  for (const auto& frame : recording.frames) {
    const bool inside = frame.camera == 0 && frame.time >= from && frame.time <= to;
    if (inside && (frame.load || !frame.path.empty())) frames.push_back(&frame);
  }
  if (frames.size() < 4) return 0.0;
  std::vector<double> flows;
  for (const std::size_t at : {frames.size() / 4, frames.size() / 2, frames.size() * 3 / 4}) {
    flows.push_back(flowOf(recording, *frames[at - 1], *frames[at]));
  }
  return medianOf(std::move(flows));
}

}  // namespace perdure::tools
