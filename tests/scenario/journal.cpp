#include "tests/scenario/journal.h"

#include <algorithm>
#include <string_view>

namespace perdure::test {
namespace {

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::uint64_t bitsOf(const ObjectBelief& o) {
  std::string bytes;
  append(bytes, o.existence);
  for (const ClassBelief& c : o.classes) {
    bytes += c.name;
    append(bytes, c.probability);
    for (const double value : c.mean) append(bytes, value);
    for (const double value : c.covariance.reshaped()) append(bytes, value);
  }
  return digest(bytes);
}

Glance glanceOf(const ObjectBelief& o) {
  Glance g;
  g.id = o.id;
  g.existence = o.existence;
  g.moving = o.moving;
  for (const ClassBelief& c : o.classes) g.pmf.emplace_back(c.name, c.probability);
  const ClassBelief& best = o.best();
  g.centre = best.mean.head<3>();
  g.size = best.mean.tail<3>().array().exp();
  g.yaw = best.mean[3];
  g.confirmed = o.confirmed;
  g.in_sight = o.visibility == Visibility::kVisible || o.visibility == Visibility::kPartial;
  g.visibility = o.visibility;
  g.blocked_by = o.blocked_by;
  g.hits = o.hits;
  g.visible_misses = o.visible_misses;
  g.first_seen = o.first_seen;
  g.bits = bitsOf(o);
  return g;
}

}  // namespace

double Glance::probability(const std::string& class_name) const {
  double sum = 0.0;
  for (const auto& [name, p] : pmf) sum += name == class_name ? existence * p : 0.0;
  return sum;
}

const Glance* JournalFrame::find(ObjectId id) const {
  const auto found =
      std::find_if(objects.begin(), objects.end(), [&](const Glance& g) { return g.id == id; });
  return found == objects.end() ? nullptr : &*found;
}

void Journal::add(const Objects& objects) {
  JournalFrame record{objects.stamp.sequence, objects.stamp.time, objects.T_WB, {}};
  for (const auto& object : objects.objects) record.objects.push_back(glanceOf(object));
  frames.push_back(std::move(record));
  last = objects;
}

const JournalFrame* Journal::at(std::uint64_t frame) const {
  const auto found = std::find_if(frames.begin(), frames.end(),
                                  [&](const JournalFrame& f) { return f.frame == frame; });
  return found == frames.end() ? nullptr : &*found;
}

std::vector<std::pair<const JournalFrame*, const Glance*>> Journal::of(ObjectId id) const {
  std::vector<std::pair<const JournalFrame*, const Glance*>> result;
  for (const auto& f : frames) {
    if (const Glance* g = f.find(id)) result.emplace_back(&f, g);
  }
  return result;
}

}  // namespace perdure::test
