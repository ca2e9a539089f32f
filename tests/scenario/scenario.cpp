#include "tests/scenario/scenario.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/ids.h"
#include "common/math/so3.h"
#include "common/types/objects.h"
#include "tests/scenario/scene_cache.h"
#include "tools/pipeline/pipeline.h"
#include "tools/pipeline/report.h"
#include "tools/simulate/simulate.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;

std::string textOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

Journal runPipeline(const Setting& setting, const fs::path& folder, const fs::path& out) {
  tools::PipelineOptions options;
  options.data = folder.string();
  options.odometry = setting.images ? "vio" : "truth";
  options.detections = "simulated";
  options.seed = setting.detections_seed;
  options.out = out.string();
  options.assignments = setting.assignments;
  tools::Pipeline pipeline(options);
  Journal journal;
  pipeline.listen([&](const Objects& objects) { journal.add(objects); });
  pipeline.run([](const tools::PipelineCounts&) {});
  pipeline.finish();
  return journal;
}

tools::ObjectScore scoreOf(const Outcome& run, const std::vector<tools::EstimateRow>& rows,
                           const std::vector<replay::StampedPose>& trajectory) {
  return tools::scoreFrames(tools::pairWithTruth(run.truth, rows, trajectory, "").frames,
                            {.frame_interval_s = run.truth.frameInterval()});
}

/// Transforms poses from the estimate's W to the truth's; the identity for exact poses.
void takeToTruth(Outcome& run, const std::vector<replay::StampedPose>& trajectory) {
  if (!run.setting.images) return;
  std::map<TimePoint, RigidTransform> poses;
  for (const auto& pose : trajectory) poses[pose.time] = pose.T_WB;
  const auto at = [&](TimePoint time) {
    const auto pose = poses.find(time);
    return pose == poses.end() ? RigidTransform() : run.toTruth(time, pose->second);
  };
  for (auto* rows : {&run.inst_rows, &run.final_rows}) {
    for (auto& row : *rows) {
      const RigidTransform T = at(row.time);
      row.centre_W = T * row.centre_W;
      row.yaw = wrapAngle(row.yaw + yawOf(T.R()));
    }
  }
  for (auto& f : run.journal.frames) {
    const RigidTransform T = run.toTruth(f.time, f.T_WB);
    for (auto& g : f.objects) {
      g.centre = T * g.centre;
      g.yaw = wrapAngle(g.yaw + yawOf(T.R()));
    }
    f.T_WB = T * f.T_WB;
  }
  if (trajectory.empty()) return;
  const RigidTransform T = at(trajectory.back().time);
  for (auto& o : run.objects) {
    o.centre = T * o.centre;
    o.covariance = T.R() * o.covariance * T.R().transpose();
  }
}

std::vector<MapObject> readObjects(const fs::path& file) {
  std::vector<MapObject> objects;
  const auto root = nlohmann::json::parse(textOf(file));
  for (const auto& json : root["objects"]) {
    MapObject object;
    object.id = json["id"];
    object.class_name = json["class"];
    object.existence = json["existence"];
    object.moving = json["moving"];
    object.working = json["memory"] == "working";
    const auto& belief = json["classes"][object.class_name];
    for (int i = 0; i < 3; ++i) {
      object.centre[i] = belief["mean"][i];
      for (int j = 0; j < 3; ++j) object.covariance(i, j) = belief["covariance"][i][j];
    }
    objects.push_back(object);
  }
  return objects;
}

}  // namespace

std::vector<MapObject> Outcome::believed(const std::string& class_name) const {
  std::vector<MapObject> result;
  for (const auto& object : objects) {
    const bool right =
        class_name.empty() ? object.class_name != kOtherClass : object.class_name == class_name;
    if (object.existence > 0.5 && right) result.push_back(object);
  }
  return result;
}

std::size_t Outcome::countNear(const Eigen::Vector3d& centre, double within,
                               const std::string& class_name) const {
  std::size_t count = 0;
  for (const auto& object : believed(class_name)) {
    if ((object.centre - centre).norm() < within) ++count;
  }
  return count;
}

std::set<std::uint64_t> Outcome::idsNear(const std::vector<tools::EstimateRow>& rows,
                                         const Eigen::Vector3d& centre, double within,
                                         const std::string& class_name) {
  std::set<std::uint64_t> ids;
  for (const auto& row : rows) {
    const bool near = (row.centre_W - centre).norm() < within;
    if (near && row.class_name == class_name) ids.insert(row.id);
  }
  return ids;
}

std::size_t Outcome::countEvents(const std::string& event) const {
  return static_cast<std::size_t>(
      std::count_if(events.begin(), events.end(),
                    [&](const nlohmann::json& one) { return one["event"] == event; }));
}

std::size_t Outcome::countEvents(const std::string& event,
                                 const std::set<std::uint64_t>& objects_asked) const {
  return static_cast<std::size_t>(
      std::count_if(events.begin(), events.end(), [&](const nlohmann::json& one) {
        return one["event"] == event &&
               objects_asked.contains(one["object_id"].get<std::uint64_t>());
      }));
}

std::vector<sim::TruthObject> Outcome::standing(const std::string& class_name) const {
  std::vector<sim::TruthObject> result;
  for (const auto& object : truth.truth.objects) {
    const bool stands = !object.moves && object.keys.size() == 1 &&
                        object.presentAt(truth.frames.front()) &&
                        object.presentAt(truth.frames.back());
    if (stands && object.class_name == class_name) result.push_back(object);
  }
  return result;
}

const sim::TruthView* Outcome::viewOf(const sim::TruthObject& object, std::uint64_t frame) const {
  const auto views = truth.truth.views.find(frame);
  if (views == truth.truth.views.end()) return nullptr;
  for (const auto& view : views->second) {
    if (view.object_id == object.id) return &view;
  }
  return nullptr;
}

RigidTransform Outcome::toTruth(TimePoint time, const RigidTransform& T_WB) const {
  const auto there = truth.body.at(0, time);
  return setting.images && there ? *there * T_WB.inverse() : RigidTransform();
}

fs::path sceneFolder(const Setting& setting) {
  tools::SimulateOptions options;
  options.scene = setting.scene;
  options.seed = setting.seed;
  options.images = setting.images;
  options.format = tools::ImageFormat::kJpeg;
  options.world.rate_hz = setting.rate_hz;
  if (setting.seconds > 0.0) options.world.seconds = setting.seconds;
  return cachedScene({.scene = setting.scene,
                      .seed = setting.seed,
                      .seconds = setting.seconds,
                      .rate_hz = setting.rate_hz,
                      .images = setting.images},
                     [&options](const fs::path& folder) {
                       options.out = folder;
                       tools::simulate(options, {});
                     });
}

Outcome runScene(const Setting& setting) {
  const fs::path folder = sceneFolder(setting);
  std::string assignments;
  for (const auto& one : setting.assignments) assignments += one + " ";
  const fs::path out = folder.string() + ".out" + std::to_string(setting.detections_seed) +
                       (assignments.empty() ? "" : "-" + toHex(digest(assignments)));
  Outcome run{setting, tools::readSimulatedTruth(folder), {}, {}, {}, {}, {}, {}, {}, {}};
  run.journal = runPipeline(setting, folder, out);
  run.inst_rows = tools::readObjectRows(out / "objects_inst.csv");
  run.final_rows = tools::readObjectRows(out / "objects_final.csv");
  const auto trajectory = replay::PoseFile::read(out / "trajectory.tum").poses();
  run.inst = scoreOf(run, run.inst_rows, trajectory);
  run.final = scoreOf(run, run.final_rows, trajectory);
  std::vector<tools::PosePair> pairs;
  for (const auto& pose : trajectory) {
    if (const auto there = run.truth.body.at(0, pose.time)) {
      pairs.push_back({pose.time, pose.T_WB, *there});
    }
  }
  run.trajectory = tools::scoreTrajectory(pairs, tools::Alignment::kYaw);
  run.objects = readObjects(out / "objects.json");
  std::ifstream events(out / "events.jsonl");
  for (std::string line; std::getline(events, line);) {
    run.events.push_back(nlohmann::json::parse(line));
  }
  takeToTruth(run, trajectory);
  return run;
}

}  // namespace perdure::test
