#include "services/semantic_filter/core/update/attribution.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kLittleWorth = 0.1;  // of a look, below which it repeats earlier ones

/// log Σ π_k A_k^exponent, A_k the mean of A over the hypotheses of class k.
double temperedLog(const Track& track, const std::vector<ClassNumber>& pmf,
                   const std::vector<double>& A, double exponent) {
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

/// P(miss | unmapped_occluder) is 1: A = s + (1 - s) A', of which A' is the miss as if nothing
/// unmapped_occluder it.
double excusedByScreen(const Track& track, const std::vector<ClassNumber>& pmf,
                       const std::vector<Shares>& shares, double exponent) {
  constexpr double kLeast = 1e-6;
  const double open = 1.0 - track.detectability.unmapped_occluder;
  if (track.detectability.unmapped_occluder <= 0.0 || open < kLeast) return 0.0;
  std::vector<double> A, unscreened;
  A.reserve(shares.size());
  unscreened.reserve(shares.size());
  for (const Shares& s : shares) {
    A.push_back(s.A);
    unscreened.push_back(std::max(1.0 + (s.A - 1.0) / open, kLeast));
  }
  const double nats =
      temperedLog(track, pmf, A, exponent) - temperedLog(track, pmf, unscreened, exponent);
  return std::isfinite(nats) ? std::max(nats, 0.0) : 0.0;
}

/// log A of a class against the same look by a network that tells no class from clutter: each box
/// without its g_k.
double saidByNetwork(const Track& track, const std::vector<Shares>& shares,
                     const std::string& class_name, const std::vector<std::size_t>& looked_at,
                     const std::vector<BoxDetection>& boxes, const FrameContext& frame) {
  std::vector<double> unsaid;  // 1 / g_k, of each box
  unsaid.reserve(looked_at.size());
  for (const std::size_t z : looked_at) {
    unsaid.push_back(std::exp(-logRatio(boxes[z], *frame.model, class_name, track.lookalike.nats)));
  }
  double with = 0.0, without = 0.0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (track.hypotheses[i].class_name != class_name) continue;
    const double A = track.hypotheses[i].weight * shares[i].A;
    double rest = shares[i].none;
    for (std::size_t z = 0; z < unsaid.size(); ++z) rest += shares[i].box[z] * unsaid[z];
    with += A;
    without += A * rest;
  }
  return with > 0.0 && without > 0.0 ? std::log(with / without) : 0.0;
}

}  // namespace

LookReasons reasonsOf(const Track& track, const std::vector<Shares>& shares, double detected,
                      double tempering, double exponent, const std::vector<std::size_t>& looked_at,
                      const std::vector<BoxDetection>& boxes, const FrameContext& frame) {
  LookReasons reasons;
  const auto pmf = classShares(track);
  if (!(detected >= 0.5) || looked_at.empty()) {  // a number gone bad is no hit
    reasons.kind = ExistenceEvidence::kMiss;
    reasons.excused = excusedByScreen(track, pmf, shares, exponent);
    return reasons;
  }
  if (tempering < kLittleWorth) reasons.kind = ExistenceEvidence::kRepeated;
  std::vector<ClassNumber> said;
  said.reserve(pmf.size());
  for (const ClassNumber& c : pmf) {
    said.push_back(
        {c.name, exponent * saidByNetwork(track, shares, c.name, looked_at, boxes, frame)});
  }
  reasons.activation = gains(pmf, said);
  return reasons;
}

void bookExistence(Track& track, double r, const LookReasons& reasons) {
  track.existence.become(r, reasons.kind, track.as_of);
  track.existence.shift(reasons.kind, ExistenceEvidence::kScreened, reasons.excused, track.as_of);
}

void bookClasses(Track& track, const LookReasons& reasons) {
  const bool miss = reasons.kind == ExistenceEvidence::kMiss;
  normalise(track, miss ? ClassEvidence::kMiss : ClassEvidence::kGeometry);
  track.classes.shift(ClassEvidence::kGeometry, ClassEvidence::kActivation, reasons.activation);
}

}  // namespace perdure::semantic_filter
