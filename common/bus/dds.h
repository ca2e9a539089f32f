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

/// Returns the entity of a handle. Throws StartupError if the handle is an error code of DDS;
/// `what` names the entity in the message.
Entity created(dds_entity_t handle, const std::string& what);

/// Returns the QoS of a writer. Unless `through`, the writer ignores its own participant, because
/// Cyclone then does not use shared memory. Exclusive writers do not ignore it: their liveliness
/// already excludes shared memory, and their own process may read the topic.
QosPtr writerQos(const Qos& qos, const WriterOptions& options, const SharedMemory& memory,
                 bool through);

}  // namespace perdure::bus
