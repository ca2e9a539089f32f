// Sends the changes of a map's file to a fleet's server, in a separate thread. The service never
// waits for the server, because the file is the buffer. Entries that the server has not confirmed
// stay in the file's outbox, even if either side restarts.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "services/map_store/fleet/server_url.h"

namespace perdure::map_store::fleet {

struct Pace {
  std::chrono::milliseconds connect{10'000};   ///< time limit for a connection
  std::chrono::milliseconds answer{20'000};    ///< longest time in which nothing is sent or
                                               ///< received
  std::chrono::milliseconds first_retry{250};  ///< doubles with each failure
  std::chrono::milliseconds longest_retry{8'000};
  std::int64_t most_rows = 2'000;  ///< most rows in one transaction; halved if the server is too
                                   ///< slow
};

struct Progress {
  std::int64_t sent = 0;  ///< the server has the entries of the outbox up to this one
  bool whole = false;     ///< whether the server has the state of the file at the last wake()
  std::uint64_t rows = 0, portions = 0;
  double latency_s = 0.0;  ///< from the wake() last served until its changes were on the server
  ReasonCounts reasons;    ///< reasons of link.h and pusher.h, and "postgis_missing"
  std::string failing;     ///< reason why sending fails now; empty if it does not fail
  std::string trouble;     ///< the same as a sentence with the fix
  std::string notice;      ///< a sentence for the log that does not report a failure; may be empty
};

class Replicator {
 public:
  /// The outbox of `file` must be open (core/outbox.h). Throws StartupError as server_url.h does.
  Replicator(const Parameters& parameters, std::string file, const Pace& pace = {});
  ~Replicator();  ///< ends the thread at once, even if the server does not answer
  Replicator(const Replicator&) = delete;
  Replicator& operator=(const Replicator&) = delete;

  /// Call it when the file has changed. Returns at once.
  void wake();
  Progress progress() const;
  /// Waits until all changes are sent, or until `patience` has passed. Returns whether all are
  /// sent.
  bool finish(std::chrono::milliseconds patience);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace perdure::map_store::fleet
