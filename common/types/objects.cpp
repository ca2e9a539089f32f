#include "common/types/objects.h"

#include "common/base/check.h"

namespace perdure {

const char* nameOf(EventKind kind) {
  static constexpr std::array kNames{
      "born",        "confirmed",      "class_resolved",   "occluded",      "left_view",
      "reappeared",  "merged",         "archived",         "recalled",      "missing",
      "gone",        "moved",          "predicted_return", "model_changed", "restored",
      "loop_closed", "loop_withdrawn", "relocalised"};
  static_assert(kNames.size() == static_cast<std::size_t>(EventKind::kRelocalised) + 1);
  return nameAt(kNames, kind);
}

const char* nameOf(Visibility value) {
  static constexpr std::array kNames{"visible", "partial", "occluded", "out_of_view", "behind"};
  static_assert(kNames.size() == static_cast<std::size_t>(Visibility::kBehind) + 1);
  return nameAt(kNames, value);
}

}  // namespace perdure
