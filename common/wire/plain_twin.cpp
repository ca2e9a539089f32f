#include "common/wire/plain_twin.h"

#include "common/wire/topics.h"

namespace perdure::wire {

const dds_topic_descriptor_t* plainTwinOf(const std::string& type_name) {
  const dds_topic_descriptor_t* found = nullptr;
  forEachTopic([&](const auto& row) {
    if (row.descriptor().m_typename == type_name) found = row.twin();
  });
  return found;
}

}  // namespace perdure::wire
