// Sends map queries and corrections to the running map_store.
#pragma once

#include <cstdint>
#include <optional>

#include "common/bus/endpoint.h"
#include "common/bus/wait_loop.h"
#include "common/types/map.h"

namespace perdure::bus {

/// Use it from one thread at a time.
class MapClient {
 public:
  explicit MapClient(const Participant& participant);
  MapClient(const MapClient&) = delete;
  MapClient& operator=(const MapClient&) = delete;

  /// Waits until reader and writer are matched, because DDS silently drops earlier requests. Then
  /// repeats the request until a reply arrives. After `patience_s`, fails with "no_map_store" if
  /// nothing matched, else with "no_answer".
  Result<MapReply> ask(const MapQuery& query, double patience_s);
  Result<MapReply> correct(const Correction& correction, double patience_s);

 private:
  template <class Question>
  Result<MapReply> ask(Writer<Question>& questions, Question question, double patience_s);

  const Participant& participant_;
  Writer<MapQuery> questions_;
  Reader<MapReply> answers_;
  WaitLoop loop_;
  const InstanceId client_ = makeInstanceId();
  std::uint64_t request_ = 0;
  std::optional<MapReply> reply_;
};

}  // namespace perdure::bus
