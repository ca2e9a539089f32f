#include "tools/outputs/object_history.h"

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr double kMovingAbove = 0.5;

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

}  // namespace

void ObjectHistory::add(const Objects& message) {
  FrameRecord record;
  record.time = message.stamp.time;
  record.T_WB = message.T_WB;
  for (const ObjectBelief& object : message.objects) {
    if (object.classes.empty()) continue;
    record.looks[object.id] = {isHidden(object.visibility)};
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
    if (!is_new) it->second.hidden = it->second.hidden && look.hidden;
  }
  return looks;
}

std::vector<ObjectRow> ObjectHistory::finalRows() const {
  std::vector<ObjectRow> rows;
  for (const auto& [frame, record] : frames_) {
    for (const auto& [id, look] : looksOfSurvivors(record)) {
      if (!endsAsStaticThing(id) || look.hidden) continue;
      ObjectRow row = rowOf(last_.at(id));
      if (camera_) {
        const auto pixel =
            camera_->project(camera_->T_BC().inverse() * (record.T_WB.inverse() * row.p_W));
        if (!pixel || !camera_->inImage(*pixel)) continue;
      }
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
