// Example of an inference service that replaces perdure-inference. It reports bright pixels as a
// lamp. Needs Cyclone DDS and idl/{sensors,detections}.idl.
// Usage: eval "$(perdure env)" && inference_stub
#include <dds/dds.h>

#include <algorithm>

#include "idl/detections.h"
#include "idl/sensors.h"

constexpr uint64_t kHash = 0x1a3b, kInstance = 0x57ab;  // digests of the model and of this process

void look(const perdure_msg_Frame& frame, dds_entity_t writer) {
  const uint32_t pixels = frame.width * frame.height, bytes = frame.pixels._length;
  if (pixels == 0 || bytes < pixels) return;
  double x1 = frame.width, y1 = frame.height, x2 = 0, y2 = 0;
  for (uint32_t i = 0; i < pixels; ++i) {
    if (frame.pixels._buffer[i * (bytes / pixels)] < 200) continue;
    const double x = i % frame.width, y = i / frame.width;
    x1 = std::min(x1, x), y1 = std::min(y1, y), x2 = std::max(x2, x + 1), y2 = std::max(y2, y + 1);
  }
  float activations[] = {0.0F, 3.0F};  // log-likelihoods: [0] clutter, [1] lamp
  perdure_msg_Detection lamp{.corners = {x1, y1, x2, y2}, .activations = {2, 2, activations}};
  perdure_msg_Detections answer{.stamp = frame.stamp,  // stamp of the frame
                                .camera = frame.camera,
                                .source = kInstance,
                                .model_hash = kHash,
                                .items = {1, x2 > x1 ? 1U : 0U, &lamp}};  // none if not found
  dds_write(writer, &answer);
}

int main() {
  const auto bus = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  const auto topic = [bus](const dds_topic_descriptor_t& type, const char* name) {
    return dds_create_topic(bus, &type, name, nullptr, nullptr);
  };
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  const auto frames =
      dds_create_reader(bus, topic(perdure_msg_Frame_desc, "perdure/ego/frame/cam0"), qos, nullptr);
  // Readers receive the strongest live writer only. A writer that stops is dead after its lease.
  dds_qset_ownership(qos, DDS_OWNERSHIP_EXCLUSIVE);
  dds_qset_ownership_strength(qos, 30);
  dds_qset_liveliness(qos, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_MSECS(300));
  const auto detections = dds_create_writer(
      bus, topic(perdure_msg_Detections_desc, "perdure/ego/detections"), qos, nullptr);
  // The model names the classes of activations[1], [2], …. It is latched, so late joiners receive
  // it.
  dds_qset_durability(qos = dds_create_qos(), DDS_DURABILITY_TRANSIENT_LOCAL);
  char name[] = "stub", lamp[] = "lamp", *classes[] = {lamp};
  perdure_msg_ModelInfo model{
      .model_hash = kHash, .source = kInstance, .name = name, .classes = {1, 1, classes}};
  const auto models = topic(perdure_msg_ModelInfo_desc, "perdure/ego/model");
  dds_write(dds_create_writer(bus, models, qos, nullptr), &model);
  for (dds_sample_info_t info;; dds_sleepfor(DDS_MSECS(5))) {
    dds_assert_liveliness(detections);  // keeps the ownership while no frames arrive
    for (void* sample = nullptr; dds_take(frames, &sample, &info, 1, 1) > 0; sample = nullptr) {
      if (info.valid_data) look(*static_cast<const perdure_msg_Frame*>(sample), detections);
      dds_return_loan(frames, &sample, 1);
    }
  }
}
