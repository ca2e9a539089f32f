// The map of the running services. Objects and the graph are those of map_store; objects that ended
// are those of the events since the start.
#pragma once

#include <deque>
#include <optional>

#include "common/bus/map_client.h"
#include "common/types/objects.h"
#include "common/types/sensors.h"
#include "services/gateway/mcp/map.h"

namespace perdure::gateway::mcp {

/// Use it from one thread at a time.
class BusMap : public Map {
 public:
  explicit BusMap(const bus::Participant& participant, bool takes_corrections = false);

  /// Takes the events that have arrived. Call it about once a second, because their reader keeps
  /// only the newest.
  void follow();
  State begin() override;
  MapReply ask(const MapQuery& query) override;
  bool takesCorrections() const override { return takes_corrections_; }
  Correction correct(const Correction& correction) override;

 private:
  void onEvent(const Event& event);
  std::optional<Objects> newestObjects() const;

  const bus::Participant& participant_;
  const bool takes_corrections_;
  bus::MapClient client_;
  bus::Reader<Event> events_;
  bus::Reader<Calibration> calibrations_;
  std::optional<Calibration> calibration_;
  std::optional<TimePoint> first_event_, last_event_;
  std::deque<Ended> ended_;
};

}  // namespace perdure::gateway::mcp
