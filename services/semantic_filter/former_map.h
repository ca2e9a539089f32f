// The map of a frame of reference that has ended. Its working set waits here until map alignment
// finds where it lies in the new frame. After that, the map store is asked for the rest as the body
// comes near. Derivation: tools/docs/maths/map_alignment.md.
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
  FormerMap(const Parameters& parameters, const ClassPriors& priors)
      : parameters_(parameters),
        priors_(priors),
        questions_(parameters.memory, parameters.motion.min_speed) {}

  /// Keeps the objects known when `world` ended. If an earlier map still waits, the one with more
  /// objects is kept.
  void keep(const WorldId& world, const std::vector<ObjectBelief>& objects);
  /// The frame of reference that is sought, or was found.
  const std::optional<WorldId>& world() const { return world_; }
  bool waits() const { return lookout_.has_value(); }
  bool found() const { return alignment_.has_value(); }
  /// A sentence for users; empty if no map is sought.
  std::string note() const;

  /// Searches for the map if a search is due. Returns the alignment if it was found just now.
  const FrameAlignment* look(const std::vector<Track>& objects, const Eigen::Vector3d& p_WB,
                             TimePoint now);
  /// Returns the waiting objects, transformed into W.
  std::vector<ObjectBelief> takeKept();
  /// Refines the alignment near the body with objects of the map that were detected again.
  void refine(const std::vector<Track>& objects);
  /// Transforms a belief of that map into W.
  ObjectBelief laid(const ObjectBelief& belief);

  /// Returns the question for the map store that is due, in the frame of that map.
  std::optional<Archive::Question> ask(const Eigen::Vector3d& p_WB, TimePoint now);
  bool answered(std::uint64_t request, TimePoint kept, bool truncated) {
    return questions_.answered(request, kept, truncated);
  }
  std::uint64_t takeUnanswered() { return questions_.takeUnanswered(); }

 private:
  Parameters parameters_;
  ClassPriors priors_;
  Archive questions_;
  std::optional<WorldId> world_;
  std::vector<ObjectBelief> kept_;
  std::optional<MapAlignment> lookout_;
  std::optional<FrameAlignment> alignment_;
  /// objects in M, with their hits then
  std::map<ObjectId, std::pair<PlacedThing, std::uint32_t>> laid_;
  std::optional<Eigen::Vector3d> looked_from_;
  TimePoint looked_at_;
  std::size_t looked_with_ = 0;
};

}  // namespace perdure::semantic_filter
