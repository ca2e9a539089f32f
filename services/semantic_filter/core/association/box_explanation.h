// How well each track's best hypothesis explains a box, for whoever asks; projections are made when
// first asked for.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/belief/motion_model.h"

namespace perdure::semantic_filter {

/// What a frame expects of each track's best hypothesis; worked out when first asked for.
class BoxExplanations {
 public:
  BoxExplanations(const Belief& belief, const FrameInput& input, const Parameters& parameters)
      : belief_(belief),
        input_(input),
        from_(input.view),
        parameters_(parameters.box),
        clutter_(parameters.clutter),
        at_(belief.tracks.size()) {}

  bool matches(std::size_t j, const std::array<bool, 4>& hidden, const BoxDetection& box) {
    return fit(j, hidden, box).has_value();
  }

  /// log of how well it explains the box, sides and class, against clutter.
  std::optional<double> fit(std::size_t j, const std::array<bool, 4>& hidden,
                            const BoxDetection& box) {
    const Entry& e = entryOf(j);
    if (!e.box || !mayOverlap(box.z, *e.box, e.covariance)) return std::nullopt;
    const auto score = scoreBox(box.z, *e.box, e.covariance, hidden, parameters_);
    if (!score) return std::nullopt;
    const Track& track = belief_.tracks[j];
    return score->log_density - logClutterOf(box, *score, input_.view, clutter_) +
           logRatio(box, input_.model, track.best().class_name, track.lookalike.nats);
  }

 private:
  struct Entry {
    bool known = false;
    std::optional<ProjectedBox> box;
    Eigen::Matrix4d covariance;
  };

  const Entry& entryOf(std::size_t j) {
    Entry& e = at_[j];
    if (e.known) return e;
    e.known = true;
    const Track& track = belief_.tracks[j];
    const Hypothesis& best = track.best();
    const State x = stateAt(best, toSeconds(input_.stamp.time - track.as_of));
    e.box = projectObserved(x, from_, input_.model.styles->of(best.class_name), best.heading());
    if (e.box) e.covariance = predictedCovariance(best, *e.box, input_.pose_error.covariance);
    return e;
  }

  const Belief& belief_;
  const FrameInput& input_;
  Projector from_;
  const BoxParameters& parameters_;
  const ClutterParameters& clutter_;
  std::vector<Entry> at_;
};

}  // namespace perdure::semantic_filter
