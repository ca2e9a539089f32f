#include "services/semantic_filter/return_events.h"

#include <algorithm>
#include <cmath>

#include "common/base/scratch.h"
#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kRemembered_s = 8.0;
constexpr double kShortestPause_s = 0.2;  // for an object that should already be visible
constexpr double kLongestPause_s = 0.5;   // longest interval until the time is computed again
constexpr double kNewShare = 0.2;  // least relative change of the remaining time that is published

TimePoint later(TimePoint time, double seconds) {
  return time + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * seconds));
}

bool inSight(const Track& o) { return o.visibility.fraction > 0.0; }

}  // namespace

/// Whether a confirmed object at rest is occluded, or visible again but not detected since. In the
/// latter case an occluding edge may be misjudged.
bool ReappearanceMonitor::waits(const Track& o, const Parameters& parameters) const {
  if (!o.life.confirmed || movingProbability(o, parameters.motion.min_speed) >= 0.5) return false;
  if (o.visibility.state == Visibility::kOccluded) return true;
  const auto known = waiting_.find(o.id);
  return inSight(o) && known != waiting_.end() && o.life.hits == known->second.hits;
}

void ReappearanceMonitor::addKeyframe(const FrameInput& now, const Way& way) {
  velocities_.push_back({now.stamp.time, now.view.T_WB.R() * (way.step.p / way.seconds)});
  while (toSeconds(now.stamp.time - velocities_.front().time) > kRemembered_s) {
    velocities_.pop_front();
  }
}

/// Returns the random walk of the velocity, m/s per √s: the largest over several lags, because that
/// of a swaying body is smaller over long lags.
double ReappearanceMonitor::speedWalk() const {
  double most = 0.0;
  for (const double lag : {0.1, 0.5, 1.0, 2.0, 4.0}) {
    double sum = 0.0, pairs = 0.0;
    auto before = velocities_.begin();
    for (const Velocity& v : velocities_) {
      while (toSeconds(v.time - before->time) > lag) ++before;
      const double seconds = toSeconds(v.time - before->time);
      if (seconds < 0.5 * lag) continue;
      sum += (v.v_W - before->v_W).squaredNorm() / seconds;
      pairs += 1.0;
    }
    if (pairs > 0.0) most = std::max(most, sum / pairs);
  }
  return std::sqrt(most);
}

bool ReappearanceMonitor::isNews(const Waiting& waiting, TimePoint expected, double seconds,
                                 double frame_s) {
  if (!waiting.expected || seconds <= 0.5 * waiting.then_s) return true;
  const double change = std::abs(toSeconds(expected - *waiting.expected));
  return change > std::max(0.5 * frame_s, kNewShare * seconds);
}

std::vector<Event> ReappearanceMonitor::update(const std::vector<Track>& objects,
                                               const FrameInput& now,
                                               const std::optional<ComingFrame>& coming,
                                               const Parameters& parameters, const Event& blank) {
  if (!coming) return {};
  Way way{now.view.T_WB.inverse() * coming->view.T_WB, coming->seconds};
  addKeyframe(now, way);
  ScratchVector<ObjectId> hidden;
  std::vector<Event> events;
  for (const Track& o : objects) {
    if (!waits(o, parameters)) continue;
    hidden.push_back(o.id);
    const auto [known, fresh] = waiting_.try_emplace(o.id);
    Waiting& waiting = known->second;
    if (fresh) waiting.hits = o.life.hits;
    if (now.stamp.time < waiting.asked_again) continue;
    const auto seconds = expectedReappearance(objects, o, now, way, parameters.visibility);
    const double pause = std::clamp(0.25 * seconds.value_or(kRemembered_s),
                                    inSight(o) ? kShortestPause_s : 0.0, kLongestPause_s);
    waiting.asked_again = later(now.stamp.time, pause);
    if (!seconds) continue;
    const TimePoint expected = later(now.stamp.time, *seconds);
    if (!isNews(waiting, expected, *seconds, way.seconds)) continue;
    way.speed_walk = speedWalk();
    const auto foreseen = reappearanceInterval(objects, o, now, way, parameters.visibility);
    if (!foreseen) continue;
    waiting.expected = expected;
    waiting.then_s = *seconds;
    Event e = blank;
    e.kind = EventKind::kPredictedReturn;
    e.object_id = o.id;
    e.other_id = o.visibility.blocked_by;
    e.class_name = o.best().class_name;
    e.probability = o.existence;
    e.returns_in_s = {foreseen->expected, foreseen->earliest, foreseen->latest};
    events.push_back(e);
  }
  std::sort(hidden.begin(), hidden.end());
  std::erase_if(waiting_, [&](const auto& entry) {
    return !std::binary_search(hidden.begin(), hidden.end(), entry.first);
  });
  return events;
}

}  // namespace perdure::semantic_filter
