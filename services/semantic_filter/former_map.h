// The map of a frame of reference that ended: what was in the working set then waits here until it
// is known where it lies in the new one (core/map_alignment); what else the map store has of it is
// asked for as the body comes near.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/semantic_filter/core/memory/archive.h"
#include "services/semantic_filter/core/memory/map_alignment.h"

namespace perdure::semantic_filter {

class FormerMap {
 public:
  explicit FormerMap(const Parameters& parameters)
      : parameters_(parameters), questions_(parameters.memory, parameters.motion.min_speed) {}

  /// What was known when `world` ended. Of two that were not found again the one with more things
  /// is kept.
  void keep(const WorldId& world, const std::vector<ObjectBelief>& objects);
  /// The frame of reference that is looked for, or was found.
  const std::optional<WorldId>& world() const { return world_; }
  bool waits() const { return lookout_.has_value(); }
  bool found() const { return alignment_.has_value(); }
  /// For people; empty where nothing is looked for.
  std::string note() const;

  /// KeyframeBatch for it where that is due. The alignment when it was found just now.
  const FrameAlignment* look(const std::vector<Track>& objects, const Eigen::Vector3d& p_WB,
                             TimePoint now);
  /// What waited, in W.
  std::vector<ObjectBelief> takeKept();
  /// What of it was seen again says better where it lies about here.
  void refine(const std::vector<Track>& objects);
  /// A belief of that map, in W.
  ObjectBelief laid(const ObjectBelief& belief);

  /// What to ask the map store for, in its own frame.
  std::optional<Archive::Question> ask(const Eigen::Vector3d& p_WB, TimePoint now);
  bool answered(std::uint64_t request, TimePoint kept, bool truncated) {
    return questions_.answered(request, kept, truncated);
  }
  std::uint64_t takeUnanswered() { return questions_.takeUnanswered(); }

 private:
  Parameters parameters_;
  Archive questions_;
  std::optional<WorldId> world_;
  std::vector<ObjectBelief> kept_;
  std::optional<MapAlignment> lookout_;
  std::optional<FrameAlignment> alignment_;
  std::map<ObjectId, std::pair<PlacedThing, std::uint32_t>> laid_;  ///< in M, and its hits then
  std::optional<Eigen::Vector3d> looked_from_;
  TimePoint looked_at_;
  std::size_t looked_with_ = 0;
};

}  // namespace perdure::semantic_filter
