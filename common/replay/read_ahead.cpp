#include "common/replay/read_ahead.h"

namespace perdure::replay {

ReadAhead::ReadAhead(Dataset& drive, std::size_t messages)
    : drive_(drive), queue_(messages, Overflow::kBlock), thread_([this] { run(); }) {}

ReadAhead::~ReadAhead() {
  queue_.close();
  thread_.join();
}

std::optional<Message> ReadAhead::next() {
  auto message = queue_.pop();
  if (!message && failure_) std::rethrow_exception(failure_);
  return message;
}

void ReadAhead::run() {
  try {
    while (auto message = drive_.next()) {
      if (!queue_.push(std::move(*message))) return;
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  queue_.close();
}

}  // namespace perdure::replay
