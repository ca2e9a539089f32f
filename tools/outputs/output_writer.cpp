#include "tools/outputs/output_writer.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/math/so3.h"
#include "tools/outputs/geodesy.h"
#include "tools/outputs/ledger_json.h"
#include "tools/outputs/pictures/evolution_picture.h"
#include "tools/outputs/pictures/map_picture.h"

namespace perdure::tools {
namespace {

using Json = nlohmann::ordered_json;

// Declared, not measured: where no GNSS is at hand the map still opens in any viewer, at 0°, 0°.
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
    throw StartupError(ExitCode::kUnavailable,
                       fmt::format("{}: cannot be made: {}; give --out another folder",
                                   folder_.string(), error.message()));
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
    landmarks_[{message.instance, one.id}] = one.p_W.cast<float>();
  }
}

void OutputWriter::onEvent(const Event& event) {
  history_.add(event);
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
  writeObjects();
  writeGeoJson();
  writePictures();
}

void OutputWriter::writePictures() const {
  MapContent content;
  for (const auto& [frame, pose] : poses_) content.path.push_back(pose.T_WB.p);
  for (const ObjectBelief& belief : history_.lastBeliefs()) {
    content.objects.push_back(glanceAt(belief));
    if (belief.memory == Memory::kLongTerm)
      content.objects.back().visibility = Visibility::kOutOfView;
  }
  for (const auto& [id, p_W] : landmarks_) content.landmarks.push_back(p_W);
  content.truth = truth_;
  if (!poses_.empty()) content.end = poses_.rbegin()->second.time;
  if (const auto T_WB = poseAtAnchor()) {
    content.yaw_of_north = yawOf(T_WB->R()) + 0.5 * std::numbers::pi - anchor_->yaw;
  }
  writeMap(content, folder_ / "map.png");
  writeEvolution(log_, truth_ ? &*truth_ : nullptr, folder_ / "evolution.png");
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

void OutputWriter::writeMapTrajectory(
    const std::vector<std::pair<TimePoint, RigidTransform>>& along) const {
  if (along.empty()) return;
  CheckedFile checked(folder_ / "trajectory_map.tum");
  std::ostream& file = checked.stream();
  std::size_t next = 0;
  for (const auto& [frame, pose] : poses_) {
    while (next < along.size() && along[next].first <= pose.time) ++next;
    RigidTransform T_MW = along[next == 0 ? 0 : next - 1].second;
    if (next > 0 && next < along.size()) {
      // Both corrections as they act on the pose itself: they may turn about a far origin.
      const auto& [t0, from] = along[next - 1];
      const auto& [t1, to] = along[next];
      const double s = toSeconds(pose.time - t0) / toSeconds(t1 - t0);
      file << tumLine(pose.time, interpolate(from * pose.T_WB, to * pose.T_WB, s));
    } else {
      file << tumLine(pose.time, T_MW * pose.T_WB);
    }
  }
  checked.close();
}

void OutputWriter::writeObjects() const {
  Json objects = Json::array();
  for (const ObjectBelief& belief : history_.lastBeliefs()) objects.push_back(toJson(belief));
  writeJson("objects.json", {{"objects", objects}});
}

/// W meets the Earth at the pose nearest to the anchor's time; further away it would be a guess.
std::optional<RigidTransform> OutputWriter::poseAtAnchor() const {
  if (!anchor_) return std::nullopt;
  constexpr Duration kNear = std::chrono::seconds(1);
  std::optional<RigidTransform> T_WB;
  auto nearest = kNear + Duration(1);
  for (const auto& [frame, pose] : poses_) {
    const auto apart = std::chrono::abs(pose.time - anchor_->time);
    if (apart >= nearest) continue;
    nearest = apart;
    T_WB = pose.T_WB;
  }
  return T_WB;
}

void OutputWriter::writeGeoJson() const {
  const auto T_WB = poseAtAnchor();
  const GeoReference reference(anchor_.value_or(kDefaultAnchor), T_WB.value_or(RigidTransform{}));
  Json features = Json::array();
  for (const ObjectBelief& belief : history_.lastBeliefs()) {
    features.push_back(featureOf(belief, reference));
  }
  writeJson(
      "map.geojson",
      {{"type", "FeatureCollection"}, {"georeferenced", T_WB.has_value()}, {"features", features}});
}

}  // namespace perdure::tools
