// The models whose detections may arrive, and the model in use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"
#include "services/semantic_filter/core/measurement/detection.h"

namespace perdure::semantic_filter {

class ModelBook {
 public:
  explicit ModelBook(ClassPriors priors = {}) : priors_(std::move(priors)) {}
  const ClassPriors& priors() const { return priors_; }

  /// Adds a model. Fails with "model_contradicts_its_hash" if a model of this hash has other
  /// classes; the first one remains valid. A model that only adds classes to the newest one of its
  /// name is of the same network.
  Result<void> add(const ModelInfo& info);
  /// Returns nullptr if no model of this hash was added, or if too many were added since.
  std::shared_ptr<const Model> find(std::uint64_t hash) const;
  /// Notes that a frame at `time` uses detections of this model, which must be known. If the frame
  /// is the newest and the model has changed, returns a sentence that describes the changes.
  std::optional<std::string> use(std::uint64_t hash, TimePoint time);
  /// Returns the hash of the model of the newest frame; 0 before the first.
  std::uint64_t used() const { return used_; }

 private:
  struct Entry {
    ModelInfo info;
    std::shared_ptr<const Model> model;
  };
  ClassPriors priors_;
  std::map<std::uint64_t, Entry> entries_;
  std::deque<std::uint64_t> order_;  ///< in order of arrival
  std::uint64_t used_ = 0;
  TimePoint used_at_;
};

/// Delayed detections of a new inference process that misses all expected objects
/// (services/inference/README.md).
class Probation {
 public:
  /// Largest number of delayed frames. The old process decides within fewer frames, and the history
  /// can repeat more.
  static constexpr std::size_t kLongest = 24;

  void begin(InstanceId newcomer) { newcomer_ = newcomer; }
  void end() { newcomer_ = 0; }
  bool isOf(InstanceId instance) const { return newcomer_ != 0 && instance == newcomer_; }

  void keep(const Detections& detections) { kept_.push_back(detections); }
  bool full() const { return kept_.size() >= kLongest; }
  std::vector<Detections> take() { return std::exchange(kept_, {}); }

 private:
  InstanceId newcomer_ = 0;
  std::vector<Detections> kept_;
};

}  // namespace perdure::semantic_filter
