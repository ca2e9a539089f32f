#include "tools/data_check/stereo/stereo_check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "common/base/algorithms/median.h"
#include "common/math/so3.h"
#include "tools/data_check/pair_check.h"
#include "tools/data_check/stereo/stereo_matches.h"
#include "tools/data_check/stereo/stereo_time.h"

namespace perdure::tools {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using replay::DataFinding;
using replay::DataFindings;
using replay::Recording;

constexpr std::size_t kFewestMatches = 60;
constexpr double kMostMatch = 0.5;  // least share of cam0's corners that a correct rig matches
constexpr double kFewMatch = 0.25;  // largest share that two unrelated images match
constexpr double kDegreesOfTurn = 180.0 / M_PI;

/// Unit normal, in C1, of the epipolar plane of a ray of C0; empty for a ray near the baseline.
std::optional<Vector3d> planeOf(const StereoMatch& match, const RigidTransform& T_C1C0) {
  constexpr double kAlongBaseline = 0.1;
  const Vector3d normal = T_C1C0.p.normalized().cross(T_C1C0.q * match.first);
  if (normal.norm() < kAlongBaseline) return std::nullopt;
  return normal.normalized();
}

/// How well matches agree with a geometry.
struct Fit {
  std::size_t count = 0;               ///< number of matches away from the baseline
  double off_px = 0.0;                 ///< median distance from the epipolar line
  std::size_t before = 0, behind = 0;  ///< numbers of matches with parallax
  bool isBehind() const { return behind > kFewestMatches && behind > 2 * before; }
  bool isBefore() const { return before > 2 * behind; }
};

Fit fitOf(const std::vector<StereoMatch>& matches, const RigidTransform& T_C1C0, double fx) {
  Fit fit;
  std::vector<double> off_px;
  for (const StereoMatch& match : matches) {
    const auto normal = planeOf(match, T_C1C0);
    if (!normal) continue;
    off_px.push_back(fx * std::asin(std::min(1.0, std::abs(normal->dot(match.second)))));
    // For a point in front of the cameras, this parallax is positive.
    const double parallax = -normal->dot((T_C1C0.q * match.first).cross(match.second));
    if (std::abs(parallax) * fx < 2.0) continue;
    ++(parallax > 0.0 ? fit.before : fit.behind);
  }
  fit.count = off_px.size();
  fit.off_px = medianOf(off_px);
  return fit;
}

struct Turned {
  Vector3d by = Vector3d::Zero();  ///< rad, left of R_C1C0
  Vector3d sigma = Vector3d::Zero();
};

/// The small rotation of cam1 that minimises the distances from the epipolar lines, by Gauss-Newton
/// with Cauchy weights; the baseline stays constant.
Turned turnOf(const std::vector<StereoMatch>& matches, const RigidTransform& T_C1C0) {
  constexpr double kFinest = 2e-4;  // rad; accuracy of corner positions
  Turned turned;
  for (int round = 0; round < 20; ++round) {
    RigidTransform T = T_C1C0;
    T.q = expQuaternion(turned.by) * T.q;
    T.p = expQuaternion(turned.by) * T.p;
    std::vector<std::pair<double, Vector3d>> rows;
    std::vector<double> sizes;
    for (const StereoMatch& match : matches) {
      const auto normal = planeOf(match, T);
      if (!normal) continue;
      // A rotation of T by a small d changes n to n + d × n, and its product with b by d · (n × b).
      rows.emplace_back(normal->dot(match.second), normal->cross(match.second));
      sizes.push_back(std::abs(rows.back().first));
    }
    const double scale = std::max(kFinest, 1.5 * medianOf(sizes));
    Matrix3d A = 1e-9 * Matrix3d::Identity();
    Vector3d b = Vector3d::Zero();
    for (const auto& [error, slope] : rows) {
      const double weight = 1.0 / (1.0 + error * error / (scale * scale));
      A += weight * slope * slope.transpose();
      b -= weight * error * slope;
    }
    const Vector3d step = A.ldlt().solve(b);
    turned.by = logSo3(Eigen::Quaterniond(expQuaternion(step) * expQuaternion(turned.by)));
    turned.sigma = scale * A.inverse().diagonal().cwiseSqrt();
    if (step.norm() < 1e-6) break;
  }
  return turned;
}

std::string axisText(const Vector3d& turn) {
  constexpr std::array kAxisNames{"horizontal", "vertical", "optical"};
  Eigen::Index axis = 0;
  const double most = turn.cwiseAbs().maxCoeff(&axis);
  if (most < 0.8 * turn.norm()) return {};
  return fmt::format(" about its {} axis", kAxisNames[static_cast<std::size_t>(axis)]);
}

DataFindings warning(const char* code, std::string text) {
  return {{DataFinding::Grade::kWarning, code, std::move(text)}};
}

class StereoJudge {
 public:
  StereoJudge(const Recording& recording, const std::vector<StereoImages>& pairs)
      : recording_(recording),
        pairs_(pairs),
        first_(recording.calibration.cameras[0]),
        second_(recording.calibration.cameras[1]),
        T_C1C0_(second_.T_BC().inverse() * first_.T_BC()) {}

  DataFindings judge() const {
    const auto &name0 = first_.calibration().name, &name1 = second_.calibration().name;
    const StereoMatches by_rig = matchesOf(pairs_, first_, second_, T_C1C0_.R());
    StereoMatches best = by_rig;
    if (by_rig.share() < kMostMatch) {  // tries equal viewing directions
      const auto alike = matchesOf(pairs_, first_, second_, Matrix3d::Identity());
      if (alike.matches.size() > 1.5 * static_cast<double>(best.matches.size())) best = alike;
    }
    if (best.share() < kFewMatch) return judgeUnlike(by_rig, best);
    if (best.matches.size() < kFewestMatches) return {};
    constexpr double kSamePlace_m = 1e-3;
    if (T_C1C0_.p.norm() < kSamePlace_m) {
      return warning("stereo_same_place",
                     fmt::format("T_BS of {} has it at the place of {}: write where each camera is "
                                 "on the IMU",
                                 name1, name0));
    }
    return judgeGeometry(best.matches);
  }

 private:
  /// Judges pairs whose images do not match.
  DataFindings judgeUnlike(const StereoMatches& by_rig, const StereoMatches& best) const {
    if (by_rig.tried < kFewestMatches) return {};
    if (auto late = judgeStamps(); !late.empty()) return late;
    constexpr std::array<std::pair<Flip, const char*>, 3> kFlips{
        {{Flip::kBoth, "upside down (turned by 180°)"},
         {Flip::kSideways, "mirrored"},
         {Flip::kUpright, "mirrored, top to bottom"}}};
    const std::string& name0 = first_.calibration().name;
    const std::string& name1 = second_.calibration().name;
    for (const auto& [flip, word] : kFlips) {
      const auto flipped = matchesOf(pairs_, first_, second_, T_C1C0_.R(), flip);
      if (flipped.share() < std::max(kFewMatch, 2.0 * best.share())) continue;
      return warning(
          "stereo_flipped",
          fmt::format("the images of {} are {}: so they show what {} sees ({:.0f} % of "
                      "its corners are found; as they are {:.0f} %); turn them, or "
                      "write T_BS as the camera hangs",
                      name1, word, name0, 100.0 * flipped.share(), 100.0 * best.share()));
    }
    return warning("stereo_unmatched",
                   fmt::format("only {:.0f} % of the corners of {} are found in {}, which by T_BS "
                               "sees the same: are its images of another time or another camera, "
                               "turned or mirrored, or are T_BS or its focal length wrong?",
                               100.0 * best.share(), name0, name1));
  }

  DataFindings judgeStamps() const {
    const auto late = lateStampsOfSecond(recording_);
    if (!late) return {};
    const std::string& name = second_.calibration().name;
    return warning(
        "stereo_stamps",
        fmt::format("the images of {} turn as those of {} do {:.2f} s {}: its stamps, or "
                    "the names of its images, are {:.2f} s too {}; fix them, T_BS "
                    "cannot be judged before",
                    name, first_.calibration().name, std::abs(*late),
                    *late > 0 ? "sooner" : "later", std::abs(*late), *late > 0 ? "late" : "early"));
  }

  DataFindings judgeGeometry(const std::vector<StereoMatch>& matches) const {
    constexpr double kFarOff_px = 4.0;
    const double fx = second_.fx();
    const Fit given = fitOf(matches, T_C1C0_, fx);
    if (given.count < kFewestMatches) return {};
    const Turned turned = turnOf(matches, T_C1C0_);
    const RigidTransform turn(expQuaternion(turned.by), Vector3d::Zero());
    const Fit repaired = fitOf(matches, turn * T_C1C0_, fx);
    const bool wrong = given.off_px > kFarOff_px || given.isBehind();
    // Rotation about the vertical axis between the images resembles parallax of both signs.
    const bool mixed = given.behind > kFewestMatches && 3 * given.behind > given.before;
    if (!wrong && !mixed && !isTurned(turned, given, repaired)) return {};
    if (auto late = judgeStamps(); !late.empty()) return late;
    if (isTurned(turned, given, repaired)) return judgeTurned(turned, given);
    const std::string of = fmt::format("T_BS of {}", second_.calibration().name);
    const std::string& name0 = first_.calibration().name;
    if (given.off_px > kFarOff_px) {
      return warning("stereo_epipolar",
                     fmt::format("{} does not fit that of {}: what both see lies {:.0f} px from "
                                 "its epipolar line; write where each camera is on the IMU (not "
                                 "relative to the other camera, nor the inverse), or calibrate",
                                 of, name0, given.off_px));
    }
    if (!given.isBehind()) return {};
    return warning("stereo_wrong_side",
                   fmt::format("{} has it on the wrong side of {}: what both see would be behind "
                               "them; are the folders, or the signs of the baseline, exchanged?",
                               of, name0));
  }

  /// Whether a rotation of cam1 certainly explains the misfit and places the points in front of the
  /// cameras.
  static bool isTurned(const Turned& turned, const Fit& given, const Fit& repaired) {
    constexpr double kLeast_rad = 1.0 / kDegreesOfTurn, kSurely = 6.0, kFits_px = 2.0;
    const double angle = turned.by.norm();
    if (angle < kLeast_rad || angle < kSurely * turned.sigma.norm()) return false;
    const bool better = repaired.off_px < 0.5 * given.off_px || given.isBehind();
    return better && repaired.off_px < kFits_px && repaired.isBefore();
  }

  DataFindings judgeTurned(const Turned& turned, const Fit& given) const {
    const std::string& name0 = first_.calibration().name;
    const std::string& name1 = second_.calibration().name;
    const auto all = static_cast<double>(std::max<std::size_t>(1, given.before + given.behind));
    return warning(
        "stereo_turned",
        fmt::format("T_BS of {} does not fit that of {}: what both see lies {:.1f} px from its "
                    "epipolar line, and {:.0f} % of it beyond infinity; all fits where {} is "
                    "turned by about {:.1f}°{} from there (or {} the other way): calibrate",
                    name1, name0, given.off_px, 100.0 * static_cast<double>(given.behind) / all,
                    name1, kDegreesOfTurn * turned.by.norm(), axisText(turned.by), name0));
  }

  const Recording& recording_;
  const std::vector<StereoImages>& pairs_;
  CameraModel first_, second_;
  RigidTransform T_C1C0_;
};

}  // namespace

DataFindings checkStereo(const Recording& recording) {
  const auto& cameras = recording.calibration.cameras;
  if (cameras.size() < 2) return {};
  // T_BS in millimetres has its own finding.
  if (hasPlaceInMm(cameras[0]) || hasPlaceInMm(cameras[1])) return {};
  const auto pairs = someStereoImages(recording);
  if (pairs.empty()) return {};
  if (areSameImages(pairs)) {
    return warning("stereo_same_images",
                   fmt::format("{} and {} show the same images: see which folder was copied, or "
                               "whether both readers open one camera",
                               cameras[0].name, cameras[1].name));
  }
  return StereoJudge(recording, pairs).judge();
}

}  // namespace perdure::tools
