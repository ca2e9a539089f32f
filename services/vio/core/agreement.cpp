#include "services/vio/core/agreement.h"

#include <algorithm>

namespace perdure::vio {

constexpr double kForgets = 1.0 / 40;  // weight of each new image
constexpr std::size_t kFewest = 40;    // images before the first verdict
constexpr double kTracks = 2.0;        // mean number of tracks in an image that a verdict needs
constexpr double kMisfit = 15.0;       // limit of the scale; inaccurate poses reach up to 8
constexpr double kFewTracks = 0.5;     // limit if nearly all tracks contradict
constexpr double kNearlyAll = 10.0;    // ratio of contradicting to agreeing tracks

void Agreement::add(const Mapped& mapped, double scale, bool moved) {
  if (!moved) return;
  ++images_;
  scale_ = scale;
  contradicted_ += kForgets * (static_cast<double>(mapped.contradicted) - contradicted_);
  far_ += kForgets * (static_cast<double>(mapped.far) - far_);
  sure_ += kForgets * (static_cast<double>(mapped.sure) - sure_);
}

Agreement::Verdict Agreement::verdict() const {
  if (images_ < kFewest) return Verdict::kGood;
  const bool misfit = sure_ > kTracks && scale_ > kMisfit;
  if (misfit || contradicted_ > std::max(sure_, kTracks) ||
      contradicted_ > std::max(kNearlyAll * sure_, kFewTracks)) {
    return Verdict::kContradicted;
  }
  return far_ > std::max(kNearlyAll * sure_, kTracks) ? Verdict::kFar : Verdict::kGood;
}

}  // namespace perdure::vio
