#include "tools/calibrate/motion/from_motion.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "tools/data_check/data_check.h"
#include "tools/data_check/image_turn.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::calibrate {
namespace {

constexpr double kDegrees = 180.0 / M_PI;
constexpr double kFree = std::numeric_limits<double>::infinity();
constexpr double kUnseen =
    0.7;  ///< share of a prior's deviation above which the motion shows nothing

/// Limits of real rigs: readout of phones below 35 ms, principal point within 1 %, bias below 0.05
/// rad/s.
JointVector widePriors(const CameraCalibration& camera) {
  JointVector sigma;
  const double centre = 0.01 * camera.width;
  sigma << kFree, kFree, kFree, kFree, 0.03, 0.05, 0.05, 0.05, kFree, centre, centre, 0.2, 0.1,
      0.05, 0.05, 0.05;
  return sigma;
}

double rotationSigma(const JointVector& sigma) { return kDegrees * sigma.head<3>().norm(); }

Result<TrackWindows> windowsOf(const replay::Recording& recording, const WindowOptions& options) {
  constexpr std::size_t kFewest = 6;
  TrackWindows found = trackWindows(recording, options);
  if (found.windows.size() >= kFewest) return found;
  if (found.blank > 0) {
    return fail("motion_blank",
                fmt::format("{} of {} stretches of images show fewer than 15 corners that can be "
                            "followed: blank walls, darkness, blur or unreadable images; record "
                            "again in light, with things to see",
                            found.blank, found.blank + found.windows.size()));
  }
  return fail("motion_few_images",
              "images and inertial samples have less than three seconds in common; record half a "
              "minute, with both running");
}

const char* kMotion =
    "turn the camera to and fro about all three axes for half a minute, by 30 degrees and about "
    "once in two seconds, with things to see in the image";

/// Whether a gyroscope with all signs inverted would fit; this also detects one inverted sign.
bool isMirrored(const TrackWindows& tracks, const replay::Recording& recording,
                const FirstGuess& guess) {
  constexpr double kDoubtful = 0.1, kClearly = 3.0;
  if (guess.unexplained < kDoubtful) return false;
  std::vector<ImuSample> mirrored = recording.imu;
  for (ImuSample& sample : mirrored) sample.gyro = -sample.gyro;
  const auto other =
      guessFromTurns(tracks.windows, mirrored, recording.calibration.cameras.front());
  return kClearly * other.unexplained < guess.unexplained;
}

Result<FirstGuess> guessOf(const TrackWindows& tracks, const replay::Recording& recording) {
  constexpr double kLeast_px = 0.4, kApart = 0.5;
  const bool dead = std::ranges::all_of(
      recording.imu, [](const ImuSample& sample) { return sample.gyro.isZero(); });
  if (dead) {
    return fail("motion_gyro_dead",
                "all angular rates of the gyroscope are 0; see its driver or its columns");
  }
  const auto guess =
      guessFromTurns(tracks.windows, recording.imu, recording.calibration.cameras.front());
  if (guess.pairs == 0 || guess.turning_px < kLeast_px) {
    return fail("motion_no_rotation", "the camera hardly turns ({:.2f} px from image to image); {}",
                guess.turning_px, kMotion);
  }
  if (isMirrored(tracks, recording, guess)) {
    return fail(
        "motion_mirrored",
        "the gyroscope turns as the mirror image of the images, which no mounting explains: "
        "one of its axes, or all three, have the wrong sign; see the driver's axes, or "
        "negate one of the columns w_x, w_y, w_z");
  }
  if (guess.unexplained > kApart) {
    return fail("motion_apart",
                "the gyroscope does not turn as the images do, with any focal length, mounting and "
                "offset within half a second ({:.0f} % of the turning disagrees): see that both "
                "are of one recording and of one clock, that columns have their order and signs, "
                "and that the images show more than moving things",
                100.0 * guess.unexplained);
  }
  if (guess.second_px < kLeast_px) {
    return fail("motion_no_rotation",
                fmt::format("the camera turns about one axis only (about the second by {:.2f} px "
                            "from image to image); {}",
                            guess.second_px, kMotion));
  }
  return guess;
}

CameraCalibration startOf(const FirstGuess& guess) {
  CameraCalibration camera = guess.camera;
  camera.cx = 0.5 * (camera.width - 1.0), camera.cy = 0.5 * (camera.height - 1.0);
  camera.distortion = DistortionModel::kRadialTangential;
  camera.distortion_coefficients.assign(4, 0.0);
  camera.T_BC.p.setZero();
  camera.readout_s = 0.0;
  return camera;
}

/// The parameters that every use needs and that are too uncertain; empty if all are certain.
std::string unsureOf(const JointEstimate& joint) {
  constexpr double kFocal_share = 0.015, kTurn_deg = 1.5, kLater_s = 0.004, kResidual_px = 3.0;
  const JointVector& s = joint.sigma;
  std::string unsure;
  const auto add = [&](bool bad, const std::string& what) {
    if (bad) unsure += (unsure.empty() ? "" : ", ") + what;
  };
  add(!(joint.residual_px < kResidual_px),
      fmt::format("corners miss their places by {:.1f} px", joint.residual_px));
  add(!(s[kFocal] < kFocal_share), fmt::format("focal length ± {:.1f} %", 100.0 * s[kFocal]));
  add(!(rotationSigma(s) < kTurn_deg), fmt::format("rotation ± {:.1f}°", rotationSigma(s)));
  add(!(s[kLater] < kLater_s), fmt::format("time offset ± {:.1f} ms", 1e3 * s[kLater]));
  return unsure;
}

struct Pair {
  TimePoint from, to;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> pixels;
};

std::vector<Pair> pairsOf(const std::vector<TrackWindow>& windows) {
  constexpr std::size_t kMost = 200, kFewest = 15;
  std::vector<Pair> all;
  for (const TrackWindow& window : windows) {
    for (std::size_t i = 1; i < window.times.size(); ++i) {
      Pair pair{window.times[i - 1], window.times[i], {}};
      for (const Track& track : window.tracks) {
        if (track.size() > i) pair.pixels.emplace_back(track[i - 1], track[i]);
      }
      if (pair.pixels.size() >= kFewest) all.push_back(std::move(pair));
    }
  }
  const std::size_t each = all.size() / kMost + 1;
  std::vector<Pair> some;
  for (std::size_t i = 0; i < all.size(); i += each) some.push_back(std::move(all[i]));
  return some;
}

Eigen::Vector3d turnOf(const Pair& pair, double focal, const CameraCalibration& camera) {
  const Eigen::Vector2d centre(0.5 * (camera.width - 1.0), 0.5 * (camera.height - 1.0));
  const auto rayOf = [&](const Eigen::Vector2d& pixel) {
    return Eigen::Vector3d(((pixel - centre) / focal).homogeneous().normalized());
  };
  std::vector<tools::Flow> flow;
  for (const auto& [a, b] : pair.pixels) flow.push_back({rayOf(a), rayOf(b) - rayOf(a)});
  return tools::rotationOf(flow);
}

/// The gyroscope's rotations at one time offset, and the indices of the pairs that it covers.
struct Said {
  double offset_s = 0.0;
  std::vector<std::size_t> pairs;
  std::vector<Eigen::Vector3d> turns;
};

std::vector<Said> saidAt(const std::vector<Pair>& pairs, const std::vector<ImuSample>& samples) {
  constexpr int kSteps = 100;
  constexpr double kStep_s = 0.005;
  const tools::TurnIntegral gyro(samples);
  std::vector<Said> all;
  for (int step = -kSteps; step <= kSteps; ++step) {
    Said said{kStep_s * step, {}, {}};
    const Duration later = durationFromSeconds(said.offset_s);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!gyro.covers(pairs[i].from + later, pairs[i].to + later)) continue;
      said.pairs.push_back(i);
      said.turns.push_back(gyro.between(pairs[i].from + later, pairs[i].to + later));
    }
    if (2 * said.pairs.size() > pairs.size()) all.push_back(std::move(said));
  }
  return all;
}

/// Deviations for vio, which refines the rig. Stretches share the error of the lens model, which
/// their scatter does not show: on EuRoC clips the errors are up to seven reported deviations.
CameraDeviations deviationsOf(const JointVector& sigma) {
  const auto of = [&](int first, int count, double least) {
    return std::max(least, 3.0 * sigma.segment(first, count).maxCoeff());
  };
  return {of(kFocal, 1, 0.003), of(kCentre, 2, 2.0), of(kDistortion, 2, 0.005),
          of(kTurnOf, 3, 0.01), of(kPlace, 3, 0.01), of(kLater, 1, 0.005)};
}

}  // namespace

Result<MotionRig> rigFromMotion(const replay::Recording& recording, const WindowOptions& options) {
  const auto tracks = windowsOf(recording, options);
  if (!tracks) return tl::unexpected(tracks.error());
  const auto guess = guessOf(*tracks, recording);
  if (!guess) return tl::unexpected(guess.error());
  MotionRig found;
  JointOptions joint{{startOf(*guess), Eigen::Vector3d::Zero()}, widePriors(guess->camera)};
  found.joint = estimateJointly(tracks->windows, recording.imu, joint);
  if (const auto unsure = unsureOf(found.joint); !unsure.empty()) {
    return fail("motion_unsure", "the motion does not show enough ({}); {}", unsure, kMotion);
  }
  found.prior_sigma = joint.prior_sigma;
  found.rig.cameras = {found.joint.state.camera};
  // A read-out time that does not differ from 0 is that of a global shutter.
  double& readout_s = found.rig.cameras[0].readout_s;
  if (readout_s < 3.0 * found.joint.sigma[kReadout]) readout_s = 0.0;
  found.rig.cameras[0].deviations = deviationsOf(found.joint.sigma);
  found.rig.imu = recording.calibration.imu;
  found.images = tracks->images;
  found.second_px = guess->second_px;
  return found;
}

std::vector<std::string> linesOf(const MotionRig& found) {
  const CameraCalibration& c = found.joint.state.camera;
  const JointVector& s = found.joint.sigma;
  const auto shown = [&](int first, int count) {
    for (int i = first; i < first + count; ++i) {
      if (s[i] < kUnseen * found.prior_sigma[i]) return "";
    }
    return "  (not shown by the motion: stays at what is usual)";
  };
  const Eigen::Quaterniond& q = c.T_BC.q;
  const Eigen::Vector3d &p = c.T_BC.p, &b = found.joint.state.gyro_bias;
  return {
      fmt::format("focal length      {:.1f} ± {:.1f} px", c.fx, s[kFocal] * c.fx),
      fmt::format("principal point   {:.1f} ± {:.1f}, {:.1f} ± {:.1f} px{}", c.cx, s[kCentre], c.cy,
                  s[kCentre + 1], shown(kCentre, 2)),
      fmt::format("distortion        k1 {:.3f} ± {:.3f}, k2 {:.3f} ± {:.3f}{}",
                  c.distortion_coefficients[0], s[kDistortion], c.distortion_coefficients[1],
                  s[kDistortion + 1], shown(kDistortion, 2)),
      fmt::format("rotation          [{:.4f}, {:.4f}, {:.4f}, {:.4f}] (x y z w, camera in body) ± "
                  "{:.2f}°",
                  q.x(), q.y(), q.z(), q.w(), rotationSigma(s)),
      fmt::format("position          [{:.3f}, {:.3f}, {:.3f}] ± [{:.3f}, {:.3f}, {:.3f}] m{}",
                  p.x(), p.y(), p.z(), s[kPlace], s[kPlace + 1], s[kPlace + 2], shown(kPlace, 3)),
      fmt::format("time offset       {:.1f} ± {:.1f} ms", 1e3 * c.time_offset_s, 1e3 * s[kLater]),
      fmt::format("readout           {:.1f} ± {:.1f} ms{}", 1e3 * c.readout_s, 1e3 * s[kReadout],
                  shown(kReadout, 1)),
      fmt::format("gyroscope bias    [{:.4f}, {:.4f}, {:.4f}] ± [{:.4f}, {:.4f}, {:.4f}] rad/s",
                  b.x(), b.y(), b.z(), s[kBias], s[kBias + 1], s[kBias + 2]),
      fmt::format("from              {} stretches of {} images, turning by {:.1f} px about the "
                  "second axis from image to image; residual {:.2f} px",
                  found.joint.windows, found.images, found.second_px, found.joint.residual_px)};
}

MotionRig writeMotionRig(const replay::DatasetOptions& drive, const WindowOptions& options,
                         const std::filesystem::path& file) {
  replay::DatasetOptions data = drive;
  data.uncalibrated = true;
  const auto dataset = replay::Dataset::open(data);
  const replay::Recording& recording = dataset->recording();
  const std::string where = drive.path.string() + ": ";
  if (recording.imu.empty() || recording.calibration.cameras.empty()) {
    throw StartupError(ExitCode::kData, "{}{}; record images and IMU together", where,
                       recording.imu.empty() ? "has no inertial samples" : "has no camera");
  }
  const auto doubts = replay::checkData(recording, {});
  replay::refuseFatal(doubts, drive.path.string());
  tools::printDoubts(recording, doubts);
  auto found = rigFromMotion(recording, options);
  if (!found) throw StartupError(ExitCode::kData, where + found.error().detail);
  std::string comment = "written by perdure calibrate from-motion:";
  for (const auto& line : linesOf(*found)) comment += "\n  " + line;
  writeChecked(file, replay::rigText(found->rig, comment));
  return std::move(*found);
}

FirstGuess guessFromTurns(const std::vector<TrackWindow>& windows,
                          const std::vector<ImuSample>& samples, const CameraCalibration& camera) {
  constexpr double kLeast = 0.4, kMost = 2.5, kRatio = 1.15;  // tested focal lengths, widths
  FirstGuess best;
  best.camera = camera;
  const auto pairs = pairsOf(windows);
  const auto said = saidAt(pairs, samples);
  for (double focal = kLeast; focal < kMost; focal *= kRatio) {
    std::vector<Eigen::Vector3d> turns;
    for (const Pair& pair : pairs) turns.push_back(turnOf(pair, focal * camera.width, camera));
    for (const Said& one : said) {
      std::vector<Eigen::Vector3d> seen;
      for (const std::size_t i : one.pairs) seen.push_back(turns[i]);
      const tools::TurnPairs both(seen, one.turns);
      const Eigen::Matrix3d R_CB = both.bestRotation();
      const double unexplained = both.disagreementBy(R_CB);
      if (unexplained >= best.unexplained) continue;
      best.unexplained = unexplained;
      best.pairs = both.count();
      best.camera.fx = best.camera.fy = focal * camera.width;
      best.camera.T_BC.q = Eigen::Quaterniond(Eigen::Matrix3d(R_CB.transpose()));
      best.camera.time_offset_s = one.offset_s;
      const Eigen::Vector3d spread =
          Eigen::JacobiSVD<Eigen::Matrix3Xd>(both.given).singularValues() /
          std::sqrt(static_cast<double>(both.count()));
      best.turning_px = spread.norm() * best.camera.fx;
      best.second_px = spread[1] * best.camera.fx;
    }
  }
  return best;
}

}  // namespace perdure::calibrate
