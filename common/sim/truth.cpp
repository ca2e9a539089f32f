#include "common/sim/truth.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr double kKeysPerSecond = 10.0;

TruthKey keyAt(const SceneObject& object, double t_s, TimePoint epoch) {
  const RigidTransform T_WO = object.motion.poseAt(t_s);
  return {epoch + durationFromSeconds(t_s), T_WO.p, yawOf(T_WO.R())};
}

bool samePlace(const TruthKey& a, const TruthKey& b) {
  return (a.centre_W - b.centre_W).norm() < 1e-6 && std::abs(wrapAngle(a.yaw - b.yaw)) < 1e-6;
}

/// The time between `before_s` and `after_s` at which an object jumps.
double timeOfStep(const SceneObject& object, double before_s, double after_s) {
  const TruthKey start = keyAt(object, before_s, {});
  while (after_s - before_s > 1e-4) {
    const double middle = 0.5 * (before_s + after_s);
    (samePlace(start, keyAt(object, middle, {})) ? before_s : after_s) = middle;
  }
  return after_s;
}

/// Keys of an object that rests: one at the start of each rest that lasts at least one sample.
std::vector<TruthKey> keysOfStanding(const SceneObject& object, double seconds, TimePoint epoch) {
  std::vector<TruthKey> keys{keyAt(object, 0.0, epoch)};
  double last_s = 0.0;
  for (int i = 1; last_s < seconds; ++i) {
    const double t_s = i / kKeysPerSecond;
    TruthKey key = keyAt(object, t_s, epoch);
    if (!samePlace(keys.back(), key)) {
      key.time = epoch + durationFromSeconds(timeOfStep(object, last_s, t_s));
      keys.push_back(key);
    }
    last_s = t_s;
  }
  return keys;
}

std::vector<TruthKey> keysOfMoving(const SceneObject& object, double seconds, TimePoint epoch) {
  std::vector<TruthKey> keys;
  for (int i = 0; keys.empty() || (i - 1) / kKeysPerSecond < seconds; ++i) {
    keys.push_back(keyAt(object, i / kKeysPerSecond, epoch));
    const std::size_t n = keys.size();
    // A rest needs only its first and last keys.
    if (n >= 3 && samePlace(keys[n - 1], keys[n - 2]) && samePlace(keys[n - 2], keys[n - 3])) {
      keys.erase(keys.end() - 2);
    }
  }
  return keys;
}

nlohmann::ordered_json jsonOf(const TruthObject& object) {
  nlohmann::ordered_json keys = nlohmann::ordered_json::array();
  for (const TruthKey& key : object.keys) {
    keys.push_back({{"time_ns", toNanoseconds(key.time)},
                    {"centre", {key.centre_W.x(), key.centre_W.y(), key.centre_W.z()}},
                    {"yaw", key.yaw}});
  }
  return {{"id", object.id},
          {"class", object.class_name},
          {"looks_like", object.looks_like},
          {"size", {object.size.x(), object.size.y(), object.size.z()}},
          {"moves", object.moves},
          {"present_from_ns", toNanoseconds(object.present_from)},
          {"present_until_ns", toNanoseconds(object.present_until)},
          {"keys", keys}};
}

}  // namespace

TruthKey TruthObject::at(TimePoint t) const {
  const auto after = std::ranges::upper_bound(keys, t, {}, &TruthKey::time);
  if (after == keys.begin()) return keys.front();
  const TruthKey& before = *(after - 1);
  if (!moves || after == keys.end()) return before;
  const double s = toSeconds(t - before.time) / toSeconds(after->time - before.time);
  return {t, before.centre_W + s * (after->centre_W - before.centre_W),
          wrapAngle(before.yaw + s * wrapAngle(after->yaw - before.yaw))};
}

Box clipped(const Box& b, double width, double height) {
  return {std::clamp(b.x1, 0.0, width), std::clamp(b.y1, 0.0, height), std::clamp(b.x2, 0.0, width),
          std::clamp(b.y2, 0.0, height)};
}

Box TruthView::boxInside(double width, double height) const {
  return clipped(inside ? *inside : box, width, height);
}

std::vector<TruthObject> truthOf(const Scene& scene, TimePoint epoch) {
  std::vector<TruthObject> objects;
  for (const SceneObject& object : scene.objects) {
    TruthObject truth;
    truth.id = object.id;
    truth.class_name = object.class_name;
    truth.looks_like = object.looks_like;
    truth.size = object.size;
    truth.moves = object.moves && !object.steps;
    truth.present_from = epoch + durationFromSeconds(object.present_from_s);
    truth.present_until = epoch + durationFromSeconds(object.present_until_s);
    truth.keys = truth.moves ? keysOfMoving(object, scene.seconds, epoch)
                             : keysOfStanding(object, scene.seconds, epoch);
    objects.push_back(std::move(truth));
  }
  return objects;
}

void writeObjectsTruth(const std::filesystem::path& folder,
                       const std::vector<TruthObject>& objects) {
  const auto file = folder / kObjectsTruthFile;
  std::ofstream stream(file, std::ios::binary);
  stream << "{\"objects\": [";
  const char* separator = "\n";
  for (const TruthObject& object : objects) {
    stream << separator << jsonOf(object).dump();
    separator = ",\n";
  }
  stream << "\n]}\n";
  stream.close();
  if (!stream) {
    throw StartupError(ExitCode::kUnavailable,
                       file.string() + " cannot be written; check the folder and the disk's space");
  }
}

}  // namespace perdure::sim
