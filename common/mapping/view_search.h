// Looks for the body by what places look like: the second cue beside objects. It proposes loops
// where objects say nothing, and is a second witness of those that objects propose.
// Derivation: tools/docs/maths/appearance.md.
#pragma once

#include <optional>

#include "common/mapping/appearance/view.h"
#include "common/mapping/appearance/view_match.h"
#include "common/mapping/loop_search.h"

namespace perdure::mapping {

class ViewSearch {
 public:
  explicit ViewSearch(const Parameters& parameters) : parameters_(parameters) {}

  /// `seen`: landmarks of the way of late, in the body's newest anchor. Among what hangs together
  /// with the body by the graph: only what would make its place clearly better known.
  std::optional<LoopSearch::Found> nearby(const Whereabouts& body, const View& seen) const;
  /// In the components of the graph that the body's session does not hang together with.
  std::optional<LoopSearch::Found> elsewhere(const Whereabouts& body, const View& seen) const;
  /// Whether what the place looks like says surely that the body is elsewhere than `found` does.
  bool contradicts(const LoopSearch::Found& found, const Whereabouts& body, const View& seen) const;

 private:
  bool isBelieved(const PlaceMatch& match) const;

  Parameters parameters_;
};

}  // namespace perdure::mapping
