#include "services/gateway/mcp/worker.h"

#include <chrono>
#include <optional>
#include <utility>

namespace perdure::gateway::mcp {

Worker::Worker(const bus::Participant& participant, bool takes_corrections,
               std::function<void(std::uint64_t, const Answer&)> reply)
    : participant_(participant),
      takes_corrections_(takes_corrections),
      reply_(std::move(reply)),
      thread_([this] { run(); }) {}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Worker::put(Question question) {
  constexpr std::size_t kMostWaiting = 16;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kMostWaiting) {
      waiting_.push_back(std::move(question));
      changed_.notify_all();
      return;
    }
  }
  reply_(question.number, {503, "too many questions wait for the map"});
}

/// Readers and writers are opened by the first question, because most gateways have no MCP client.
void Worker::run() {
  std::optional<BusMap> map;
  std::unique_lock lock(mutex_);
  while (!over_) {
    if (waiting_.empty()) {
      changed_.wait_for(lock, std::chrono::seconds(map ? 1 : 60));
    }
    if (map) map->follow();
    if (over_ || waiting_.empty()) continue;
    const Question question = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    if (!map) map.emplace(participant_, takes_corrections_);
    reply_(question.number, answer(question.message, *map));
    lock.lock();
  }
}

}  // namespace perdure::gateway::mcp
