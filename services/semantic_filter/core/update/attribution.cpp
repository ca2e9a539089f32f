#include "services/semantic_filter/core/update/attribution.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kRepetition = 0.1;  // tempering exponent below which a hit is a repetition

/// Returns log Σ π_k A_k^exponent, where A_k is the mean of A over the hypotheses of class k.
double temperedLog(const Track& track, const ClassNumbers& pmf, const ScratchVector<double>& A,
                   double exponent) {
  double mean = 0.0;
  for (const ClassNumber& c : pmf) {
    double sum = 0.0;
    for (std::size_t i = 0; i < A.size(); ++i) {
      if (track.hypotheses[i].class_name == c.name) sum += track.hypotheses[i].weight * A[i];
    }
    if (c.value > 0.0) mean += c.value * std::pow(sum / c.value, exponent);
  }
  return std::log(mean);
}

/// Returns the nats of a miss that an unmapped occluder excuses. With probability s it hides the
/// object, so that a miss is certain: A = s + (1 - s) A', where A' is A without the occluder.
double excusedByOccluder(const Track& track, const ClassNumbers& pmf, const AllShares& shares,
                         double exponent) {
  constexpr double kLeast = 1e-6;
  const double unoccluded = 1.0 - track.detectability.unmapped_occluder;
  if (track.detectability.unmapped_occluder <= 0.0 || unoccluded < kLeast) return 0.0;
  ScratchVector<double> A, without_occluder;
  A.reserve(shares.size());
  without_occluder.reserve(shares.size());
  for (const Shares& s : shares) {
    A.push_back(s.A);
    without_occluder.push_back(std::max(1.0 + (s.A - 1.0) / unoccluded, kLeast));
  }
  const double nats =
      temperedLog(track, pmf, A, exponent) - temperedLog(track, pmf, without_occluder, exponent);
  return std::isfinite(nats) ? std::max(nats, 0.0) : 0.0;
}

/// Returns log(A / A without g_k) of a class. "Without g_k": the same boxes from a network that
/// cannot distinguish classes from clutter.
double activationNats(const Track& track, const AllShares& shares, const std::string& class_name,
                      const ScratchVector<std::size_t>& gated,
                      const std::vector<BoxDetection>& boxes, const FrameContext& frame) {
  ScratchVector<double> inverse_ratio;  // 1 / g_k of each box
  inverse_ratio.reserve(gated.size());
  for (const std::size_t z : gated) {
    inverse_ratio.push_back(
        std::exp(-logRatio(boxes[z], *frame.model, class_name, track.lookalike.nats)));
  }
  double with = 0.0, without = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (track.hypotheses[i].class_name != class_name) continue;
    const double A = track.hypotheses[i].weight * shares[i].A;
    double rest = shares[i].none;
    for (std::size_t z = 0; z < inverse_ratio.size(); ++z)
      rest += shares[i].box[z] * inverse_ratio[z];
    with += A;
    without += A * rest;
  }
  return with > 0.0 && without > 0.0 ? std::log(with / without) : 0.0;
}

}  // namespace

UpdateReasons reasonsOf(const Track& track, const AllShares& shares, double detected,
                        double tempering, double exponent, const ScratchVector<std::size_t>& gated,
                        const std::vector<BoxDetection>& boxes, const FrameContext& frame) {
  UpdateReasons reasons;
  const auto pmf = classShares(track);
  if (!(detected >= 0.5) || gated.empty()) {  // NaN is no hit
    reasons.kind = ExistenceEvidence::kMiss;
    reasons.excused = excusedByOccluder(track, pmf, shares, exponent);
    return reasons;
  }
  if (tempering < kRepetition) reasons.kind = ExistenceEvidence::kRepeated;
  ClassNumbers activation_nats;
  activation_nats.reserve(pmf.size());
  for (const ClassNumber& c : pmf) {
    activation_nats.push_back(
        {c.name, exponent * activationNats(track, shares, c.name, gated, boxes, frame)});
  }
  reasons.activation = gains(pmf, activation_nats);
  return reasons;
}

void bookExistence(Track& track, double r, const UpdateReasons& reasons) {
  track.existence.become(r, reasons.kind, track.as_of);
  track.existence.shift(reasons.kind, ExistenceEvidence::kUnmappedOccluder, reasons.excused,
                        track.as_of);
}

void bookClasses(Track& track, const UpdateReasons& reasons) {
  const bool miss = reasons.kind == ExistenceEvidence::kMiss;
  normalise(track, miss ? ClassEvidence::kMiss : ClassEvidence::kGeometry);
  track.classes.shift(ClassEvidence::kGeometry, ClassEvidence::kActivation, reasons.activation);
}

}  // namespace perdure::semantic_filter
