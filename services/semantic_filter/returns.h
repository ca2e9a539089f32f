// Says when what is hidden should be seen again: when it is hidden, and anew where that has changed
// or half of the time until then has passed, so that what is said gets better as it comes near.
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
  /// Events of kind kPredictedReturn, for one published frame; `blank` has stamp and writer.
  std::vector<Event> update(const std::vector<Track>& objects, const FrameInput& now,
                            const std::optional<ComingFrame>& coming, const Parameters& parameters,
                            const Event& blank);
  void clear();

 private:
  struct Velocity {
    TimePoint time;
    Eigen::Vector3d v_W;
  };

  void addKeyframe(const FrameInput& now, const Way& way);
  double speedWalk() const;

  struct Waiting {
    std::uint32_t hits = 0;             ///< when it was hidden
    TimePoint asked_again;              ///< not before
    std::optional<TimePoint> expected;  ///< as said last
    double then_s = 0.0;                ///< how far off it was
  };

  bool waits(const Track& object, const Parameters& parameters) const;
  static bool isNews(const Waiting& waiting, TimePoint expected, double seconds, double frame_s);

  std::map<ObjectId, Waiting> waiting_;
  std::deque<Velocity> velocities_;
};

}  // namespace perdure::semantic_filter
