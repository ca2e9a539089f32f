// Cyclone's C API with owning pointers. Internal to common/bus, which alone includes that API.
#pragma once

#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>

#include <cstdint>
#include <memory>

namespace perdure::bus {

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDeleter>;

// Status counts of a reader or a writer since its start, as DDS reports them.

inline std::size_t matchedWriters(dds_entity_t reader) {
  dds_subscription_matched_status_t status{};
  dds_get_subscription_matched_status(reader, &status);
  return status.current_count;
}

inline std::size_t matchedReaders(dds_entity_t writer) {
  dds_publication_matched_status_t status{};
  dds_get_publication_matched_status(writer, &status);
  return status.current_count;
}

inline std::uint64_t writersWithOtherQos(dds_entity_t reader) {
  dds_requested_incompatible_qos_status_t status{};
  dds_get_requested_incompatible_qos_status(reader, &status);
  return status.total_count;
}

inline std::uint64_t readersWithOtherQos(dds_entity_t writer) {
  dds_offered_incompatible_qos_status_t status{};
  dds_get_offered_incompatible_qos_status(writer, &status);
  return status.total_count;
}

inline std::uint64_t samplesLost(dds_entity_t reader) {
  dds_sample_lost_status_t status{};
  dds_get_sample_lost_status(reader, &status);
  return status.total_count;
}

}  // namespace perdure::bus
