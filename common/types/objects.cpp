#include "common/types/objects.h"

#include "common/base/check.h"

namespace perdure {

const char* nameOf(EventKind kind) {
  switch (kind) {
    case EventKind::kBorn: return "born";
    case EventKind::kConfirmed: return "confirmed";
    case EventKind::kClassResolved: return "class_resolved";
    case EventKind::kOccluded: return "occluded";
    case EventKind::kLeftView: return "left_view";
    case EventKind::kReappeared: return "reappeared";
    case EventKind::kMerged: return "merged";
    case EventKind::kArchived: return "archived";
    case EventKind::kRecalled: return "recalled";
    case EventKind::kMissing: return "missing";
    case EventKind::kGone: return "gone";
    case EventKind::kMoved: return "moved";
    case EventKind::kPredictedReturn: return "predicted_return";
    case EventKind::kModelChanged: return "model_changed";
    case EventKind::kRestored: return "restored";
    case EventKind::kLoopClosed: return "loop_closed";
    case EventKind::kLoopWithdrawn: return "loop_withdrawn";
    case EventKind::kRelocalised: return "relocalised";
  }
  failCheck("an event kind is one of those declared", std::source_location::current());
}

const char* nameOf(Visibility value) {
  switch (value) {
    case Visibility::kVisible: return "visible";
    case Visibility::kPartial: return "partial";
    case Visibility::kOccluded: return "occluded";
    case Visibility::kOutOfView: return "out_of_view";
    case Visibility::kBehind: return "behind";
  }
  failCheck("a visibility is one of those declared", std::source_location::current());
}

}  // namespace perdure
