#include "tools/pipeline/report.h"

#include <filesystem>
#include <set>

#include "common/base/ids.h"
#include "tools/data_check/data_check.h"
#include "tools/evaluate/object_report.h"
#include "tools/evaluate/object_score.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/evaluate/used_frames.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json serviceCounts(std::uint64_t in, std::uint64_t out, std::uint64_t dropped) {
  return {{"frames_in", in}, {"frames_out", out}, {"dropped", dropped}, {"restarts", 0}};
}

Json services(const Pipeline& pipeline, const std::map<std::string, ReasonCounts>& reasons) {
  const PipelineCounts& counts = pipeline.counts();
  Json json;
  const std::uint64_t lost = imagesLost(reasons.at("capture"));
  json["capture"] = serviceCounts(counts.frames + lost, counts.frames, lost);
  json["vio"] = serviceCounts(counts.frames, counts.odometry,
                              counts.frames - std::min(counts.frames, counts.odometry));
  json["inference"] =
      serviceCounts(pipeline.usesModel() ? counts.frames : counts.inferred, counts.inferred, 0);
  json["semantic_filter"] = serviceCounts(
      counts.odometry, counts.objects, counts.odometry - std::min(counts.odometry, counts.objects));
  for (const auto& [service, counted] : reasons) {
    if (counted.all().empty()) continue;
    json[service]["reasons"] = counted.all();
  }
  return json;
}

void copyTruth(const fs::path& from, const fs::path& to, const std::string& sequence) {
  std::error_code ignored;
  for (const char* folder : {"label_02", "calib"}) {
    fs::create_directories(to / folder, ignored);
    fs::copy_file(from / folder / (sequence + ".txt"), to / folder / (sequence + ".txt"),
                  fs::copy_options::overwrite_existing, ignored);
  }
}

/// The frames of the data that this run used, numbered as in the CSV files.
std::set<std::uint64_t> usedFrames(const Pipeline& pipeline) {
  if (const auto& recorded = pipeline.recordedFrames()) return *recorded;
  std::set<std::uint64_t> used;
  for (const auto& frame : pipeline.dataset().recording().frames) {
    const bool late = pipeline.endFrame() && frame.index >= *pipeline.endFrame();
    if (frame.index >= pipeline.firstFrame() && !late) used.insert(frame.index);
  }
  return used;
}

Json objectScore(const PipelineOptions& options, const fs::path& labels_file,
                 const std::set<std::uint64_t>& used) {
  const fs::path out = options.out;
  const auto labels = replay::readKittiLabels(labels_file);
  auto calibration = replay::readTrackingCalibration(fs::path(options.data) / "calib" /
                                                     (options.sequence + ".txt"));
  const auto size = replay::trackingImageSize(options.sequence);
  calibration.width = options.image_size.empty() ? size.width : options.image_size[0];
  calibration.height = options.image_size.empty() ? size.height : options.image_size[1];
  auto rows = readObjectRows(out / "objects_final.csv");
  const auto poses =
      posesByFrame(replay::PoseFile::read(out / "trajectory.tum").poses(), rows, used);
  std::erase_if(rows, [](const EstimateRow& row) { return row.class_name != "car"; });
  auto truth = sortTruth(labels, staticTracks(labels, calibration.T_RI, poses));
  std::erase_if(truth, [&](const auto& frame) { return !used.contains(frame.first); });
  return toReport(scoreObjects(rows, truth, poses, calibration, {}));
}

}  // namespace

Json makeReport(const Pipeline& pipeline, const PipelineOptions& options) {
  Json report = {{"program", "perdure pipeline"},
                 {"version", PERDURE_VERSION},
                 {"configuration", toHex(pipeline.configurationDigest())},
                 {"data", options.data},
                 {"sequence", options.sequence},
                 {"odometry", options.odometry},
                 {"detections", options.detections},
                 {"every", options.every},
                 {"model", options.model}};
  report["data_check"] = {{"notes", pipeline.dataset().recording().notes},
                          {"findings", toJson(pipeline.findings())}};
  report["doubts"] = toJson(pipeline.doubts());
  report["frames"] = framesToJson(usedFrames(pipeline));
  const auto& latency = pipeline.counts().latency_ms;
  report["services"] = services(pipeline, pipeline.reasons());
  report["latency_ms"] = {{"median", quantile(latency, 0.5)}, {"p99", quantile(latency, 0.99)}};
  const fs::path labels = fs::path(options.data) / "label_02" / (options.sequence + ".txt");
  const bool has_truth =
      pipeline.dataset().kind() == replay::DatasetKind::kKittiTracking && fs::exists(labels);
  if (pipeline.outputs().odometryFrames() == 0) return report;
  if (isSimulated(options.data) && lackOfTruth(options.data, pipeline.dataset()).empty())
    report["objects"] = reportSimulated(options.data, options.out, usedFrames(pipeline));
  if (has_truth) {
    report["objects"] = objectScore(options, labels, usedFrames(pipeline));
    copyTruth(options.data, fs::path(options.out) / "truth", options.sequence);
  }
  return report;
}

}  // namespace perdure::tools
