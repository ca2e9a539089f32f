// Compares a newcomer's detections with those of the process that it follows, on the same frames.
// It detects implausible detections, but does not judge which process is better.
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
  static constexpr std::size_t kWindow = 15;  ///< number of last frames that both processed
  static constexpr std::size_t kEnough = 8;   ///< frames needed before a complaint

  /// Stores the meaning of a model's activations; call it before comparing its detections.
  void learn(const ModelInfo& model);
  /// Compares one frame. Certain boxes of the elder count if the newcomer has their class.
  void compare(const Detections& elder, const Detections& newcomer);
  /// Returns "unknown_model", "empty" (no boxes although the elder has certain ones), "elsewhere"
  /// (boxes, but very few at the elder's certain ones) or "flood" (ten times the boxes).
  std::optional<Reason> complaint() const;
  /// Clears the comparison.
  void reset();

  std::size_t frames() const { return frames_; }
  /// Text such as "450 frames; 97 % of 1200 sure things found", counted since the reset.
  std::string summary() const;

 private:
  struct Row {
    std::size_t elder = 0, newcomer = 0;  ///< number of boxes
    std::size_t sure = 0, found = 0;      ///< certain boxes of the elder, and how many of them the
                                          ///< newcomer found
    bool told = true;                     ///< the newcomer's model is known
  };
  std::map<std::uint64_t, std::vector<std::string>> classes_;  ///< class names by model hash
  std::deque<Row> rows_;
  std::size_t frames_ = 0, sure_ = 0, found_ = 0;
};

}  // namespace perdure::inference
