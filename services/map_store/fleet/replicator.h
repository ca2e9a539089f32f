// Keeps a fleet's server up to date with a map's file, in its own thread. The file is the buffer:
// the service never waits for the server. Entries that the server has not confirmed stay in the
// file's outbox, even if either side restarts.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "services/map_store/fleet/server_url.h"

namespace perdure::map_store::fleet {

struct Pace {
  std::chrono::milliseconds connect{10'000};   ///< limit for a connection
  std::chrono::milliseconds answer{20'000};    ///< while nothing is sent or received
  std::chrono::milliseconds first_retry{250};  ///< doubles with each failure
  std::chrono::milliseconds longest_retry{8'000};
  std::int64_t most_rows = 2'000;  ///< in one transaction; halved if the server is too slow
};

struct Progress {
  std::int64_t sent = 0;  ///< the server has the entries of the outbox up to this one
  bool whole = false;     ///< whether the server has all that the file had at the last wake
  std::uint64_t rows = 0, portions = 0;
  double latency_s = 0.0;  ///< from the last served wake until its changes were on the server
  ReasonCounts reasons;    ///< reasons of link.h and pusher.h, and "postgis_missing"
  std::string failing;     ///< the reason why sending fails now; empty: none
  std::string trouble;     ///< the same as a sentence with the fix
  std::string notice;      ///< a sentence that reports no failure; may be empty
};

class Replicator {
 public:
  /// The outbox of `file` must be open (core/outbox.h). Throws StartupError as server_url.h does.
  Replicator(const Parameters& parameters, std::string file, const Pace& pace = {});
  ~Replicator();  ///< ends quickly, even if the server does not answer
  Replicator(const Replicator&) = delete;
  Replicator& operator=(const Replicator&) = delete;

  /// The file has changed. Returns at once.
  void wake();
  Progress progress() const;
  /// Waits until all changes are sent, or until `patience` has passed.
  bool finish(std::chrono::milliseconds patience);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace perdure::map_store::fleet
