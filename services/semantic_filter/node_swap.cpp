// Effects of a swap of inference on the filter.
#include <algorithm>

#include "services/semantic_filter/node.h"

namespace perdure::semantic_filter {
namespace {

/// Whether at least one object is likely to be detected, but no detection overlaps such an object.
bool missesAll(const std::vector<Prediction>& expected, const Detections& detections) {
  constexpr double kLikely = 0.5, kAtAll = 0.1;  // r·π·v; intersection over union
  bool any = false;
  for (const Prediction& prediction : expected) {
    if (prediction.probability < kLikely) continue;
    any = true;
    const auto lies_there = [&](const Detection& d) {
      return !d.primed && intersectionOverUnion(d.box, prediction.box) >= kAtAll;
    };
    const auto& list = detections.detections;
    if (std::any_of(list.begin(), list.end(), lies_there)) return false;
  }
  return any;
}

}  // namespace

/// Begins and ends probations. During a probation, doubtful detections of the new process are
/// delayed.
void Node::onSwap(const SwapNotice& notice) {
  if (notice.step == SwapStep::kTookOver && notice.about != 0) {
    settleProbation(true);
    probation_.begin(notice.instance);
  }
  if (notice.step == SwapStep::kPassed && probation_.isOf(notice.instance)) {
    probation_.end();
    settleProbation(true);
  }
  if (notice.step != SwapStep::kRolledBack) return;
  if (probation_.isOf(notice.about != 0 ? notice.about : notice.instance)) {
    probation_.end();
    settleProbation(false);
  }
  if (history_.empty()) return;
  reportModelChange(history_.newest().input.stamp,
                    notice.model + " was rolled back, " + notice.reason + ": " + notice.detail);
}

void Node::reportModelChange(const FrameStamp& stamp, const std::string& detail) {
  Event event;
  event.stamp = stamp;
  event.instance = instance_;
  event.world = *world_;
  event.kind = EventKind::kModelChanged;
  event.detail = detail;
  if (outputs_.events) outputs_.events(event);
}

/// Whether detections of a new process are delayed, because they miss all expected objects.
bool Node::isInDoubt(const Frame& frame, const Detections& detections) {
  if (!probation_.isOf(detections.instance)) return false;
  const auto model = models_.find(detections.model_hash);
  std::vector<Prediction> expected;
  for (const Track& object : (frame.stepped ? frame.before : history_.belief()).tracks) {
    if (!object.life.confirmed || !model->names->contains(object.best().class_name)) continue;
    if (auto prediction = predictionOf(object, frame.input, {})) expected.push_back(*prediction);
  }
  const bool blind = missesAll(expected, detections);
  if (blind && !probation_.full()) {
    probation_.keep(detections);
    reasons_.add("detections_in_doubt");
    return true;
  }
  if (blind) probation_.end();
  settleProbation(true);
  return false;
}

/// Applies the delayed detections late if `believed`; otherwise drops them.
void Node::settleProbation(bool believed) {
  const auto kept = probation_.take();
  if (!believed && !kept.empty()) reasons_.add("detections_rolled_back", kept.size());
  if (!believed) return;
  auto& frames = history_.frames();
  std::size_t first = frames.size();
  for (const Detections& detections : kept) {
    if (refusalOf(detections) != nullptr) continue;  // its model was removed meanwhile
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!frames[i].input.stamp.sameFrame(detections.stamp)) continue;
      if (use(frames[i], detections) && frames[i].stepped) first = std::min(first, i);
    }
  }
  if (first < frames.size()) history_.stepAgainFrom(first);
}

}  // namespace perdure::semantic_filter
