// Compares a recording's own calibration with its motion.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tools/calibrate/motion/from_motion.h"

namespace perdure::calibrate {
namespace {

using Grade = replay::DataFinding::Grade;

constexpr double kSurely = 4.0;  ///< standard deviations

/// Priors of a nearly right calibration; infinite for the parameters that are checked.
JointVector narrowPriors(const CameraCalibration& camera) {
  const double free = std::numeric_limits<double>::infinity();
  const double turn = 2.0 * M_PI / 180.0, centre = 0.01 * camera.width;
  JointVector sigma;
  sigma << turn, turn, turn, free, 0.03, 0.05, 0.05, 0.05, free, centre, centre, 0.02, 0.02, 0.05,
      0.05, 0.05;
  return sigma;
}

replay::DataFindings judge(const CameraCalibration& given, const JointEstimate& joint) {
  // Smallest errors that are reported.
  constexpr double kLeastShare = 0.025, kLater_s = 0.008, kReadout_s = 0.01;
  const CameraCalibration& found = joint.state.camera;
  const JointVector& s = joint.sigma;
  replay::DataFindings findings;
  const auto differs = [&](double change, double least, double sigma) {
    return std::abs(change) > std::max(least, kSurely * sigma);
  };
  const auto add = [&](const char* code, const std::string& text) {
    findings.push_back(
        {Grade::kCause, code, text + "; or let perdure calibrate from-motion find the whole rig"});
  };
  if (differs(found.fx / given.fx - 1.0, kLeastShare, s[kFocal])) {
    add("focal_length",
        fmt::format("{} turns as with a focal length of {:.0f} ± {:.0f} px, not {:.0f}: set "
                    "intrinsics to [{:.1f}, {:.1f}, {:.1f}, {:.1f}]",
                    given.name, found.fx, s[kFocal] * found.fx, given.fx, found.fx, found.fy,
                    given.cx, given.cy));
  }
  if (differs(found.time_offset_s - given.time_offset_s, kLater_s, s[kLater])) {
    add("time_offset",
        fmt::format("the images of {} and the IMU are {:.1f} ± {:.1f} ms apart, not {:.1f}: set "
                    "time_offset_s to {:.4f}",
                    given.name, 1e3 * found.time_offset_s, 1e3 * s[kLater],
                    1e3 * given.time_offset_s, found.time_offset_s));
  }
  const double readout = std::max(0.0, found.readout_s);
  if (differs(readout - given.readout_s, kReadout_s, s[kReadout])) {
    add("readout",
        fmt::format("the rows of {} are exposed one after another within {:.0f} ± {:.0f} ms, not "
                    "{:.0f} (rolling shutter): set readout_s to {:.4f}",
                    given.name, 1e3 * readout, 1e3 * s[kReadout], 1e3 * given.readout_s, readout));
  }
  return findings;
}

bool fits(const JointEstimate& joint) {
  constexpr double kResidual_px = 2.0, kInliers = 0.6;
  return joint.residual_px < kResidual_px && joint.inliers >= kInliers;
}

/// Whether the standard deviations are at most `share` of the largest that permit a judgement.
bool isSure(const JointEstimate& joint, double share) {
  constexpr double kSureShare = 0.01, kSure_s = 0.004;
  return joint.sigma[kFocal] < share * kSureShare && joint.sigma[kLater] < share * kSure_s &&
         fits(joint);
}

/// Least changes that are reported: rotation in rad, bias in rad/s, relative focal length.
JointVector leastChange() {
  JointVector least = JointVector::Constant(std::numeric_limits<double>::infinity());
  least.segment<3>(kTurnOf).setConstant(0.03);
  least.segment<3>(kBias).setConstant(0.04);
  least[kFocal] = 0.08;
  return least;
}

/// Judges what differs between the estimates of the two halves of a drive.
replay::DataFindings judgeChange(const JointEstimate& a, const JointEstimate& b, TimePoint middle) {
  constexpr double kClearly = 6.0;  // standard deviations; those of few windows are uncertain
  constexpr double kClock_s = 0.01;
  const JointVector change = between(a.state, b.state), least = leastChange(),
                    sigma = (a.sigma.cwiseAbs2() + b.sigma.cwiseAbs2()).cwiseSqrt();
  const auto changes = [&](int first, int count) {
    return (change.array().abs() > least.array().max(kClearly * sigma.array()))
        .segment(first, count)
        .any();
  };
  if (std::abs(change[kLater]) > kClock_s) return {};  // a clock was set
  std::string what;
  if (changes(kFocal, 1)) {
    what =
        fmt::format("its focal length changes from {:.0f} to {:.0f} px (zoom, or cropped images)",
                    a.state.camera.fx, b.state.camera.fx);
  } else if (changes(kTurnOf, 3)) {
    what = fmt::format("its rotation on the IMU changes by {:.1f}° (the mount is loose)",
                       change.segment<3>(kTurnOf).norm() * 180.0 / M_PI);
  } else if (changes(kBias, 3)) {
    const Eigen::Vector3d bias = change.segment<3>(kBias);
    what = fmt::format(
        "the bias of the gyroscope changes by {:.2f}, {:.2f}, {:.2f} rad/s about x, y, z", bias.x(),
        bias.y(), bias.z());
  }
  if (what.empty()) return {};
  return {{Grade::kCause, "rig_changes",
           fmt::format("{}: between the parts of the drive before and after {} ns, {}; find when, "
                       "and cut the drive there",
                       a.state.camera.name, toNanoseconds(middle), what)}};
}

/// Whether both halves of the windows ask for the same values.
bool isEven(const JointEstimate& joint) {
  constexpr double kShown = 0.5;  // a step from the common estimate shows a part of a change
  return (joint.change.array().abs() < kShown * leastChange().array()).all();
}

/// Estimates the two halves of the drive separately.
replay::DataFindings checkHalves(const std::vector<TrackWindow>& windows,
                                 const replay::Recording& recording, const JointOptions& options) {
  constexpr std::size_t kFewest = 3;
  const TimePoint middle = recording.frames[recording.frames.size() / 2].time;
  std::array<std::vector<TrackWindow>, 2> halves;
  for (const TrackWindow& window : windows) {
    halves[window.times.front() < middle ? 0 : 1].push_back(window);
  }
  if (std::min(halves[0].size(), halves[1].size()) < kFewest) return {};
  const JointEstimate a = estimateJointly(halves[0], recording.imu, options),
                      b = estimateJointly(halves[1], recording.imu, options);
  return fits(a) && fits(b) ? judgeChange(a, b, middle) : replay::DataFindings();
}

}  // namespace

MotionCheck checkMotion(const replay::Recording& recording) {
  constexpr std::size_t kWindows = 12, kFewest = 6;
  constexpr double kSpacing_s = 0.06;  // closer images take time without more information
  const CameraCalibration& given = recording.calibration.cameras.front();
  if (given.distortion == DistortionModel::kRational) {
    return {{}, "the motion is not compared with a lens of eight coefficients"};
  }
  const JointOptions options{{given, Eigen::Vector3d::Zero()}, narrowPriors(given), 10};
  TrackWindows tracks = trackWindows(recording, {.most = kFewest, .spacing_s = kSpacing_s});
  JointEstimate joint;
  const auto estimate = [&] {
    const bool enough = tracks.windows.size() >= kFewest;
    if (enough) joint = estimateJointly(tracks.windows, recording.imu, options);
    return enough;
  };
  // Half of the windows suffices if it shows no error with half the permitted deviations. The other
  // half is also skipped if the deviations are over twice the permitted ones.
  const bool first = estimate(), even = first && isEven(joint),
             sure = even && isSure(joint, 0.5) && judge(given, joint).empty();
  if (!sure && (!even || isSure(joint, 2.0))) {
    tracks.add(trackWindows(
        recording, {.most = kWindows - kFewest, .skip = kFewest, .spacing_s = kSpacing_s}));
    if (!estimate()) {
      return {{}, "too few images with corners to judge focal length, time offset and readout"};
    }
  }
  const JointVector& s = joint.sigma;
  const CameraCalibration& found = joint.state.camera;
  const std::string shown = fmt::format(
      "{} images in {} stretches: focal length {:.0f} px ± {:.1f} %, time offset {:.1f} ± {:.1f} "
      "ms, readout {:.1f} ± {:.1f} ms",
      tracks.images, joint.windows, found.fx, 100.0 * s[kFocal], 1e3 * found.time_offset_s,
      1e3 * s[kLater], 1e3 * found.readout_s, 1e3 * s[kReadout]);
  if (!isEven(joint)) {
    if (auto changes = checkHalves(tracks.windows, recording, options); !changes.empty())
      return {changes, "the motion judges the halves of the drive; together they show " + shown};
  }
  constexpr double kChange_s = 0.015;
  if (auto clocks = tools::judgeParts(joint.offsets, recording, kChange_s); !clocks.empty()) {
    return {clocks, "the motion judges the clocks by " + shown};
  }
  if (!isSure(joint, 1.0)) {
    return {{}, "the motion is too little to judge the lens and the stamps (" + shown + ")"};
  }
  return {judge(given, joint), "the motion judges the lens and the stamps by " + shown};
}

}  // namespace perdure::calibrate
