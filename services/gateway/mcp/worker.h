// Answers messages of MCP clients in a thread of its own, because a question waits for map_store.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "services/gateway/mcp/bus_map.h"
#include "services/gateway/mcp/protocol.h"

namespace perdure::gateway::mcp {

struct Question {
  std::uint64_t number = 0;
  std::string message;
};

class Worker {
 public:
  /// `reply` is called in the thread, or in put().
  Worker(const bus::Participant& participant, bool takes_corrections,
         std::function<void(std::uint64_t, const Answer&)> reply);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Queues a message. If too many wait, it is answered by status 503.
  void put(Question question);

 private:
  void run();

  const bus::Participant& participant_;
  const bool takes_corrections_;
  const std::function<void(std::uint64_t, const Answer&)> reply_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Question> waiting_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace perdure::gateway::mcp
