// Cyclone's C API with owning pointers. Internal to common/bus: the only place that includes it.
#pragma once

#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>

#include <memory>

namespace perdure::bus {

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDeleter>;

}  // namespace perdure::bus
