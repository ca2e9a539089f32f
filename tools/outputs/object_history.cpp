#include "tools/outputs/object_history.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr double kMovingAbove = 0.5;
constexpr double kMostlySeen = 0.6;    // objects_final.csv: an object with less is occluded
constexpr double kBelievedFrom = 0.1;  // objects_final.csv: a track's rows begin at this existence

bool isHidden(Visibility v) { return v == Visibility::kOccluded; }

bool isInSight(Visibility v) { return v == Visibility::kVisible || v == Visibility::kPartial; }

ObjectRow rowOf(const ObjectBelief& object) {
  const ClassBelief& best = object.best();
  ObjectRow row;
  row.object_id = object.id;
  row.class_name = best.name;
  row.score = object.existence * best.probability;
  row.p_W = best.mean.head<3>();
  row.size = best.mean.tail<3>().array().exp();
  row.yaw = wrapAngle(best.mean[3]);
  return row;
}

struct Outline {
  std::vector<cv::Point2f> hull;
  double depth = 0;
};

const ShapePoints& cuboidPoints() {
  static const ShapePoints corners = [] {
    ShapePoints points;
    for (int i = 0; i < 8; ++i) {
      points.emplace_back(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
    }
    return points;
  }();
  return corners;
}

/// Outline of a row in the image: the hull of its shape, or the box of its cuboid if `shape` is
/// null. Empty if the row's centre is outside the image.
std::optional<Outline> outlineOf(const ObjectRow& row, const ShapePoints* shape,
                                 const RigidTransform& T_CW, const CameraModel& camera) {
  const Eigen::Vector3d centre = T_CW * row.p_W;
  const auto pixel = camera.project(centre);
  if (!pixel || !camera.inImage(*pixel)) return std::nullopt;
  std::vector<cv::Point2f> points{{static_cast<float>(pixel->x()), static_cast<float>(pixel->y())}};
  const Eigen::Matrix3d R = rotationAboutZ(row.yaw);
  for (const Eigen::Vector3d& part : shape ? *shape : cuboidPoints()) {
    const auto at = camera.project(T_CW * (row.p_W + 0.5 * (R * part.cwiseProduct(row.size))));
    if (at) points.emplace_back(static_cast<float>(at->x()), static_cast<float>(at->y()));
  }
  if (!shape) {
    const auto [left, right] =
        std::ranges::minmax_element(points, [](const auto& p, const auto& q) { return p.x < q.x; });
    const auto [top, bottom] =
        std::ranges::minmax_element(points, [](const auto& p, const auto& q) { return p.y < q.y; });
    points = {{left->x, top->y}, {right->x, top->y}, {right->x, bottom->y}, {left->x, bottom->y}};
  }
  Outline outline{{}, centre.z()};
  cv::convexHull(points, outline.hull);
  return outline;
}

bool covers(const Outline& outline, const cv::Point2f& at) {
  return cv::pointPolygonTest(outline.hull, at, false) > 0.0;
}

/// The share of an outline that no nearer outline of `all` covers.
double visibleShare(const Outline& outline, const std::vector<Outline>& all) {
  constexpr int kCells = 16;
  int open = 0, own = 0;
  const cv::Rect2f box(cv::boundingRect(outline.hull));
  for (int i = 0; i < kCells * kCells; ++i) {
    const cv::Point2f at(box.x + (static_cast<float>(i % kCells) + 0.5F) / kCells * box.width,
                         box.y + (static_cast<float>(i / kCells) + 0.5F) / kCells * box.height);
    if (!covers(outline, at)) continue;
    ++own;
    const bool covered = std::ranges::any_of(all, [&](const Outline& other) {
      return other.depth < outline.depth && covers(other, at);
    });
    open += covered ? 0 : 1;
  }
  return own == 0 ? 1.0 : static_cast<double>(open) / own;
}

}  // namespace

ObjectHistory::Place ObjectHistory::placeOf(const ObjectBelief& object) {
  const ClassBelief& best = object.best();
  return {best.mean.head<3>(), best.covariance.topLeftCorner<3, 3>()};
}

void ObjectHistory::add(const Objects& message) {
  FrameRecord record;
  record.time = message.stamp.time;
  record.T_WB = message.T_WB;
  for (const ObjectBelief& object : message.objects) {
    if (object.classes.empty()) continue;
    Look& look = record.looks[object.id];
    look.hidden = isHidden(object.visibility);
    look.believed = object.existence >= kBelievedFrom;
    if (object.confirmed && object.moving >= kMovingAbove) look.driving = placeOf(object);
    std::uint64_t& newest = last_frame_[object.id];
    if (message.stamp.sequence >= newest) {
      newest = message.stamp.sequence;
      last_[object.id] = object;
    }
    if (!object.confirmed || object.moving >= kMovingAbove || !isInSight(object.visibility))
      continue;
    ObjectRow row = rowOf(object);
    row.frame = message.stamp.sequence;
    row.time = message.stamp.time;
    record.inst.push_back(std::move(row));
  }
  frames_[message.stamp.sequence] = std::move(record);
}

void ObjectHistory::add(const Event& event) {
  switch (event.kind) {
    case EventKind::kMerged:
      merged_into_[event.other_id] = event.object_id;
      break;
    case EventKind::kGone:
      gone_.insert(event.object_id);
      break;
    case EventKind::kReappeared:
      gone_.erase(event.object_id);
      break;
    case EventKind::kArchived:
      archived_.insert(event.object_id);
      break;
    case EventKind::kRecalled:
    case EventKind::kRestored:
      archived_.erase(event.object_id);
      break;
    default:
      break;
  }
}

ObjectId ObjectHistory::survivorOf(ObjectId id) const {
  for (std::size_t steps = 0; steps <= merged_into_.size(); ++steps) {
    const auto it = merged_into_.find(id);
    if (it == merged_into_.end()) break;
    id = it->second;
  }
  return id;
}

bool ObjectHistory::endsAsStaticThing(ObjectId id) const {
  const auto it = last_.find(id);
  return it != last_.end() && it->second.confirmed && it->second.moving < kMovingAbove &&
         !gone_.contains(id) && !merged_into_.contains(id);
}

std::vector<ObjectRow> ObjectHistory::inst() const {
  std::vector<ObjectRow> rows;
  for (const auto& [frame, record] : frames_) {
    std::map<ObjectId, ObjectRow> by_id;
    for (const ObjectRow& row : record.inst) by_id[row.object_id] = row;
    for (auto& [id, row] : by_id) rows.push_back(std::move(row));
  }
  return rows;
}

std::map<ObjectId, ObjectHistory::Look> ObjectHistory::looksOfSurvivors(
    const FrameRecord& record) const {
  std::map<ObjectId, Look> looks;
  for (const auto& [id, look] : record.looks) {
    const auto [it, is_new] = looks.emplace(survivorOf(id), look);
    if (is_new) continue;
    it->second.hidden = it->second.hidden && look.hidden;
    it->second.believed = it->second.believed || look.believed;
  }
  return looks;
}

/// Returns, for each object, the last frame in which it was estimated to be moving at a place that
/// is not its last position.
std::map<ObjectId, std::uint64_t> ObjectHistory::lastFramesElsewhere() const {
  constexpr double kSurely = 21.1;  // χ² of three degrees of freedom, 0.9999
  std::map<ObjectId, std::uint64_t> result;
  for (const auto& [frame, record] : frames_) {
    for (const auto& [id, look] : record.looks) {
      const auto last = last_.find(survivorOf(id));
      if (!look.driving || last == last_.end()) continue;
      const Place now = placeOf(last->second);
      const Eigen::Vector3d apart = look.driving->p_W - now.p_W;
      const Eigen::Matrix3d covariance = look.driving->covariance + now.covariance;
      if (squaredMahalanobis(apart, covariance) > kSurely) result[last->first] = frame;
    }
  }
  return result;
}

std::vector<ObjectRow> ObjectHistory::finalRowsOf(const FrameRecord& record,
                                                  std::set<ObjectId>& begun) const {
  std::vector<ObjectRow> rows;
  std::vector<Outline> outlines;
  for (const auto& [id, look] : looksOfSurvivors(record)) {
    if (look.believed) begun.insert(id);
    if (!begun.contains(id) || !endsAsStaticThing(id)) continue;
    ObjectRow row = rowOf(last_.at(id));
    row.visible = !look.hidden;
    if (camera_) {
      const auto shape = shapes_.find(row.class_name);
      const auto outline = outlineOf(row, shape == shapes_.end() ? nullptr : &shape->second,
                                     (record.T_WB * camera_->T_BC()).inverse(), *camera_);
      if (!outline) continue;
      outlines.push_back(*outline);
    }
    rows.push_back(std::move(row));
  }
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    if (visibleShare(outlines[i], outlines) < kMostlySeen) rows[i].visible = false;
  }
  std::erase_if(rows, [](const ObjectRow& row) { return !row.visible; });
  return rows;
}

std::vector<ObjectRow> ObjectHistory::finalRows() const {
  std::vector<ObjectRow> rows;
  std::set<ObjectId> begun;
  const auto elsewhere = lastFramesElsewhere();
  for (const auto& [frame, record] : frames_) {
    for (ObjectRow& row : finalRowsOf(record, begun)) {
      const auto until = elsewhere.find(row.object_id);
      if (until != elsewhere.end() && frame <= until->second) continue;
      row.frame = frame;
      row.time = record.time;
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::vector<ObjectBelief> ObjectHistory::lastBeliefs() const {
  std::vector<ObjectBelief> beliefs;
  for (const auto& [id, belief] : last_) {
    if (!belief.confirmed || gone_.contains(id) || merged_into_.contains(id)) continue;
    beliefs.push_back(belief);
    if (archived_.contains(id)) beliefs.back().memory = Memory::kLongTerm;
  }
  return beliefs;
}

std::size_t ObjectHistory::confirmedNow() const {
  if (frames_.empty()) return 0;
  const std::uint64_t newest = frames_.rbegin()->first;
  std::size_t count = 0;
  for (const auto& [id, frame] : last_frame_) count += frame == newest && last_.at(id).confirmed;
  return count;
}

}  // namespace perdure::tools
