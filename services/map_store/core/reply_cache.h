// Stores answers, so that a repeated request gets the same answer.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>

#include "common/types/map.h"

namespace perdure::map_store {

/// Stores the newest `capacity` replies by (client, request).
class ReplyCache {
 public:
  explicit ReplyCache(std::size_t capacity) : capacity_(capacity) {}

  /// Returns null if the request was not answered, or if its reply is no longer stored. The pointer
  /// is valid until the next call of keep().
  const MapReply* find(InstanceId client, std::uint64_t request) const {
    for (const auto& reply : replies_) {
      if (reply.client == client && reply.request == request) return &reply;
    }
    return nullptr;
  }

  void keep(MapReply reply) {
    replies_.push_back(std::move(reply));
    while (replies_.size() > capacity_) replies_.pop_front();
  }

 private:
  std::size_t capacity_;
  std::deque<MapReply> replies_;
};

}  // namespace perdure::map_store
