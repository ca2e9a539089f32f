// MAP fits of a track from other starts of yaw and size, at rest and in motion, weighed by marginal
// likelihoods. Derivation: tools/docs/maths/mode_search.md.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/semantic_filter/core/smoothing/map_fit.h"

namespace perdure::semantic_filter {

struct Fitted {
  std::size_t index;
  MapFit map_fit;
  double beside;  ///< besideKeyframes, nats
};
using Fits = ScratchVector<Fitted>;

/// As MapFit::make; also returns nothing if too many keyframes contradict the fit.
std::optional<MapFit> fit(const Hypothesis& start, const KeyframeBatch& batch,
                          const FrameContext& frame, const MapFit* like = nullptr,
                          const ScratchVector<const Hypothesis*>& found = {});
/// Updates `h` by the ground contact. Returns the log evidence of a fit beside its keyframes, nats:
/// the ground contact and, if `h` is an upper part, the share of boxes with a hidden lower side.
double besideKeyframes(Hypothesis& h, ObjectId id, const FrameContext& frame);
/// Adds `h` with its ground contact to the track and returns it with its fit.
Fitted adopt(Track& track, Hypothesis h, MapFit&& map_fit, const FrameContext& frame);
/// Returns a start at rest for a moving hypothesis: its position at the middle keyframe.
Hypothesis atRest(const Hypothesis& moving, const Keyframes& keyframes);
/// Divides the weight of one class between rest and motion, by all keyframes and the ground.
void weighMotion(std::vector<Hypothesis>& hs, const std::string& name, const Fitted& at_rest,
                 const Fitted& in_motion, const FrameContext& frame);
/// Divides the weight of the fitted hypotheses among them, by all keyframes and the ground. A mode
/// that was reached twice counts once. A mode below `least` times the best gets the weight 0.
void weighModes(std::vector<Hypothesis>& hs, const Fits& fits, double least);
std::optional<Fitted> heaviest(const std::vector<Hypothesis>& hs, Fits&& fits);
/// Fits from other starts of yaw and size, and adds the new modes to the track and to `fits`.
void searchModes(Track& track, const KeyframeBatch& batch, const FrameContext& frame, Fits& fits);
/// If the ground contradicts rest, fits a moving hypothesis again, which the filter has removed.
std::optional<Fitted> tryMoving(Track& track, const Fitted& at_rest, const KeyframeBatch& batch,
                                const FrameContext& frame);
/// Fits an *other* track as the class that it resembles, and adds the likely fits. The track may
/// have its *other* shape from boxes of two objects. The prior odds are those at initiation.
void tryLookalikeClass(Track& track, const KeyframeBatch& batch, const FrameContext& frame);

}  // namespace perdure::semantic_filter
