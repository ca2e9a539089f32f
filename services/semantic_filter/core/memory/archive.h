// Which tracks leave the working set for the map, and when the map is asked for those that may
// come near the view (DESIGN 5, item 13; the paper's "semantic map").
//
// Nothing is let go before the map says that it has it on the disk: without a map, or with a slow
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

  /// What is to leave the working set now; ids in order.
  struct Leaving {
    std::vector<ObjectId> archived;   ///< at rest and on the map: they wait there
    std::vector<ObjectId> forgotten;  ///< that never was more than a guess, or drove off unseen
  };
  /// After the step of a frame at `now`, the body at p_WB. Frames from `oldest` on may be stepped
  /// again: what they showed stays.
  Leaving leaving(const std::vector<Track>& tracks, const Eigen::Vector3d& p_WB, TimePoint now,
                  TimePoint oldest);

  /// What to ask the map for.
  struct Question {
    std::uint64_t request = 0;
    Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();
    double radius_m = 0.0;
  };
  /// The question that is due. One at a time is open; while nobody answers it is asked again each
  /// second, and counted.
  std::optional<Question> ask(const Eigen::Vector3d& p_WB, TimePoint now);
  /// The map answered; it has all frames up to `kept` on the disk. False: to no open question.
  bool answered(std::uint64_t request, TimePoint kept, bool truncated);
  /// Whether something at p_WO is near enough to be in the working set.
  bool near(const Eigen::Vector3d& p_WO, const Eigen::Vector3d& p_WB) const;
  /// How often since the last call a question had to be asked again.
  std::uint64_t takeUnanswered() { return std::exchange(unanswered_, 0); }

  /// Cross-covariances with the pose error refer to the product of its transitions at the time that
  /// the belief is of. The map does not hold that product.
  /// Nor how W lay to M, in which nothing drifts, when the track went.
  struct Reference {
    Matrix6d product;
    std::optional<RigidTransform> T_MW;
  };
  void rememberReference(const Track& track, const std::optional<RigidTransform>& T_MW);
  /// Nothing where the belief is of another run, or too much was archived since.
  std::optional<Reference> referenceAt(TimePoint as_of) const;

  /// Another frame of reference begins.
  void clear();

 private:
  bool farAndUnseen(const Track& track, const Eigen::Vector3d& p_WB, TimePoint now,
                    TimePoint oldest) const;
  bool due(const Eigen::Vector3d& p_WB, TimePoint now) const;

  MemoryParameters parameters_;
  double min_speed_;  ///< m/s; what is slower stands
  /// Since when an track could leave; it may as soon as the map has a frame from then on.
  std::map<ObjectId, TimePoint> waiting_;
  TimePoint kept_;
  std::optional<Question> open_;
  std::optional<TimePoint> asked_at_;
  std::optional<Eigen::Vector3d> known_around_;  ///< centre of the newest question answered in full
  std::uint64_t requests_ = 0, unanswered_ = 0;
  std::map<TimePoint, Reference> references_;
};

}  // namespace perdure::semantic_filter
