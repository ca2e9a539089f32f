// Answers that were given, so that a request that comes again gets the same one.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>

#include "common/types/map.h"

namespace perdure::map_store {

/// Keeps the newest `capacity` replies by (client, request).
class ReplyCache {
 public:
  explicit ReplyCache(std::size_t capacity) : capacity_(capacity) {}

  /// Null where the request was not answered, or long ago. Valid until the next call of keep.
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
