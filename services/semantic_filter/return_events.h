// Publishes the reappearance times of occluded objects, and again when they have changed or half of
// the time has passed. Derivation: tools/docs/maths/reappearance_time.md.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/visibility/predicted_box.h"
#include "services/semantic_filter/core/visibility/return_time.h"

namespace perdure::semantic_filter {

class ReappearanceMonitor {
 public:
  /// Returns events kPredictedReturn of one frame. `blank`: an event with stamp and writer.
  std::vector<Event> update(const std::vector<Track>& objects, const FrameInput& now,
                            const std::optional<ComingFrame>& coming, const Parameters& parameters,
                            const Event& blank);
  void clear() { *this = {}; }

 private:
  struct Velocity {
    TimePoint time;
    Eigen::Vector3d v_W;
  };

  void addKeyframe(const FrameInput& now, const Way& way);
  double speedWalk() const;

  struct Waiting {
    std::uint32_t hits = 0;             ///< number of hits when it became occluded
    TimePoint asked_again;              ///< earliest time of the next computation
    std::optional<TimePoint> expected;  ///< as last published
    double then_s = 0.0;                ///< remaining time as last published, s
  };

  bool waits(const Track& object, const Parameters& parameters) const;
  static bool isNews(const Waiting& waiting, TimePoint expected, double seconds, double frame_s);

  std::map<ObjectId, Waiting> waiting_;
  std::deque<Velocity> velocities_;
};

}  // namespace perdure::semantic_filter
