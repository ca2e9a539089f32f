// Archive: which tracks leave the working set for the map store, and when the map is asked for
// objects that may come near the view (the paper's semantic map, line 288). Derivation of what
// returns: tools/docs/maths/pose_error.md.
//
// Nothing leaves before the map store says that it is on disk. Without a map store, or with a slow
// one, the working set grows and nothing is lost.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

class Archive {
 public:
  Archive(const MemoryParameters& parameters, double min_speed)
      : parameters_(parameters), min_speed_(min_speed) {}

  /// The tracks that leave the working set now, ordered by id.
  struct Leaving {
    std::vector<ObjectId> archived;   ///< at rest and on the map, where they wait
    std::vector<ObjectId> forgotten;  ///< never confirmed, or moving and out of view
  };
  /// Is called after the step of a frame at `now`, with the body at p_WB. Frames from `oldest` on
  /// may be stepped again, so tracks detected in them stay.
  Leaving leaving(const std::vector<Track>& tracks, const Eigen::Vector3d& p_WB, TimePoint now,
                  TimePoint oldest);

  /// What the map is asked for.
  struct Question {
    std::uint64_t request = 0;
    Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();
    double radius_m = 0.0;
  };
  /// Returns the question that is due. Only one is open at a time. An unanswered one is asked again
  /// every second, and counted.
  std::optional<Question> ask(const Eigen::Vector3d& p_WB, TimePoint now);
  /// Takes an answer of the map, which has all frames up to `kept` on disk. Returns false if it
  /// answers no open question.
  bool answered(std::uint64_t request, TimePoint kept, bool truncated);
  /// Whether an object at p_WO is near enough for the working set.
  bool near(const Eigen::Vector3d& p_WO, const Eigen::Vector3d& p_WB) const;
  /// Returns how often a question was asked again since the last call.
  std::uint64_t takeUnanswered() { return std::exchange(unanswered_, 0); }

  /// The product of pose error transitions that the cross-covariance of an archived track refers
  /// to, which the map does not hold.
  void rememberReference(const Track& track);
  /// Returns nothing if the belief is of another run, or if too many were archived since.
  std::optional<Matrix6d> referenceAt(TimePoint as_of) const;

  /// Forgets everything: another frame of reference begins.
  void clear();

 private:
  bool farAndUnseen(const Track& track, const Eigen::Vector3d& p_WB, TimePoint now,
                    TimePoint oldest) const;
  bool due(const Eigen::Vector3d& p_WB, TimePoint now) const;

  MemoryParameters parameters_;
  double min_speed_;  ///< m/s; a slower track is at rest
  /// Since when each track could leave. It leaves once the map has a frame from then on.
  std::map<ObjectId, TimePoint> waiting_;
  TimePoint kept_;
  std::optional<Question> open_;
  std::optional<TimePoint> asked_at_;
  /// centre of the last question that was answered in full
  std::optional<Eigen::Vector3d> known_around_;
  std::uint64_t requests_ = 0, unanswered_ = 0;
  std::map<TimePoint, Matrix6d> references_;
};

}  // namespace perdure::semantic_filter
