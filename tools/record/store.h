// The recorder's thread: packs chunks and writes them, or keeps them for a fault. The bus never
// waits for the disk.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/base/bounded_queue.h"
#include "tools/record/black_box.h"
#include "tools/record/segment_writer.h"

namespace perdure::tools {

struct StoreOptions {
  double segment_s = 60.0;
  double last_s = 0.0;    ///< > 0: a black box of so many seconds, written at faults alone
  double after_s = 10.0;  ///< seconds that follow the fault in its file
  std::uint64_t memory = 512u << 20;  ///< most of the black box, bytes
};

/// What became of the messages, since the start.
struct StoreReport {
  std::uint64_t chunks = 0;    ///< that came
  std::uint64_t messages = 0;  ///< in files, or held for a fault
  std::uint64_t lost = 0;      ///< while the disk was full or failed
  std::uint64_t bytes = 0, files = 0, removed = 0, folder_bytes = 0, dumps = 0;
  std::uint64_t overrun = 0;    ///< chunks that the disk was too slow for
  std::uint64_t cut_short = 0;  ///< chunks that the black box had no memory for
  std::string problem;          ///< empty where all is well
  bool disk_full = false;       ///< that is the problem
  std::string lost_to;          ///< the problem for which messages were lost last
};

class Store {
 public:
  Store(const StoreOptions& options, SegmentFolder& folder);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  struct Job {
    replay::mcap::Draft draft;
    CatalogueNow catalogue;
    LatchedNow latched;
    std::int64_t steady_ns = 0;
    bool fault = false;  ///< writes down what is held, up to and with this one
  };
  /// Returns at once; what the disk is too slow for is lost, the oldest first, and counted.
  void give(Job job);
  /// All that was given is written and the last file ended when this returns.
  void finish();
  StoreReport report() const;

 private:
  void run();
  void handle(Job job);
  void write(const PackedChunk& chunk);
  void writeBlackBox(PackedChunk chunk, bool fault);
  void publish();

  const StoreOptions options_;
  SegmentFolder& folder_;
  SegmentWriter writer_;
  std::optional<BlackBox> black_box_;
  std::optional<std::int64_t> dump_until_ns_;
  std::atomic<bool> fault_ = false;
  StoreReport now_;  // of the thread
  mutable std::mutex mutex_;
  StoreReport report_;
  BoundedQueue<Job> queue_;
  std::thread thread_;
};

}  // namespace perdure::tools
