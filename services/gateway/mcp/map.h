// The map that the MCP server is asked about: a file, or the running services.
#pragma once

#include <optional>
#include <stdexcept>
#include <vector>

#include "common/mapping/frames/sight.h"
#include "common/types/map.h"

namespace perdure::gateway::mcp {

/// The reason, with the fix, why a question has no answer.
struct NoAnswer : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An object that is not on the map any more.
struct Ended {
  EventKind kind = EventKind::kGone;  ///< kGone, kMoved or kMerged
  TimePoint time;
  ObjectId merged_into = 0;
  /// The last known belief, in M. It has no classes if only its id and existence are known.
  ObjectBelief last;
};

struct State {
  TimePoint now;                        ///< time of the newest frame
  std::vector<mapping::Sight> cameras;  ///< empty: not known
  std::vector<Ended> ended;             ///< by time
  std::optional<TimePoint> ended_from;  ///< `ended` may lack earlier ones; nothing: it is complete
};

class Map {
 public:
  virtual ~Map() = default;
  /// Begins a question: the replies until the next call are about one state of a file.
  virtual State begin() = 0;
  /// Answers in M. Both functions throw NoAnswer or StartupError.
  virtual MapReply ask(const MapQuery& query) = 0;
  /// Whether clients may correct the map.
  virtual bool takesCorrections() const { return false; }
  /// Returns the correction as the map stores it. Throws as ask().
  virtual Correction correct(const Correction& /*correction*/) {
    throw NoAnswer("this map takes no corrections");
  }
};

}  // namespace perdure::gateway::mcp
