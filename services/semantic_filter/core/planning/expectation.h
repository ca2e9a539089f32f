// Expected information of views that are not yet taken (paper, footnote at line 187: the vantage
// point that would most reduce the uncertainty). Visibility, detection probability, survival and
// EKF are those of the filter. Derivation: tools/docs/maths/expected_information.md.
#pragma once

#include <vector>

#include "common/base/time.h"
#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/view.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// Expected fall of entropy, bits.
struct Fall {
  double existence = 0.0, classes = 0.0, position = 0.0;  ///< of known objects
  double unseen = 0.0;                                    ///< of places without a known object

  double total() const { return existence + classes + position + unseen; }
  Fall& operator+=(const Fall& more);
};

/// An object of the map, or a place where an unknown one may stand.
struct Candidate {
  Track track;
  /// Of a place: probability that an object stands there if it was not observed for long. 0: the
  /// track is an object of the map.
  double stationary = 0.0;
};

struct TimedView {
  RigidTransform T_WB;  ///< z of W points against gravity
  TimePoint time;
};

/// The camera and the filter's models. The pointers are not null.
struct Observer {
  const CameraModel* camera;
  const ClassPriors* priors;
  const Parameters* parameters;
  double nats_per_hit = 0.0;  ///< class evidence of one detection (natsPerHit)
};

struct Expectation {
  std::size_t candidate = 0;  ///< index
  double existence = 0.0;     ///< at the first view in which it is visible
  double detected = 0.0;      ///< probability of a detection in any view, if it exists
  Fall fall;
};

/// Returns what `views`, taken in this order, are expected to show: one entry for each candidate
/// that is visible in any of them. Candidates at rest only.
std::vector<Expectation> expect(const std::vector<Candidate>& candidates,
                                const std::vector<TimedView>& views, const Observer& observer);

/// Applies a past view without any detection to the places among the candidates.
void observeNothing(std::vector<Candidate>& candidates, const TimedView& view,
                    const Observer& observer);

/// Returns the class evidence per detection by the ledgers of the beliefs: the mean log-likelihood
/// ratio of the most probable class to its closest rival, nats. 0: no ledger has a rival.
double natsPerHit(const std::vector<ObjectBelief>& beliefs);

}  // namespace perdure::semantic_filter
