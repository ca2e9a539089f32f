// Checks the data before a run, and finds the cause if a run has no results.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>

#include "common/base/algorithms/nearest_word.h"
#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "services/vio/cameras.h"
#include "tools/calibrate/motion/from_motion.h"
#include "tools/data_check/data_check.h"
#include "tools/data_check/poses/pose_check.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

/// Returns the largest distance of a pose from the first one (m).
double wayOf(const std::map<std::uint64_t, replay::StampedPose>& poses) {
  double farthest = 0.0;
  for (const auto& [frame, pose] : poses) {
    farthest = std::max(farthest, (pose.T_WB.p - poses.begin()->second.T_WB.p).norm());
  }
  return farthest;
}

/// Lists reasons, for example "image_missing 120 times, image_size 3 times".
std::string listOf(const ReasonCounts& reasons) {
  std::string list;
  for (const auto& [code, n] : reasons.all()) {
    list += fmt::format("{}{} {} times", list.empty() ? "" : ", ", code, n);
  }
  return list;
}

/// Returns the fix for the most frequent reason why vio did not start.
std::string fixOfStart(const ReasonCounts& reasons) {
  std::string most;
  std::uint64_t times = 0;
  for (const auto& [code, n] : reasons.all()) {
    if (n > times) most = code, times = n;
  }
  if (most.empty()) return "there were too few frames or inertial samples before they ended";
  if (most == "start_force_not_gravity") {
    return "the accelerations are not those of gravity and motion: see their unit (m/s²)";
  }
  return "`perdure doctor --data` says more, and the README of vio what the reasons mean";
}

/// Adds warnings about boxes that can be used. The drive's frames are `first` to `last`.
void warnOfBoxes(const replay::DetectionFile& file, const std::string& name, std::uint64_t first,
                 std::uint64_t last, replay::DataFindings& findings) {
  const auto warn = [&](const char* code, const std::string& text) {
    findings.push_back({replay::DataFinding::Grade::kWarning, code, name + ": " + text});
  };
  if (!file.note().empty()) {
    findings.push_back(
        {replay::DataFinding::Grade::kNote, "boxes_from_one", name + ": " + file.note()});
  }
  if (const std::string why = file.whyBeyond(); !why.empty()) {
    warn("boxes_outside", why);
  }
  if (const std::size_t beyond = file.rowsBeyond(last); beyond > 0) {
    warn("boxes_beyond", fmt::format("{} of {} boxes are of frames that this drive ({} … {}) does "
                                     "not have and were left out; see whether they are of it",
                                     beyond, file.rows(), first, last));
  }
}

/// Reasons of the map store after which data are missing in its file.
const std::set<std::string> kUnwritable{"disk_full", "io_error", "read_only", "cannot_open",
                                        "database_error"};

[[noreturn]] void refuse(const std::string& what) { throw StartupError(ExitCode::kData, what); }

/// Throws StartupError with the likely cause why no box became an object. `moved` is the largest
/// distance of a pose from the first one, in metres.
[[noreturn]] void refuseEmptyMap(const PipelineCounts& counts,
                                 const std::optional<Doubt>& box_doubt, double moved) {
  if (counts.detections == 0) {
    refuse(
        fmt::format("nothing was detected in {} frames, so the map is empty: does the network (or "
                    "file) know what is in the images?",
                    counts.frames));
  }
  if (box_doubt) {
    refuse(fmt::format("{} detections in {} frames made no object: {}: {}", counts.detections,
                       counts.frames, box_doubt->what, box_doubt->fix));
  }
  constexpr double kMoved_m = 1.0;
  if (moved < kMoved_m) {
    refuse(
        fmt::format("{} detections in {} frames made no object, so the map is empty: by its "
                    "poses the camera moved by {:.2g} m, from which no distance is known; give "
                    "a part of the drive in which it moves, or see the poses",
                    counts.detections, counts.frames, moved));
  }
  refuse(fmt::format(
      "{} detections in {} frames made no object, so the map is empty: do they belong to "
      "these frames, are they of known classes, and does the camera move past what they "
      "show?",
      counts.detections, counts.frames));
}

}  // namespace

void Pipeline::checkData() {
  if (recorded_) return;
  const auto data = dataOptions();
  findings_ =
      checkDrive(dataset_->recording(), {.images = data.decode, .imu = options_.odometry == "vio"});
  if (options_.odometry == "vio" || options_.landmarks) {
    const auto unknown = vio::unknownCamera(configs_.vio, dataset_->calibration());
    if (!unknown.empty()) {
      findings_.push_back({replay::DataFinding::Grade::kNote, "camera_unknown",
                           unknown + "; set vio.input.cameras to these"});
    }
  }
  if (isSimulated(options_.data)) {
    if (const auto lack = lackOfTruth(options_.data, *dataset_); !lack.empty())
      findings_.push_back({replay::DataFinding::Grade::kNote, "truth_incomplete",
                           lack + "; the report has no scores"});
  }
  replay::refuseFatal(findings_, options_.data);
  if (!pose_file_) return;
  const auto judge = [&](const replay::PoseFile& file) {
    return checkPoses(dataset_->recording(), file, {.images = data.decode});
  };
  auto of_poses = judge(*pose_file_);
  for (auto& finding : of_poses) {  // the user's declaration outweighs the check
    if (options_.odometry_of == "body" && finding.code == "poses_of_camera")
      finding.grade = replay::DataFinding::Grade::kWarning;
  }
  if (options_.odometry_of == "camera" && !of_poses.empty() &&
      judge(replay::PoseFile::read(options_.odometry)).empty()) {
    refuse(options_.odometry +
           ": the poses agree with the drive as those of the body and contradict it as those of "
           "the camera; leave --odometry-of camera out");
  }
  replay::refuseFatal(of_poses, options_.odometry);
  findings_.insert(findings_.end(), of_poses.begin(), of_poses.end());
}

/// Refuses a file of detections without a row for a frame of the data, because rows of other frames
/// are ignored silently.
void Pipeline::checkDetectionFile() {
  const auto& numbers = dataset_->recording().numbers;
  if (numbers.empty() || detection_file_->rows() == 0) return;
  const auto [first_frame, last_frame] =
      std::minmax_element(numbers.begin(), numbers.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
  const std::uint64_t first = first_frame->second, last = last_frame->second;
  if (detection_file_->hasSizes()) {
    refuse(options_.detections +
           ": x2 and y2 are the same in nearly all rows while x1 moves, so they are a width and a "
           "height; write x1 + width and y1 + height in their place");
  }
  if (detection_file_->firstFrame() > last || detection_file_->lastFrame() < first) {
    refuse(fmt::format(
        "{}: none of its {} rows is of a frame of this drive ({} … {}), they are of {} … "
        "{}; its first column (COCO: `file_name`, else `id`) must count the drive's frames from 0",
        options_.detections, detection_file_->rows(), first, last, detection_file_->firstFrame(),
        detection_file_->lastFrame()));
  }
  if (first == 0 && detection_file_->firstFrame() == 1 &&
      detection_file_->lastFrame() == last + 1) {
    refuse(
        fmt::format("{}: its frames are 1 … {}, those of the drive 0 … {}: they count from 1; "
                    "subtract 1 from each",
                    options_.detections, last + 1, last));
  }
  if (const std::string why = detection_file_->whyOutside(); !why.empty()) {
    refuse(options_.detections + ": " + why);
  }
  warnOfBoxes(*detection_file_, options_.detections, first, last, findings_);
}

/// Warns of classes without a prior, whose objects get the broad fallback.
void Pipeline::checkClasses() {
  std::vector<std::string> known;
  for (const auto& prior : priors_.classes) known.push_back(prior.name);
  std::string names;
  constexpr std::size_t kFew = 10;  // of a tenth of the boxes nothing need be said
  for (const auto& [name, rows] : detection_file_->classCounts()) {
    if (std::ranges::find(known, name) != known.end() || name == priors_.other.name) continue;
    const std::string near = nearestWord(name, known);
    if (near.empty() && !replay::parseNumber(name) && kFew * rows < detection_file_->rows())
      continue;
    names += fmt::format("{}{} ({} boxes{})", names.empty() ? "" : ", ", name, rows,
                         replay::parseNumber(name) ? ", a number: write the name"
                         : near.empty()            ? std::string()
                                                   : "; do you mean " + near + "?");
  }
  if (names.empty()) return;
  findings_.push_back(
      {replay::DataFinding::Grade::kWarning, "classes_unknown",
       fmt::format("{}: no size is known of the class {}; {} lists those that are known; add it",
                   options_.detections, names, configs_.semantic_filter.class_priors)});
}

std::vector<EstimatedHeight> Pipeline::estimatedHeights() const {
  constexpr int kHeight = 6;
  std::vector<EstimatedHeight> heights;
  for (const auto& object : outputs_->history().lastBeliefs()) {
    const ClassBelief& best = object.best();
    const auto& prior = priors_.of(best.name);
    if (!object.confirmed || prior.name.empty()) continue;
    heights.push_back({best.mean[kHeight] - prior.log_size.z(),
                       std::sqrt(best.covariance(kHeight, kHeight)),
                       std::sqrt(prior.log_size_covariance(2, 2))});
  }
  return heights;
}

void Pipeline::refuseUnwritten() const {
  for (const auto& [service, reasons] : reasons()) {
    for (const auto& [code, n] : reasons.all()) {
      const bool store = service == "map_store" && kUnwritable.contains(code);
      const bool run = service == "pipeline" && code.starts_with("run_") &&
                       (code.ends_with("disk_full") || code.ends_with("_file"));
      if (!store && !run) continue;
      throwUnwritten(outputs_->folder() / (store ? "map.sqlite" : "run.mcap"),
                     code.ends_with("disk_full") ? "no space left on device" : code);
    }
  }
}

/// If vio's results are doubtful without a known cause, adds what the motion shows about the lens
/// and the stamps.
void Pipeline::judgeMotion() {
  const replay::Recording& recording = dataset_->recording();
  if (!findings_.empty() || recording.imu.empty() || doubts().empty()) return;
  findings_ = calibrate::checkMotion(recording).findings;
  for (auto& finding : findings_) finding.code.insert(0, "motion_");
}

Doubts Pipeline::doubts() const {
  const ReasonCounts of_vio = vio_           ? vio_->reasons()
                              : known_poses_ ? known_poses_->reasons()
                                             : ReasonCounts();
  auto doubts = doubtsOfRun({.vio = of_vio,
                             .frames = counts_.frames,
                             .capture = dataset_->reasons(),
                             .poses = vio_ ? std::optional(counts_.odometry) : std::nullopt,
                             .without_pose = reasons_.of("frame_without_pose"),
                             .boxes = counts_.detections,
                             .objects = outputs_->history().lastBeliefs().size(),
                             .findings = findings_});
  if (rig_watch_ && doubts.empty()) {
    for (const auto& judgement : calibrate::judgeBelief(rig_watch_->check(of_vio))) {
      if (judgement.grade == calibrate::Grade::kBad)
        doubts.push_back({"the rig, or an axis of the IMU, does not fit the run", judgement.text});
    }
  }
  if (box_doubt_) doubts.push_back(*box_doubt_);
  if (!options_.map.empty() && map_->reasons().of("relocalised") == 0) {
    doubts.push_back({"this run was not found on the given map",
                      "its objects are new ones beside those of the map; it is another place, or "
                      "too few of the map's objects were seen again"});
  }
  return doubts;
}

void Pipeline::refuseNothing() const {
  const auto& recording = dataset_->recording();
  const std::string counted = listOf(dataset_->reasons());
  if (counts_.frames == 0) {
    if (recorded_)
      refuse(options_.data + " holds no odometry that can be read; record it, or run vio");
    refuse(fmt::format("{}: none of {} frames could be used ({}){}", options_.data,
                       recording.frame_count, counted.empty() ? "there are none" : counted,
                       dataset_->lastProblem().empty() ? std::string()
                                                       : "; the last: " + dataset_->lastProblem()));
  }
  if (counts_.frames == 1 && options_.every > 1) {
    refuse(
        fmt::format("--every {} leaves one frame, and no distance is known from one; give a "
                    "smaller number",
                    options_.every));
  }
  if (counts_.odometry == 0 && pose_file_ && !recording.frames.empty() &&
      pose_file_->format() == replay::PoseFormat::kTum) {
    refuse(timesBeside(recording, pose_file_->poses()));
  }
  if (counts_.odometry == 0) {
    const ReasonCounts reasons = vio_ ? vio_->reasons() : ReasonCounts();
    refuse(fmt::format("no pose came of {} frames ({}{}{}): {}", counts_.frames, counted,
                       counted.empty() ? "" : "; ", listOf(reasons), fixOfStart(reasons)));
  }
  if (options_.detections == "none") return;
  // Objects existed during the run, so an empty map at the end is no fault of the data.
  const ObjectHistory& history = outputs_->history();
  if (!history.lastBeliefs().empty() || !history.inst().empty()) return;
  refuseEmptyMap(counts_, box_doubt_, wayOf(outputs_->poses()));
}

}  // namespace perdure::tools
