// `perdure evaluate trajectory`: compares a TUM file with a pose file or a dataset's truth.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/replay/dataset.h"
#include "tools/evaluate/command.h"
#include "tools/evaluate/trajectory_score.h"
#include "tools/evaluate/used_frames.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::PoseFile;
using replay::PoseFormat;

constexpr char kTruthFix[] = "--truth takes a file of poses or a dataset folder";

struct TrajectoryOptions {
  std::string truth, sequence, tum, data, align = "yaw";
  double skip_s = 0.0;
  bool json = false;
};

/// True poses by time, and the times at which a pose is expected (empty if unknown).
struct Truth {
  PoseFile poses{PoseFormat::kTum, {}};
  std::vector<TimePoint> frames;
  std::vector<std::uint64_t> numbers;  ///< numbers of the frames
};

void readFrames(const std::string& folder, const std::string& sequence,
                std::optional<PoseFile>* own, Truth& truth) {
  replay::DatasetOptions options;
  options.path = folder;
  options.sequence = sequence;
  options.decode = false;
  const auto dataset = replay::Dataset::open(options);
  if (own != nullptr) *own = dataset->truth();
  truth.frames.clear();
  truth.numbers.clear();
  for (std::uint64_t i = 0; i < dataset->frameCount(); ++i) {
    const auto time = dataset->frameTime(i);
    if (!time) continue;
    truth.frames.push_back(*time);
    truth.numbers.push_back(i);
  }
}

/// Adds times to KITTI's lines: the times of `frames`, or if there are none, 10 Hz from 0.
PoseFile withTimes(const PoseFile& file, const std::vector<TimePoint>& frames) {
  if (file.format() == PoseFormat::kTum) return file;
  std::vector<replay::StampedPose> poses = file.poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto tenths = static_cast<std::int64_t>(i) * std::chrono::milliseconds(100);
    poses[i].time = frames.empty() ? TimePoint(tenths) : frames[std::min(i, frames.size() - 1)];
  }
  if (!frames.empty() && poses.size() > frames.size()) poses.resize(frames.size());
  return PoseFile(PoseFormat::kTum, std::move(poses));
}

Truth readTruth(const TrajectoryOptions& options) {
  Truth truth;
  std::optional<PoseFile> own;
  if (!options.data.empty()) readFrames(options.data, options.sequence, nullptr, truth);
  if (fs::is_directory(options.truth)) {
    readFrames(options.truth, options.sequence, &own, truth);
    if (!own) {
      throw StartupError(ExitCode::kUnavailable,
                         options.truth + " holds no true trajectory; give a pose file to --truth");
    }
  }
  truth.poses = withTimes(own ? *own : PoseFile::read(options.truth, kTruthFix), truth.frames);
  return truth;
}

struct Compared {
  TrajectoryScore score;
  double coverage = 0.0;
  std::size_t expected = 0;
  std::size_t left_out = 0;  ///< frames that the run skipped
  std::size_t untold = 0;    ///< frames between poses that lack one, for unknown reasons
};

/// Removes the times of frames that the run skipped, and returns their number. Removes nothing if a
/// pose has such a time.
std::size_t leaveOutUnused(const fs::path& run, const PoseFile& poses, Truth& truth) {
  const auto used = usedFramesOf(run);
  if (!used) return 0;
  std::set<TimePoint> posed;
  for (const auto& pose : poses.poses()) posed.insert(pose.time);
  std::vector<TimePoint> kept;
  for (std::size_t i = 0; i < truth.frames.size(); ++i) {
    if (used->contains(truth.numbers[i]))
      kept.push_back(truth.frames[i]);
    else if (posed.contains(truth.frames[i]))
      return 0;
  }
  const std::size_t left_out = truth.frames.size() - kept.size();
  truth.frames = std::move(kept);
  return left_out;
}

Alignment alignmentOf(const std::string& name) {
  if (name == "start") return Alignment::kStart;
  return name == "yaw" ? Alignment::kYaw : Alignment::kRigid;
}

const char* nameOf(Alignment alignment) {
  return nameAt(std::array{"aligned in position and yaw", "aligned in position and rotation",
                           "aligned at the start"},
                alignment);
}

Compared compare(const TrajectoryOptions& options) {
  Truth truth = readTruth(options);
  const PoseFile file = PoseFile::read(options.tum, "`perdure pipeline` writes trajectory.tum");
  if (file.format() != PoseFormat::kTum) {
    throw StartupError(ExitCode::kUsage, options.tum + " is no TUM file: t x y z qx qy qz qw");
  }
  const auto& poses = truth.poses.poses();
  const auto& frames = truth.frames;
  const fs::path run = fs::path(options.tum).parent_path();
  const std::size_t left_out = leaveOutUnused(run, file, truth);
  const TimePoint begin = (frames.empty() ? file.poses().front().time : frames.front()) +
                          durationFromSeconds(options.skip_s);
  std::vector<PosePair> pairs;
  for (const auto& pose : file.poses()) {
    if (pose.time < begin) continue;
    const auto there = truth.poses.at(0, pose.time);
    if (there) pairs.push_back({pose.time, pose.T_WB, *there});
  }
  if (pairs.size() < 2) {
    throw StartupError(ExitCode::kUnavailable,
                       options.tum + " and " + options.truth +
                           " have fewer than two times in common; name the dataset with --data "
                           "where the truth has no times");
  }
  Compared result;
  result.left_out = left_out;
  if (!usedFramesOf(run)) result.untold = withoutPose(frames, file.poses());
  result.score = scoreTrajectory(pairs, alignmentOf(options.align));
  // A pose is expected for the dataset's frames within the time span of the ground truth.
  const auto expected = [&](TimePoint t) {
    return t >= begin && t >= poses.front().time && t <= poses.back().time;
  };
  for (const TimePoint t : frames) result.expected += expected(t) ? 1 : 0;
  if (frames.empty()) result.expected = pairs.size();
  result.coverage =
      std::min(1.0, static_cast<double>(pairs.size()) /
                        static_cast<double>(std::max<std::size_t>(1, result.expected)));
  return result;
}

nlohmann::ordered_json toJson(const Compared& result) {
  const TrajectoryScore& s = result.score;
  return {{"poses", s.poses},
          {"frames_expected", result.expected},
          {"frames_left_out", result.left_out},
          {"frames_untold", result.untold},
          {"coverage", result.coverage},
          {"length_m", s.length_m},
          {"ate_rmse_m", s.ate_rmse_m},
          {"ate_max_m", s.ate_max_m},
          {"ate_rotation_deg", s.ate_rotation_deg},
          {"rpe_1s_m", s.rpe_m},
          {"rpe_1s_deg", s.rpe_deg},
          {"end_drift_m", s.end_drift_m},
          {"segments", s.segments.segments},
          {"segment_lengths_m", s.segments.lengths_m},
          {"t_err_percent", s.segments.t_err_percent},
          {"r_err_deg_per_m", s.segments.r_err_deg_per_m}};
}

void print(const Compared& result, const TrajectoryOptions& options) {
  const TrajectoryScore& s = result.score;
  fmt::print("poses {} of {} frames (coverage {:.4f}), {:.1f} m\n", s.poses, result.expected,
             result.coverage, s.length_m);
  if (result.left_out > 0) {
    fmt::print(
        "{} frames are not expected: the run was not over them (--every, --from, "
        "--seconds)\n",
        result.left_out);
  }
  if (result.untold > 0) fmt::print("{}\n", noteOfUntold(result.untold));
  fmt::print("ATE ({}): RMSE {:.4f} m, max {:.4f} m, rotation {:.3f} deg\n",
             nameOf(alignmentOf(options.align)), s.ate_rmse_m, s.ate_max_m, s.ate_rotation_deg);
  fmt::print("RPE over 1 s: {:.4f} m, {:.3f} deg; drift at the end {:.4f} m\n", s.rpe_m, s.rpe_deg,
             s.end_drift_m);
  fmt::print("KITTI: t_err {:.3f} %, r_err {:.5f} deg/m ({} segments of {:g} to {:g} m)\n",
             s.segments.t_err_percent, s.segments.r_err_deg_per_m, s.segments.segments,
             s.segments.lengths_m.front(), s.segments.lengths_m.back());
}

}  // namespace

void addEvaluateTrajectory(CLI::App& evaluate_app) {
  auto options = std::make_shared<TrajectoryOptions>();
  CLI::App* app = evaluate_app.add_subcommand("trajectory", "ATE, RPE and KITTI's segment errors");
  app->add_option("tum", options->tum, "trajectory.tum of a run")->required();
  app->add_option("--truth", options->truth, "TUM or KITTI pose file, or a dataset folder")
      ->required();
  app->add_option("--sequence", options->sequence, "Of a KITTI tracking folder");
  app->add_option("--data", options->data, "Dataset folder whose frames time KITTI's pose lines");
  app->add_option("--align", options->align,
                  "Alignment besides position; start: the first pose's position and yaw alone")
      ->check(CLI::IsMember({"yaw", "rigid", "start"}))
      ->capture_default_str();
  app->add_option("--skip", options->skip_s, "Seconds at the start to leave out")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app->add_flag("--json", options->json, "Print JSON");
  app->callback([options] {
    const Compared result = compare(*options);
    if (options->json)
      std::cout << toJson(result).dump(2) << std::endl;
    else
      print(result, *options);
  });
}

}  // namespace perdure::tools
