// Place recognition by appearance, in addition to that by objects. Finds loops if objects give no
// evidence, and contradicts wrong loops that objects propose. Derivation:
// tools/docs/maths/appearance.md.
#pragma once

#include <optional>

#include "common/mapping/appearance/view.h"
#include "common/mapping/appearance/view_match.h"
#include "common/mapping/loop_search.h"

namespace perdure::mapping {

class ViewSearch {
 public:
  explicit ViewSearch(const Parameters& parameters) : parameters_(parameters) {}

  /// Searches the part of the graph that is linked to the body. `seen` has recent landmarks, in the
  /// axes of the body's newest anchor. Returns only results that clearly reduce the uncertainty of
  /// the body's position.
  std::optional<LoopSearch::Found> nearby(const Whereabouts& body, const View& seen) const;
  /// Searches the components of the graph that are not linked to the body's session.
  std::optional<LoopSearch::Found> elsewhere(const Whereabouts& body, const View& seen) const;
  /// Returns whether the appearance is strong evidence that the body is at a different place than
  /// `found`.
  bool contradicts(const LoopSearch::Found& found, const Whereabouts& body, const View& seen) const;

 private:
  bool isBelieved(const PlaceMatch& match) const;

  Parameters parameters_;
};

}  // namespace perdure::mapping
