#include "services/inference/core/takeover/judge.h"

#include <algorithm>

namespace perdure::inference {
namespace {

constexpr std::size_t kMaxModels = 256;
constexpr float kSure = 2.0F;        // nats against clutter; a class with more is certain
constexpr double kSameObject = 0.3;  // least IoU of boxes of the same object
constexpr std::size_t kFlood = 10;

/// Returns the index of the most probable class if the box is certain.
std::optional<std::size_t> sureClass(const Detection& d) {
  if (d.activations.size() < 2) return std::nullopt;
  const auto best = std::max_element(d.activations.begin() + 1, d.activations.end());
  if (*best - d.activations[0] < kSure) return std::nullopt;
  return static_cast<std::size_t>(best - d.activations.begin()) - 1;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool hasBoxAt(const Detections& list, const Box& box) {
  return std::any_of(list.detections.begin(), list.detections.end(), [&](const Detection& d) {
    return !d.primed && intersectionOverUnion(d.box, box) >= kSameObject;
  });
}

/// Returns the number of boxes. Top-down answers are not counted, because they say little about the
/// network.
std::size_t boxesOf(const Detections& list) {
  return static_cast<std::size_t>(std::count_if(list.detections.begin(), list.detections.end(),
                                                [](const Detection& d) { return !d.primed; }));
}

}  // namespace

void Judge::learn(const ModelInfo& model) {
  if (classes_.size() < kMaxModels) classes_.try_emplace(model.hash, model.classes);
}

void Judge::reset() {
  rows_.clear();
  frames_ = sure_ = found_ = 0;
}

void Judge::compare(const Detections& elder, const Detections& newcomer) {
  Row row{boxesOf(elder), boxesOf(newcomer)};
  const auto its = classes_.find(newcomer.model_hash), ours = classes_.find(elder.model_hash);
  row.told = its != classes_.end();
  for (const Detection& d : elder.detections) {
    if (!row.told || ours == classes_.end()) break;
    const auto k = sureClass(d);
    if (d.primed || !k || *k >= ours->second.size() || !contains(its->second, ours->second[*k]))
      continue;
    ++row.sure;
    row.found += hasBoxAt(newcomer, d.box);
  }
  ++frames_, sure_ += row.sure, found_ += row.found;
  rows_.push_back(row);
  if (rows_.size() > kWindow) rows_.pop_front();
}

std::optional<Reason> Judge::complaint() const {
  Row sum;
  std::size_t untold = 0, with_sure = 0, with_any = 0, empty = 0;
  for (const Row& row : rows_) {
    untold += !row.told;
    if (row.elder > 0) ++with_any, sum.elder += row.elder, sum.newcomer += row.newcomer;
    if (row.sure == 0) continue;
    ++with_sure, sum.sure += row.sure, sum.found += row.found;
    empty += row.newcomer == 0;
  }
  const auto text = [](std::size_t n) { return std::to_string(n); };
  if (untold >= kEnough) {
    return Reason{"unknown_model", "it has not published the model of its detections"};
  }
  if (with_sure >= kEnough && 10 * empty >= 9 * with_sure) {
    return Reason{"empty", "no boxes in " + text(empty) + " of " + text(with_sure) +
                               " frames, in which the old network detects " + text(sum.sure) +
                               " certain objects"};
  }
  if (with_sure >= kEnough && 10 * sum.found < sum.sure) {
    return Reason{"elsewhere", "it detects " + text(sum.found) + " of " + text(sum.sure) +
                                   " certain objects of the old network"};
  }
  if (with_any >= kEnough && sum.newcomer >= kFlood * sum.elder) {
    return Reason{"flood", text(sum.newcomer) + " boxes in " + text(with_any) +
                               " frames in which the old network has " + text(sum.elder)};
  }
  return std::nullopt;
}

std::string Judge::summary() const {
  std::string text = std::to_string(frames_) + " frames";
  if (sure_ == 0) return text + "; no certain objects to compare";
  return text + "; " + std::to_string(100 * found_ / sure_) + " % of " + std::to_string(sure_) +
         " certain objects detected";
}

}  // namespace perdure::inference
