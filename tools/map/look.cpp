#include "tools/map/look.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/base/errors.h"
#include "common/camera/ground_view.h"
#include "common/mapping/frames/laid_belief.h"
#include "common/mapping/map_frames.h"
#include "common/math/so3.h"
#include "common/replay/dataset.h"
#include "common/replay/files/pose_file.h"
#include "common/replay/files/rig_file.h"
#include "services/map_store/core/map_database.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/core/planning/places.h"
#include "services/semantic_filter/priors.h"
#include "tools/base/config_folder.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using semantic_filter::Candidate;
using semantic_filter::Expectation;
using semantic_filter::Observer;

template <class T>
T need(const std::string& path, Result<T> result) {
  if (!result) map_store::cannotReadMap(path, result.error());
  return *std::move(result);
}

Prospect prospectOf(const std::vector<TimedView>& views, const std::vector<Candidate>& candidates,
                    const Observer& observer) {
  Prospect prospect{views, {}, {}};
  for (const Expectation& e : semantic_filter::expect(candidates, views, observer)) {
    prospect.fall += e.fall;
    const Candidate& candidate = candidates[e.candidate];
    if (candidate.stationary > 0.0) continue;
    prospect.objects.push_back(
        {candidate.track.id, candidate.track.best().class_name, e.existence, e.detected, e.fall});
  }
  std::stable_sort(prospect.objects.begin(), prospect.objects.end(),
                   [](auto& a, auto& b) { return a.fall.total() > b.fall.total(); });
  return prospect;
}

nlohmann::ordered_json toJson(const semantic_filter::Fall& fall) {
  return {{"total", fall.total()},
          {"existence", fall.existence},
          {"class", fall.classes},
          {"position", fall.position},
          {"unseen", fall.unseen}};
}

}  // namespace

MapToLook readMapToLook(const std::string& path) {
  const auto connection = map_store::openStoreForReading(path);
  need(path, connection.execute("BEGIN").map([] { return true; }));
  const auto graph = need(path, map_store::MapReader(&connection).graph());
  const mapping::MapState state({}, graph.map);
  const mapping::Identity& identity = state.identity();
  const CorrectionsOf corrections =
      standingByObject(identity.corrections(), [&](ObjectId id) { return identity.objectOf(id); });
  const map_store::MapReader reader(&connection, &corrections);
  const auto working = need(path, reader.working());
  const mapping::MapFrames frames(state);
  const WorldId M = frames.mapOf(working ? working->world : WorldId{});
  MapToLook map;
  for (const auto& [id, anchor] : state.anchors()) {
    const auto frame = frames.at(id, anchor.session);
    if (frame.map == M) map.past.push_back({frame.T_MW * anchor.T_WA, anchor.stamp.time});
  }
  std::stable_sort(map.past.begin(), map.past.end(),
                   [](auto& a, auto& b) { return a.time < b.time; });
  if (!map.past.empty()) map.newest = map.past.back().time;
  for (auto& [world, belief] : need(path, reader.beliefs())) {
    const auto record = state.records().find(belief.id);
    const auto* known = record == state.records().end() ? nullptr : &record->second;
    const auto frame = frames.at(frames.anchorOf(known, world, belief.last_seen), world);
    if (frame.map != M || belief.moving > 0.5) continue;
    map.newest = std::max(map.newest, belief.as_of);
    map.beliefs.push_back(mapping::turned(frame.T_MW, std::move(belief)));
  }
  return map;
}

double Prospect::length_m() const {
  double length = 0.0;
  for (std::size_t k = 1; k < views.size(); ++k) {
    length += (views[k].T_WB.p - views[k - 1].T_WB.p).norm();
  }
  return length;
}

LookSettings readLookSettings(const std::string& rig, const std::string& config) {
  semantic_filter::Config filter;
  config::Fields fields;
  semantic_filter::describe(filter, fields);
  const fs::path file = config.empty() ? configFolder() / "semantic_filter.yaml" : fs::path(config);
  config::refuse(config::readFile(fields, file.string()));
  fs::path priors = filter.class_priors;
  if (!fs::exists(priors)) priors = file.parent_path() / priors.filename();
  const bool drive = fs::is_directory(rig) || rig.ends_with(".mcap");
  const Calibration calibration =
      drive ? replay::Dataset::open({.path = rig, .decode = false})->calibration()
            : replay::readRig(rig);
  if (calibration.cameras.empty()) {
    throw StartupError(ExitCode::kData, rig + " has no camera; give a rig file with cam0");
  }
  const CameraModel camera(calibration.cameras.front());
  if (!looksAlongGround(camera)) {
    throw StartupError(ExitCode::kData,
                       rig +
                           ": the camera looks up or down if the body is level. The map stores "
                           "level poses, so what it saw is not known; give a rig whose body has "
                           "its z axis up");
  }
  return {camera, semantic_filter::loadClassPriors(priors.string()), filter.filter};
}

std::vector<Candidate> candidatesOf(const MapToLook& map, const std::vector<TimedView>& planned,
                                    const Observer& observer) {
  std::vector<Candidate> candidates;
  for (const ObjectBelief& belief : map.beliefs) {
    candidates.push_back(
        {semantic_filter::fromBelief(belief, Matrix6d::Identity(), ExistenceEvidence::kRecall)});
  }
  semantic_filter::addPlaces(candidates, map.past, planned, observer);
  return candidates;
}

std::vector<Prospect> prospectsOf(const MapToLook& map,
                                  const std::vector<std::vector<TimedView>>& plans,
                                  const LookSettings& settings) {
  const Observer observer{&settings.camera, &settings.priors, &settings.parameters,
                          semantic_filter::natsPerHit(map.beliefs)};
  std::vector<TimedView> planned;
  for (const auto& views : plans) planned.insert(planned.end(), views.begin(), views.end());
  const auto candidates = candidatesOf(map, planned, observer);
  std::vector<Prospect> prospects;
  for (const auto& views : plans) prospects.push_back(prospectOf(views, candidates, observer));
  return prospects;
}

std::vector<TimedView> readPlan(const std::string& file, TimePoint start) {
  const auto poses =
      replay::PoseFile::read(file, "give TUM lines: t x y z qx qy qz qw, the body in M").poses();
  std::vector<TimedView> views;
  for (const auto& pose : poses) {
    views.push_back({pose.T_WB, start + (pose.time - poses.front().time)});
  }
  return views;
}

std::vector<TimedView> posesAround(const MapToLook& map, const Eigen::Vector2d& place,
                                   double radius, TimePoint at) {
  constexpr int kHeadings = 8;
  std::vector<TimedView> views;
  for (const TimedView& past : map.past) {
    if ((past.T_WB.p.head<2>() - place).norm() > radius) continue;
    for (int k = 0; k < kHeadings; ++k) {
      const Eigen::Quaterniond turn(
          Eigen::AngleAxisd(2.0 * M_PI / kHeadings * k, Eigen::Vector3d::UnitZ()));
      views.push_back({{past.T_WB.q * turn, past.T_WB.p}, at});
    }
  }
  return views;
}

nlohmann::ordered_json toJson(const Prospect& prospect) {
  auto views = nlohmann::ordered_json::array(), objects = nlohmann::ordered_json::array();
  for (const TimedView& view : prospect.views) {
    const Eigen::Vector3d& p = view.T_WB.p;
    views.push_back({{"place", {p.x(), p.y(), p.z()}},
                     {"yaw", yawOf(view.T_WB.R())},
                     {"time_ns", toNanoseconds(view.time)}});
  }
  for (const Prospect::Object& o : prospect.objects) {
    objects.push_back({{"id", o.id},
                       {"class", o.class_name},
                       {"existence", o.existence},
                       {"detected", o.detected},
                       {"bits", toJson(o.fall)}});
  }
  return {{"bits", toJson(prospect.fall)},
          {"length_m", prospect.length_m()},
          {"views", views},
          {"objects", objects}};
}

}  // namespace perdure::tools
