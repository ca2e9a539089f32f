// Whether a newcomer's detections make sense beside those of the process that it follows: both have
// looked at the same frames. It asks for nonsense, not for which one is better.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/detections.h"

namespace perdure::inference {

class Judge {
 public:
  static constexpr std::size_t kWindow = 15;  ///< frames, the last ones that both looked at
  static constexpr std::size_t kEnough = 8;   ///< of them, before there is a complaint

  /// What a model's activations mean; told before its detections are compared.
  void learn(const ModelInfo& model);
  /// One frame. Boxes that the elder is sure of count where the newcomer knows their class.
  void compare(const Detections& elder, const Detections& newcomer);
  /// "unknown_model", "empty" (nothing where the elder is sure of something), "elsewhere" (boxes,
  /// but hardly one where the elder is sure), "flood" (ten times the boxes).
  std::optional<Reason> complaint() const;
  /// Forgets what was compared.
  void reset();

  std::size_t frames() const { return frames_; }
  /// "450 frames; 97 % of 1200 sure things found", since the reset.
  std::string summary() const;

 private:
  struct Row {
    std::size_t elder = 0, newcomer = 0;  ///< boxes
    std::size_t sure = 0, found = 0;      ///< of the elder
    bool told = true;                     ///< the newcomer's model is known
  };
  std::map<std::uint64_t, std::vector<std::string>> classes_;  ///< by hash
  std::deque<Row> rows_;
  std::size_t frames_ = 0, sure_ = 0, found_ = 0;
};

}  // namespace perdure::inference
