#include "tools/data_check/pair_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "common/base/algorithms/median.h"
#include "common/replay/recording.h"

namespace perdure::tools {
namespace {

using replay::DataFinding;
using replay::Recording;
using Grade = DataFinding::Grade;

constexpr double kMostLost = 0.1;  // share of files; recordings always lose some

void checkFiles(const Recording& recording, std::size_t camera, replay::DataFindings& findings) {
  std::size_t all = 0, missing = 0;
  std::string first;
  for (const auto& frame : recording.frames) {
    if (frame.camera != camera || frame.load || frame.path.empty()) continue;
    ++all;
    if (std::filesystem::exists(frame.path)) continue;
    if (++missing == 1) first = std::filesystem::path(frame.path).filename().string();
  }
  if (static_cast<double>(missing) <= kMostLost * static_cast<double>(all)) return;
  findings.push_back(
      {Grade::kWarning, "images_missing",
       fmt::format(
           "{} of the {} images of {} ({:.0f} %) are not there, the first of them {}: fetch "
           "or copy the drive again",
           missing, all, recording.calibration.cameras[camera].name,
           100.0 * static_cast<double>(missing) / static_cast<double>(all), first)});
}

/// Median time in s from a stamp of cam0 to the nearest of cam1, for the text about unpaired
/// frames.
double apartOf(const std::vector<TimePoint>& first, const std::vector<TimePoint>& second) {
  const bool overlap = second.front() <= first.back() && first.front() <= second.back();
  if (!overlap) return toSeconds(second.front() - first.front());
  std::vector<double> apart;
  for (const TimePoint time : second) {
    const auto next = std::lower_bound(first.begin(), first.end(), time);
    double least = next == first.end() ? toSeconds(time - first.back()) : toSeconds(time - *next);
    if (next != first.begin() && toSeconds(time - *(next - 1)) < std::abs(least)) {
      least = toSeconds(time - *(next - 1));
    }
    apart.push_back(least);
  }
  return medianOf(std::move(apart));
}

std::string lengthText(double seconds) {
  return seconds < 1.0 ? fmt::format("{:.1f} ms", 1e3 * seconds) : fmt::format("{:.2f} s", seconds);
}

void checkPartners(const Recording& recording, replay::DataFindings& findings) {
  const auto& cameras = recording.calibration.cameras;
  std::vector<TimePoint> first;
  std::set<std::uint64_t> partners;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 1) partners.insert(frame.index);
    if (frame.camera == 0 && (frame.load || !frame.path.empty())) first.push_back(frame.time);
  }
  if (first.empty() || (partners.empty() && recording.unpaired.empty())) return;
  const double share = static_cast<double>(partners.size()) / static_cast<double>(first.size());
  if (share >= 1.0 - kMostLost) return;
  std::string text = fmt::format(
      "{} of the frames of {} ({} of {}) {} one of {} within {:.0f} ms, as stereo needs it",
      partners.empty() ? "none" : fmt::format("only {:.0f} %", 100.0 * share), cameras[0].name,
      partners.size(), first.size(), partners.empty() ? "has" : "have", cameras[1].name,
      1e3 * toSeconds(replay::kPairedWithin));
  if (2 * recording.unpaired.size() > first.size() - std::min(partners.size(), first.size())) {
    const double apart = apartOf(first, recording.unpaired);
    text += fmt::format(
        "; the nearest of the others are {} too {}: trigger both cameras together, or {} so much "
        "{} the stamps of {} where only its clock differs",
        lengthText(std::abs(apart)), apart > 0 ? "late" : "early", apart > 0 ? "subtract" : "add",
        apart > 0 ? "from" : "to", cameras[1].name);
  } else {
    text +=
        fmt::format("; see why {} lost them, or leave it out: without a partner {} goes on alone",
                    cameras[1].name, cameras[0].name);
  }
  findings.push_back({Grade::kWarning, "stereo_unpaired", text});
}

void checkPlace(const CameraCalibration& camera, replay::DataFindings& findings) {
  if (!hasPlaceInMm(camera)) return;
  constexpr double kLargestRig_m = 3.0;
  const double far = camera.T_BC.p.norm();
  const std::string centimetres =
      1e-2 * far < kLargestRig_m
          ? fmt::format(", or in centimetres? Then by 100, which gives {:.3g} m", 1e-2 * far)
          : "";
  findings.push_back(
      {Grade::kWarning, "T_BS_in_mm",
       fmt::format("T_BS has {} {:.3g} m from the IMU: is its position in millimetres? Then divide "
                   "the last column by 1000, which gives {:.3g} m{}",
                   camera.name, far, 1e-3 * far, centimetres)});
}

}  // namespace

bool hasPlaceInMm(const CameraCalibration& camera) {
  constexpr double kFar_m = 5.0;
  return camera.T_BC.p.norm() > kFar_m;
}

replay::DataFindings checkPairs(const Recording& recording) {
  replay::DataFindings findings;
  const auto& cameras = recording.calibration.cameras;
  for (std::size_t camera = 0; camera < cameras.size(); ++camera) {
    checkFiles(recording, camera, findings);
    if (recording.calibration.imu) checkPlace(cameras[camera], findings);
  }
  if (cameras.size() > 1) checkPartners(recording, findings);
  return findings;
}

}  // namespace perdure::tools
