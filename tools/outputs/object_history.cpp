#include "tools/outputs/object_history.h"

#include <algorithm>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr double kMovingAbove = 0.5;
constexpr double kMostlySeen = 0.6;    // FINAL: with less of it in sight an object counts as hidden
constexpr double kBelievedFrom = 0.1;  // FINAL: fainter guesses are not a first detection

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
  Box box;  ///< of the cuboid's corners; empty where the centre is not in the image
  double depth = 0;
};

/// What a row looks like from a pose; nothing where its centre is outside the image.
std::optional<Outline> outlineOf(const ObjectRow& row, const RigidTransform& T_CW,
                                 const CameraModel& camera) {
  const Eigen::Vector3d centre = T_CW * row.p_W;
  const auto pixel = camera.project(centre);
  if (!pixel || !camera.inImage(*pixel)) return std::nullopt;
  Outline outline{{pixel->x(), pixel->y(), pixel->x(), pixel->y()}, centre.z()};
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d half(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                               corner & 4 ? 0.5 : -0.5);
    const auto at =
        camera.project(T_CW * (row.p_W + rotationAboutZ(row.yaw) * half.cwiseProduct(row.size)));
    if (!at) continue;
    Box& box = outline.box;
    box = Box{std::min(box.x1, at->x()), std::min(box.y1, at->y()), std::max(box.x2, at->x()),
              std::max(box.y2, at->y())};
  }
  return outline;
}

bool covers(const Box& box, double x, double y) {
  return x > box.x1 && x < box.x2 && y > box.y1 && y < box.y2;
}

/// Share of an outline that no nearer one covers.
double visibleShare(const Outline& outline, const std::vector<Outline>& all) {
  constexpr int kCells = 16;
  int open = 0;
  for (int i = 0; i < kCells * kCells; ++i) {
    const double x = outline.box.x1 + (i % kCells + 0.5) / kCells * outline.box.width();
    const double y = outline.box.y1 + (i / kCells + 0.5) / kCells * outline.box.height();
    const bool covered = std::any_of(all.begin(), all.end(), [&](const Outline& other) {
      return other.depth < outline.depth && covers(other.box, x, y);
    });
    open += covered ? 0 : 1;
  }
  return static_cast<double>(open) / (kCells * kCells);
}

}  // namespace

void ObjectHistory::add(const Objects& message) {
  FrameRecord record;
  record.time = message.stamp.time;
  record.T_WB = message.T_WB;
  for (const ObjectBelief& object : message.objects) {
    if (object.classes.empty()) continue;
    record.looks[object.id] = {isHidden(object.visibility), object.existence >= kBelievedFrom};
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
      const auto outline = outlineOf(row, (record.T_WB * camera_->T_BC()).inverse(), *camera_);
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
  for (const auto& [frame, record] : frames_) {
    for (ObjectRow& row : finalRowsOf(record, begun)) {
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
