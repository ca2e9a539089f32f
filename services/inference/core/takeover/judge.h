// Compares the detections of a new process with those of the process that it replaces, on the same
// frames. It detects implausible detections, but does not decide which network is better.
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

  /// Stores the classes of a model's activations. Call it before a comparison of detections of that
  /// model.
  void learn(const ModelInfo& model);
  /// Compares one frame. A certain box of the old process counts if the new network has its class.
  void compare(const Detections& elder, const Detections& newcomer);
  /// Returns "unknown_model", "empty" (no boxes although the old process has certain ones),
  /// "elsewhere" (boxes, but very few at the certain boxes of the old process) or "flood" (ten
  /// times the boxes).
  std::optional<Reason> complaint() const;
  void reset();

  std::size_t frames() const { return frames_; }
  /// Returns a text such as "450 frames; 97 % of 1200 certain objects detected", counted since the
  /// last reset().
  std::string summary() const;

 private:
  struct Row {
    std::size_t elder = 0, newcomer = 0;  ///< number of boxes
    /// Certain boxes of the old process, and how many of them the new process found.
    std::size_t sure = 0, found = 0;
    bool told = true;  ///< true if the model of the new process is known
  };
  std::map<std::uint64_t, std::vector<std::string>> classes_;  ///< class names by model hash
  std::deque<Row> rows_;
  std::size_t frames_ = 0, sure_ = 0, found_ = 0;
};

}  // namespace perdure::inference
