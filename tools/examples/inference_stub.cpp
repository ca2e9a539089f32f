// A stranger's inference service: it reports the box around what is bright as a lamp. Needs Cyclone
// DDS and idl/{sensors,detections}.idl. Run it so:
//   eval "$(perdure env)" && inference_stub [strength]     (30: heard in place of
//   perdure-inference)
#include <dds/dds.h>

#include <algorithm>
#include <cstdlib>

#include "idl/detections.h"
#include "idl/sensors.h"

namespace {

constexpr uint64_t kHash = 0x1a3b, kInstance = 0x57ab;  // of the model; of this process

dds_entity_t makeTopic(dds_entity_t participant, const dds_topic_descriptor_t* type,
                       const char* name) {
  return dds_create_topic(participant, type, name, nullptr, nullptr);
}

dds_qos_t* reliable(int depth) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, depth);
  return qos;
}

/// The model says what activations[1], [2], … mean; it waits for whoever comes later.
void publishModel(dds_entity_t participant) {
  dds_qos_t* qos = reliable(1);
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_writer_data_lifecycle(qos, false);
  char name[] = "stub", lamp[] = "lamp", *classes[] = {lamp};
  perdure_msg_ModelInfo model{};
  model.model_hash = kHash;
  model.source = kInstance;
  model.name = name;
  model.classes = {1, 1, classes, false};
  const auto topic = makeTopic(participant, &perdure_msg_ModelInfo_desc, "perdure/ego/model");
  dds_write(dds_create_writer(participant, topic, qos, nullptr), &model);
}

/// Ownership: the strongest that lives is heard. Liveliness: the lease says when it does not.
dds_entity_t detectionWriter(dds_entity_t participant, int strength) {
  dds_qos_t* qos = reliable(8);
  dds_qset_ownership(qos, DDS_OWNERSHIP_EXCLUSIVE);
  dds_qset_ownership_strength(qos, strength);
  dds_qset_liveliness(qos, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_MSECS(300));
  return dds_create_writer(
      participant, makeTopic(participant, &perdure_msg_Detections_desc, "perdure/ego/detections"),
      qos, nullptr);
}

/// An empty list is a statement, too: nothing is there.
void look(const perdure_msg_Frame& frame, dds_entity_t writer) {
  constexpr uint8_t kBright = 200;
  const uint32_t channels = frame.pixels._length / (frame.width * frame.height);
  uint32_t x1 = frame.width, y1 = frame.height, x2 = 0, y2 = 0;
  for (uint32_t i = 0; i < frame.width * frame.height; ++i) {
    if (frame.pixels._buffer[i * channels] < kBright) continue;
    const uint32_t x = i % frame.width, y = i / frame.width;
    x1 = std::min(x1, x), y1 = std::min(y1, y), x2 = std::max(x2, x + 1), y2 = std::max(y2, y + 1);
  }
  float activations[] = {0.0F, 3.0F};  // log-likelihoods: [0] clutter, [1] a lamp
  perdure_msg_Detection lamp{{double(x1), double(y1), double(x2), double(y2)},
                             {2, 2, activations, false},
                             false,
                             0,
                             0,
                             false,
                             {0, 0, 0, 0}};
  perdure_msg_Detections answer{};
  answer.stamp = frame.stamp;  // whose frame it is about: without it nobody can use it
  answer.camera = frame.camera;
  answer.source = kInstance;
  answer.model_hash = kHash;
  answer.items = {1, x2 > x1 ? 1U : 0U, &lamp, false};
  dds_write(writer, &answer);
}

}  // namespace

int main(int argc, char** argv) {
  const dds_entity_t participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  publishModel(participant);
  const auto writer = detectionWriter(participant, argc > 1 ? std::atoi(argv[1]) : 30);
  const auto topic = makeTopic(participant, &perdure_msg_Frame_desc, "perdure/ego/frame/cam0");
  const auto reader = dds_create_reader(participant, topic, reliable(1), nullptr);
  const dds_entity_t waitset = dds_create_waitset(participant);
  dds_waitset_attach(waitset, dds_create_readcondition(reader, DDS_ANY_STATE), 0);
  while (true) {
    dds_waitset_wait(waitset, nullptr, 0, DDS_MSECS(50));
    dds_assert_liveliness(writer);  // also where no frame comes
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(reader, &sample, &info, 1, 1) > 0) {
      const auto& frame = *static_cast<const perdure_msg_Frame*>(sample);
      if (info.valid_data && frame.pixels._length > 0) look(frame, writer);
      dds_return_loan(reader, &sample, 1);
      sample = nullptr;
    }
  }
}
