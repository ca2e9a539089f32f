// Reads and decodes the messages of a drive ahead, on a thread of its own.
#pragma once

#include <exception>
#include <optional>
#include <thread>

#include "common/base/bounded_queue.h"
#include "common/replay/dataset.h"

namespace perdure::replay {

class ReadAhead {
 public:
  /// Up to `messages` ahead. `drive` must outlive this and is read by nobody else meanwhile.
  explicit ReadAhead(Dataset& drive, std::size_t messages = 64);
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// As Dataset::next, with what that throws.
  std::optional<Message> next();

 private:
  void run();

  Dataset& drive_;
  BoundedQueue<Message> queue_;
  std::exception_ptr failure_;  ///< written before the queue is closed
  std::thread thread_;
};

}  // namespace perdure::replay
