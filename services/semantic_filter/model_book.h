// The models whose detections may come, and the one in use: what changes when inference is swapped.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/base/result.h"
#include "services/semantic_filter/core/measurement/detection.h"

namespace perdure::semantic_filter {

class ModelBook {
 public:
  explicit ModelBook(ClassPriors priors = {}) : priors_(std::move(priors)) {}

  /// Reason: "model_contradicts_its_hash": what was said first of a hash stands.
  Result<void> add(const ModelInfo& info);
  /// nullptr where no model of this hash was told, or too many since then.
  const Model* find(std::uint64_t hash) const;
  /// Detections of this (known) model are used in a frame of this time. Where the frame is newer
  /// than all before and their model was another one: a sentence on what changes.
  std::optional<std::string> use(std::uint64_t hash, TimePoint time);
  /// The one of the newest frame; 0 before there is one.
  std::uint64_t used() const { return used_; }

 private:
  struct Entry {
    std::string name;
    Model model;
  };
  ClassPriors priors_;
  std::map<std::uint64_t, Entry> entries_;
  std::deque<std::uint64_t> order_;  ///< of arrival
  std::uint64_t used_ = 0;
  TimePoint used_at_;
};

}  // namespace perdure::semantic_filter
