// Which mode of yaw an track is in, and whether it moves: fits from several starts, weighed by the
// log_evidence of all batch.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/semantic_filter/core/smoothing/map_fit.h"

namespace perdure::semantic_filter {

/// A fit of one of an track's hypotheses, by its index.
struct Fitted {
  std::size_t index;
  MapFit map_fit;
  double ground;  ///< nats, of standing on it
};
using Fits = std::vector<Fitted>;

/// Nothing where too many batch contradict.
std::optional<MapFit> fit(const Hypothesis& start, const KeyframeBatch& batch,
                          const FrameContext& frame, const MapFit* like = nullptr,
                          const std::vector<const Hypothesis*>& found = {});
/// A fit that none of the track's hypotheses had, with its own `h`.
Fitted adopt(Track& track, Hypothesis h, MapFit&& map_fit, const FrameContext& frame);
/// The thing at rest where the batch say, when the filter has come to believe that it moves.
Hypothesis atRest(const Hypothesis& moving, const Keyframes& keyframes);
/// Of one class: whether it moves, by what all batch and the ground say.
void weighMotion(std::vector<Hypothesis>& hs, const std::string& name, const Fitted& at_rest,
                 const Fitted& driving, const FrameContext& frame);
/// What all batch and the ground say of each mode. One that was reached twice counts once; those
/// that say less than `least` of the best go.
void weighModes(std::vector<Hypothesis>& hs, const Fits& fits, double least);
/// The fit whose hypothesis weighs most.
std::optional<Fitted> heaviest(const std::vector<Hypothesis>& hs, Fits&& fits);
/// Fits from other starts of yaw and size; those that are new are added.
void searchModes(Track& track, const KeyframeBatch& batch, const FrameContext& frame, Fits& fits);
/// What stands where the ground is not may go along it elsewhere: one that moves, which the filter
/// has given up, is tried again.
std::optional<Fitted> tryMoving(Track& track, const Fitted& at_rest, const KeyframeBatch& batch,
                                const FrameContext& frame);
/// A thing of no known class that the network takes for one: boxes that were of two things make the
/// shape of none, and what is of no known class takes any. Whether all batch together are of the
/// class after all. To look like one at all is paid for once, as at birth.
void tryLookalikeClass(Track& track, const KeyframeBatch& batch, const FrameContext& frame);

}  // namespace perdure::semantic_filter
