// Reads and decodes the messages of a drive in advance, in a separate thread.
#pragma once

#include <exception>
#include <optional>
#include <thread>

#include "common/base/bounded_queue.h"
#include "common/replay/dataset.h"

namespace perdure::replay {

class ReadAhead {
 public:
  /// Reads up to `messages` in advance. `drive` must outlive this object, and nothing else may read
  /// it.
  explicit ReadAhead(Dataset& drive, std::size_t messages = 64);
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// Returns the next message and throws like Dataset::next.
  std::optional<Message> next();

 private:
  void run();

  Dataset& drive_;
  BoundedQueue<Message> queue_;
  std::exception_ptr failure_;  ///< written before the queue is closed
  std::thread thread_;
};

}  // namespace perdure::replay
