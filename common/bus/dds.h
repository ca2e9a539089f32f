// Cyclone's C API with owning pointers. Internal to common/bus, which alone includes that API.
#pragma once

#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>

#include <memory>
#include <string>

#include "common/bus/endpoint.h"

namespace perdure::bus {

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDeleter>;

/// The entity of a handle that DDS returned. Throws StartupError if it is an error.
Entity created(dds_entity_t handle, const std::string& what);

/// QoS of a writer. `through`: whether it may use shared memory. Cyclone excludes endpoints that
/// ignore their own participant from shared memory. Exclusive writers are excluded by their
/// liveliness, and their readers may need messages of their own participant.
QosPtr writerQos(const Qos& qos, const WriterOptions& options, const SharedMemory& memory,
                 bool through);

}  // namespace perdure::bus
