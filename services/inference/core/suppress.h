// Overlapping candidates become one detection that keeps the evidence of all of them.
#pragma once

#include <cstddef>
#include <vector>

#include "services/inference/core/decode.h"

namespace perdure::inference {

/// Total evidence of a candidate: log Σ_k exp(activation_k), the log-odds of "anything is here".
double totalEvidence(const Candidate& candidate);

/// Class-agnostic suppression: by falling total evidence, a candidate that overlaps a kept one by
/// IoU > `iou` is merged into it: the kept box stays, and each class keeps the larger activation
/// (both saw the same pixels: their evidence must not be added). At most `limit` are kept, the
/// ones of most evidence. Deterministic: ties keep the order of the input.
std::vector<Candidate> suppress(std::vector<Candidate> candidates, double iou, std::size_t limit);

}  // namespace perdure::inference
