// Keeps a fleet's server up to date with a map's file, in a thread of its own. The file is the
// buffer: the service never waits for the server, and what the server has not confirmed stays in
// the file's outbox, over restarts of either.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "services/map_store/fleet/parameters.h"

namespace perdure::map_store::fleet {

/// How long is waited, and how much is sent at once.
struct Pace {
  std::chrono::milliseconds connect{10'000};   ///< for a connection
  std::chrono::milliseconds answer{20'000};    ///< while nothing is sent or received
  std::chrono::milliseconds first_retry{250};  ///< doubled with each failure
  std::chrono::milliseconds longest_retry{8'000};
  std::int64_t most_rows = 2'000;  ///< of one transaction; halved where the server is too slow
};

struct Progress {
  std::int64_t sent = 0;  ///< entries of the outbox up to this one are on the server
  bool whole = false;     ///< the server has all that the file had when it was last woken
  std::uint64_t rows = 0, portions = 0;
  double latency_s = 0.0;  ///< from the last wake whose changes are there until they were
  ReasonCounts reasons;    ///< of link.h and pusher.h, and "postgis_missing"
  std::string failing;     ///< the reason for which nothing is sent now, or nothing
  std::string trouble;     ///< the same as a sentence with the mend
  std::string notice;      ///< a sentence that is no trouble, or nothing
};

class Replicator {
 public:
  /// Of a file whose outbox is open (core/outbox.h). Throws StartupError as server_url.h does.
  Replicator(const Parameters& parameters, std::string file, const Pace& pace = {});
  ~Replicator();  ///< ends within a moment, whatever the server does
  Replicator(const Replicator&) = delete;
  Replicator& operator=(const Replicator&) = delete;

  /// The file has changed. Returns at once.
  void wake();
  Progress progress() const;
  /// Waits until all that has changed is sent, or the time is over.
  bool finish(std::chrono::milliseconds patience);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace perdure::map_store::fleet
