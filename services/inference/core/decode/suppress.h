// Overlapping candidates become one detection that keeps the evidence of all of them.
#pragma once

#include <cstddef>
#include <vector>

#include "services/inference/core/decode/decode.h"

namespace perdure::inference {

/// Total evidence of a candidate: log Σ_k exp(activation_k), the log-odds of "anything is here".
double totalEvidence(const Candidate& candidate);

/// What a box loses in nats that covers all of a better one of the same class.
inline constexpr double kDoubleNats = 4.0;

/// Class-agnostic suppression: by falling total evidence, a candidate that overlaps a kept one by
/// IoU > `iou` is merged into it: each class keeps the larger activation (both saw the same pixels:
/// their evidence must not be added), and the box becomes the mean of all that were merged, by
/// score and by overlap with the kept one (several cells' answers err less than one's). What then
/// lies over a better box of the same class is likely to be a second answer to the same object: of
/// 15,000 boxes of the project's own network those that covered a share c of a better one were
/// right as often as boxes of 4 c² nats less, and these they lose. At most `limit` are kept, the
/// ones of most evidence. Deterministic: ties keep the order of the input.
std::vector<Candidate> suppress(std::vector<Candidate> candidates, double iou, std::size_t limit);

}  // namespace perdure::inference
