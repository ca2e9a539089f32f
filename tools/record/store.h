// A thread packs chunks, and writes them or stores them until a fault.
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
  double last_s = 0.0;                ///< length of the black box for faults; 0: no black box
  double after_s = 10.0;              ///< seconds after the fault that are also written
  std::uint64_t memory = 512u << 20;  ///< size limit of the black box, bytes
};

/// Counts since the start.
struct StoreReport {
  std::uint64_t chunks = 0;    ///< number of received chunks
  std::uint64_t messages = 0;  ///< messages in files or in the black box
  std::uint64_t lost = 0;      ///< messages lost while the disk was full or failed
  std::uint64_t bytes = 0, files = 0, removed = 0, folder_bytes = 0, dumps = 0;
  std::uint64_t overrun = 0;    ///< chunks lost to a slow disk
  std::uint64_t cut_short = 0;  ///< chunks dropped because the black box was full
  std::string problem;          ///< problem of the recording; empty if there is none
  bool disk_full = false;       ///< whether the problem is a full disk
  std::string lost_to;          ///< the problem that last caused lost messages
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
    bool fault = false;  ///< the black box is to be written, including this chunk
  };
  /// Queues a chunk and returns at once. If the disk is too slow, drops and counts the oldest
  /// chunks.
  void give(Job job);
  /// Returns when all chunks are written and the last file is finished.
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
  StoreReport now_;  // used in the recorder's thread only
  mutable std::mutex mutex_;
  StoreReport report_;
  BoundedQueue<Job> queue_;
  std::thread thread_;
};

}  // namespace perdure::tools
