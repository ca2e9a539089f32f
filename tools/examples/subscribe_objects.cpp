// Prints the objects that Perdure estimates, frame by frame. Needs Cyclone DDS and idl/objects.idl.
// Usage: eval "$(perdure env)" && subscribe_objects
#include <dds/dds.h>

#include <cstdio>

#include "idl/objects.h"

int main() {
  const dds_entity_t participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  const dds_entity_t topic = dds_create_topic(participant, &perdure_msg_Objects_desc,
                                              "perdure/ego/objects", nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  const dds_entity_t reader = dds_create_reader(participant, topic, qos, nullptr);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);
  while (dds_waitset_wait(waitset, nullptr, 0, DDS_INFINITY) >= 0) {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(reader, &sample, &info, 1, 1) > 0) {
      const auto& frame = *static_cast<const perdure_msg_Objects*>(sample);
      for (uint32_t i = 0; info.valid_data && i < frame.items._length; ++i) {
        const perdure_msg_ObjectBelief& object = frame.items._buffer[i];
        const perdure_msg_ClassBelief& best = object.classes._buffer[0];
        std::printf("frame %lu: object %lu is a %s (%.0f %%) at %.1f %.1f %.1f m\n",
                    frame.stamp.seq, object.object_id, best.name,
                    100.0 * object.existence * best.probability, best.mean[0], best.mean[1],
                    best.mean[2]);
      }
      std::fflush(stdout);
      dds_return_loan(reader, &sample, 1);
      sample = nullptr;
    }
  }
}
