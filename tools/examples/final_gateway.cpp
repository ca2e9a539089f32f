// Copies topics to and from DDS implementations without XCDR2 (Fast DDS before 3, RTI Connext
// before 6). Publishes `objects` and `events` as perdure/ego/final/…, and reads `model` and
// `detections` under the same prefix. The types there are those of idl/ with every struct final, in
// the module perdure::fin.
// Usage (an ownership strength of 30 overrides perdure-inference):
//   eval "$(perdure env)" && final_gateway [strength]
#include <dds/dds.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "final/detections.h"
#include "final/objects.h"
#include "idl/detections.h"
#include "idl/objects.h"

namespace {

// Both types have the same members in the same order, so the same sample can be used for both.
static_assert(sizeof(perdure_msg_Objects) == sizeof(perdure_fin_Objects));
static_assert(sizeof(perdure_msg_ObjectBelief) == sizeof(perdure_fin_ObjectBelief));
static_assert(sizeof(perdure_msg_Event) == sizeof(perdure_fin_Event));
static_assert(sizeof(perdure_msg_ModelInfo) == sizeof(perdure_fin_ModelInfo));
static_assert(sizeof(perdure_msg_Detections) == sizeof(perdure_fin_Detections));
static_assert(sizeof(perdure_msg_Detection) == sizeof(perdure_fin_Detection));

struct End {
  const dds_topic_descriptor_t* type;
  std::string topic;
};

struct Link {
  dds_entity_t reader, writer;
};

/// Returns the QoS of Perdure's reliable topics. `latched`: late joiners receive the last sample.
dds_qos_t* reliable(int depth, bool latched) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  if (latched) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_writer_data_lifecycle(qos, false);
  return qos;
}

Link link(dds_entity_t participant, const End& from, const End& to, int depth, bool latched,
          int strength = 0) {
  dds_qos_t* qos = reliable(depth, latched);
  const auto topic = [&](const End& end) {
    return dds_create_topic(participant, end.type, end.topic.c_str(), nullptr, nullptr);
  };
  const dds_entity_t reader = dds_create_reader(participant, topic(from), qos, nullptr);
  if (strength > 0) {  // detections: the strongest live writer owns the topic
    dds_qset_ownership(qos, DDS_OWNERSHIP_EXCLUSIVE);
    dds_qset_ownership_strength(qos, strength);
    dds_qset_liveliness(qos, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_MSECS(300));
  }
  const dds_entity_t writer = dds_create_writer(participant, topic(to), qos, nullptr);
  dds_delete_qos(qos);
  return {reader, writer};
}

void carry(const Link& link) {
  void* sample = nullptr;
  dds_sample_info_t info;
  while (dds_take(link.reader, &sample, &info, 1, 1) > 0) {
    if (info.valid_data) dds_write(link.writer, sample);
    dds_return_loan(link.reader, &sample, 1);
    sample = nullptr;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string ours = "perdure/ego/", theirs = ours + "final/";
  const int strength = argc > 1 ? std::atoi(argv[1]) : 30;
  const dds_entity_t participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  const std::vector<Link> links = {
      link(participant, {&perdure_msg_Objects_desc, ours + "objects"},
           {&perdure_fin_Objects_desc, theirs + "objects"}, 8, false),
      link(participant, {&perdure_msg_Event_desc, ours + "events"},
           {&perdure_fin_Event_desc, theirs + "events"}, 256, true),
      link(participant, {&perdure_fin_ModelInfo_desc, theirs + "model"},
           {&perdure_msg_ModelInfo_desc, ours + "model"}, 1, true),
      link(participant, {&perdure_fin_Detections_desc, theirs + "detections"},
           {&perdure_msg_Detections_desc, ours + "detections"}, 8, false, strength),
  };
  const dds_entity_t waitset = dds_create_waitset(participant);
  for (const Link& l : links) {
    dds_waitset_attach(waitset, dds_create_readcondition(l.reader, DDS_ANY_STATE), 0);
  }
  while (dds_waitset_wait(waitset, nullptr, 0, DDS_INFINITY) >= 0) {
    for (const Link& l : links) carry(l);  // each write asserts the writer's liveliness
  }
}
