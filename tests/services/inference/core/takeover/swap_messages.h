// Messages of an old and of a new inference process, for tests of swaps and of their judge.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/types/detections.h"

namespace perdure::inference {

inline constexpr InstanceId kOld = 1, kNew = 2;

inline ModelInfo modelOf(std::uint64_t hash, std::vector<std::string> classes) {
  ModelInfo model;
  model.hash = hash;
  model.name = hash == kOld ? "old" : "new";
  model.classes = std::move(classes);
  return model;
}

inline Detection boxAt(double x, float nats) {
  Detection d;
  d.box = {x, 10, x + 40, 60};
  d.activations = {0.0F, nats, -3.0F};
  return d;
}

inline Detections listOf(InstanceId who, std::uint64_t frame, std::vector<Detection> boxes) {
  Detections d;
  d.instance = d.model_hash = who;
  d.stamp.source = 7;
  d.stamp.sequence = frame;
  d.detections = std::move(boxes);
  return d;
}

inline const std::vector<Detection> kStreet = {boxAt(20, 4), boxAt(200, 3), boxAt(300, -2)};

}  // namespace perdure::inference
