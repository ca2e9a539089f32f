#include "tools/outputs/output_writer.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/earth/geodesy.h"
#include "common/mapping/frames/laid_belief.h"
#include "common/math/so3.h"
#include "common/types/ledger_json.h"
#include "tools/outputs/pictures/evolution_picture.h"
#include "tools/outputs/pictures/map_picture.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;

// Reference without GNSS: viewers show the map at 0°, 0°.
constexpr GeoAnchor kDefaultAnchor{};

template <class Derived>
Json numbersOf(const Eigen::MatrixBase<Derived>& vector) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) list.push_back(rounded(vector(i)));
  return list;
}

Json featureOf(const ObjectBelief& belief, const GeoReference& reference) {
  const ClassBelief& best = belief.best();
  const Eigen::Vector3d p = best.mean.head<3>();
  const Geodetic g = reference(p);
  const Eigen::Vector3d size = best.mean.tail<3>().array().exp();
  return {{"type", "Feature"},
          {"id", belief.id},
          {"geometry",
           {{"type", "Point"},
            {"coordinates",
             {std::stod(fmt::format("{:.9f}", g.longitude_deg)),
              std::stod(fmt::format("{:.9f}", g.latitude_deg)),
              std::stod(fmt::format("{:.3f}", g.height_m))}}}},
          {"properties",
           {{"class", best.name},
            {"existence", rounded(belief.existence)},
            {"probability", rounded(best.probability)},
            {"local_m", numbersOf(p)},
            {"size_m", numbersOf(size)},
            {"yaw_rad", rounded(best.mean[3])},
            {"memory", belief.memory == Memory::kWorking ? "working" : "long_term"}}}};
}

std::string tumLine(TimePoint time, const RigidTransform& T_WB) {
  const std::int64_t ns = toNanoseconds(time);
  const auto& [q, p] = T_WB;
  return fmt::format("{}.{:09d} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
                     ns / 1'000'000'000, ns % 1'000'000'000, p.x(), p.y(), p.z(), q.x(), q.y(),
                     q.z(), q.w());
}

}  // namespace

Json toJson(const Event& event) {
  Json json = {{"timestamp_ns", toNanoseconds(event.stamp.time)},
               {"frame", event.stamp.sequence},
               {"event", nameOf(event.kind)},
               {"object_id", event.object_id}};
  if (event.other_id != 0) json["other_id"] = event.other_id;
  if (!event.class_name.empty()) json["class"] = event.class_name;
  json["probability"] = rounded(event.probability);
  if (!event.detail.empty()) json["detail"] = event.detail;
  if (event.kind == EventKind::kPredictedReturn) {
    const auto& [expected, earliest, latest] = event.returns_in_s;
    json["returns_in_s"] = rounded(expected);
    json["interval_s"] = {rounded(earliest), rounded(latest)};
  }
  return json;
}

Json toJson(const ObjectBelief& belief) {
  Json pmf = Json::object(), classes = Json::object();
  for (const ClassBelief& c : belief.classes) {
    pmf[c.name] = rounded(c.probability);
    Json covariance = Json::array();
    for (Eigen::Index i = 0; i < 7; ++i) covariance.push_back(numbersOf(c.covariance.row(i)));
    classes[c.name] = {{"mean", numbersOf(c.mean)}, {"covariance", covariance}};
  }
  return {{"id", belief.id},
          {"class", belief.best().name},
          {"existence", rounded(belief.existence)},
          {"pmf", pmf},
          {"classes", classes},
          {"first_seen_ns", toNanoseconds(belief.first_seen)},
          {"last_seen_ns", toNanoseconds(belief.last_seen)},
          {"hits", belief.hits},
          {"visible_misses", belief.visible_misses},
          {"moving", rounded(belief.moving)},
          {"memory", belief.memory == Memory::kWorking ? "working" : "long_term"},
          {"why", toJson(belief.why)}};
}

OutputWriter::OutputWriter(std::filesystem::path folder, std::string sequence)
    : folder_(std::move(folder)), sequence_(std::move(sequence)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) {
    throw StartupError(ExitCode::kUnavailable, "{}: cannot be made: {}; give --out another folder",
                       folder_.string(), error.message());
  }
  open(events_, "events.jsonl");
  open(odometry_, "odometry.csv");
  odometry_ << "frame,timestamp_ns,epoch,degraded,x,y,z,qx,qy,qz,qw,vx,vy,vz";
  for (const char* bias : {"bg", "ba"}) {
    for (const char axis : {'x', 'y', 'z'}) odometry_ << "," << bias << axis;
  }
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j <= i; ++j) odometry_ << ",P" << i << j;
  }
  odometry_ << "\n";
}

void OutputWriter::open(std::ofstream& stream, const char* name) const {
  stream.open(folder_ / name, std::ios::trunc);
  if (stream) return;
  throw StartupError(ExitCode::kUnavailable,
                     fmt::format("{}: cannot be written; give --out a folder that you may write",
                                 (folder_ / name).string()));
}

void OutputWriter::onCalibration(const Calibration& calibration) {
  if (!calibration.cameras.empty()) history_.setCamera(calibration.cameras.front());
  if (calibration.anchor) anchor_ = calibration.anchor;
}

void OutputWriter::onOdometry(const Odometry& odometry) {
  if (odometry.state == OdometryState::kInitialising) return;
  poses_[odometry.stamp.sequence] = {odometry.stamp.time, odometry.T_WB};
  const auto& [q, p] = odometry.T_WB;
  odometry_ << fmt::format("{},{},{},{}", odometry.stamp.sequence,
                           toNanoseconds(odometry.stamp.time), odometry.world.epoch,
                           odometry.state == OdometryState::kDegraded ? 1 : 0);
  const auto put = [this](double value) { odometry_ << fmt::format(",{:.9g}", value); };
  for (const double value : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) put(value);
  for (const auto* v : {&odometry.v_WB, &odometry.gyro_bias, &odometry.accel_bias}) {
    for (const double value : *v) put(value);
  }
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j <= i; ++j) put(odometry.covariance(i, j));
  }
  odometry_ << "\n";
}

void OutputWriter::onObjects(const Objects& objects) {
  history_.add(objects);
  log_.add(objects);
}

void OutputWriter::onLandmarks(const Landmarks& message) {
  constexpr double kVagueVariance = 1.0;  // m²
  for (const Landmark& one : message.landmarks) {
    if (!one.p_W.allFinite() || !(one.covariance.trace() < kVagueVariance)) continue;
    landmarks_[{message.instance, one.id}] = {message.stamp.time, one.p_W.cast<float>()};
  }
}

void OutputWriter::onEvent(const Event& event) {
  history_.add(event);
  if (event.kind == EventKind::kLoopClosed || event.kind == EventKind::kLoopWithdrawn ||
      event.kind == EventKind::kRelocalised) {
    loop_marks_.push_back({event.stamp.sequence, event.kind});
  }
  events_ << toJson(event).dump() << "\n";
}

void OutputWriter::writeJson(const std::string& name, const Json& json) const {
  writeChecked(folder_ / name, json.dump(1) + "\n");
}

void OutputWriter::finish() {
  flushChecked(events_, folder_ / "events.jsonl");
  flushChecked(odometry_, folder_ / "odometry.csv");
  writeTable("objects_inst.csv", history_.inst());
  writeTable("objects_final.csv", history_.finalRows());
  writeTrajectory();
  writeMapTrajectory();
  writeObjects();
  writeGeoJson();
  writePictures();
}

std::vector<ObjectBelief> OutputWriter::beliefsInMap() const {
  std::vector<ObjectBelief> beliefs = history_.lastBeliefs();
  if (in_map_.along.empty()) return beliefs;
  for (ObjectBelief& belief : beliefs) {
    const auto found = in_map_.objects.find(belief.id);
    const RigidTransform T_MW =
        found == in_map_.objects.end() ? in_map_.T_MW(belief.last_seen) : found->second;
    belief = mapping::turned(T_MW, std::move(belief));
  }
  return beliefs;
}

MapContent OutputWriter::mapContent() const {
  MapContent content;
  content.in_M = !in_map_.along.empty();
  for (const auto& [frame, pose] : poses_) content.path.push_back(in_map_.T_MB(pose).p);
  for (const ObjectBelief& belief : beliefsInMap()) {
    content.objects.push_back(glanceAt(belief));
    if (belief.memory == Memory::kLongTerm)
      content.objects.back().visibility = Visibility::kOutOfView;
  }
  for (const auto& [id, point] : landmarks_) {
    const Eigen::Vector3d p_M = in_map_.T_MW(point.time) * point.p_W.cast<double>();
    content.landmarks.push_back(p_M.cast<float>());
  }
  content.anchors = in_map_.anchors_M;
  content.loops = in_map_.loops;
  if (truth_) content.truth = turned(in_map_.T_MW_begin(), *truth_);
  if (!poses_.empty()) content.end = poses_.rbegin()->second.time;
  if (const auto T_MB = poseAtAnchor()) {
    content.yaw_of_north = yawOf(T_MB->R()) + 0.5 * std::numbers::pi - anchor_->yaw;
  }
  return content;
}

void OutputWriter::writePictures() const {
  const PictureTruth* truth = truth_ ? &*truth_ : nullptr;
  writeMap(mapContent(), folder_ / "map.png");
  writeEvolution(log_, truth, bodyErrors(poses_, in_map_, loop_marks_, truth),
                 folder_ / "evolution.png");
}

void OutputWriter::writeTable(const std::string& name, const std::vector<ObjectRow>& rows) const {
  CheckedFile checked(folder_ / name);
  std::ostream& file = checked.stream();
  file << "sequence,frame,timestamp_ns,object_id,class,score,x,y,z,l,w,h,yaw,visible\n";
  for (const ObjectRow& r : rows) {
    file << fmt::format(
        "{},{},{},{},{},{:.6f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.5f},{}\n", sequence_,
        r.frame, toNanoseconds(r.time), r.object_id, r.class_name, r.score, r.p_W.x(), r.p_W.y(),
        r.p_W.z(), r.size.x(), r.size.y(), r.size.z(), r.yaw, r.visible ? 1 : 0);
  }
  checked.close();
}

void OutputWriter::writeTrajectory() const {
  CheckedFile file(folder_ / "trajectory.tum");
  for (const auto& [frame, pose] : poses_) file.stream() << tumLine(pose.time, pose.T_WB);
  file.close();
}

void OutputWriter::writeMapTrajectory() const {
  if (in_map_.along.empty()) return;
  CheckedFile file(folder_ / "trajectory_map.tum");
  for (const auto& [frame, pose] : poses_) file.stream() << tumLine(pose.time, in_map_.T_MB(pose));
  file.close();
}

void OutputWriter::writeObjects() const {
  Json objects = Json::array();
  for (const ObjectBelief& belief : history_.lastBeliefs()) objects.push_back(toJson(belief));
  writeJson("objects.json", {{"objects", objects}});
}

/// T_MB of the pose nearest to the time of the GNSS anchor; empty if none is within a second.
std::optional<RigidTransform> OutputWriter::poseAtAnchor() const {
  if (!anchor_) return std::nullopt;
  constexpr Duration kNear = std::chrono::seconds(1);
  std::optional<RigidTransform> T_MB;
  auto nearest = kNear + Duration(1);
  for (const auto& [frame, pose] : poses_) {
    const auto apart = std::chrono::abs(pose.time - anchor_->time);
    if (apart >= nearest) continue;
    nearest = apart;
    T_MB = in_map_.T_MB(pose);
  }
  return T_MB;
}

void OutputWriter::writeGeoJson() const {
  const auto T_MB = poseAtAnchor();
  const GeoReference reference(anchor_.value_or(kDefaultAnchor), T_MB.value_or(RigidTransform{}));
  Json features = Json::array();
  for (const ObjectBelief& belief : beliefsInMap()) {
    features.push_back(featureOf(belief, reference));
  }
  writeJson(
      "map.geojson",
      {{"type", "FeatureCollection"}, {"georeferenced", T_MB.has_value()}, {"features", features}});
}

}  // namespace perdure::tools
