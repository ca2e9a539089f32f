// The project's own network and the filter over a rendered scene with true poses, frame by frame,
// with predictions handed from one to the other: what the network reports of which true object.
#pragma once

#include <filesystem>
#include <vector>

#include "common/types/objects.h"
#include "services/inference/config.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::test {

/// One frame: what was reported, and what was believed before it.
struct LookedAt {
  std::uint64_t frame = 0;
  Detections detections;
  Objects before;
};

struct TopDownSetting {
  std::filesystem::path data;
  inference::Config inference;
  std::vector<ObjectBelief> planted = {};  ///< put into the map after frame `plant_at`
  std::uint64_t plant_at = 0;
};

struct TopDownRun {
  tools::SimulatedTruth truth;
  std::vector<LookedAt> frames;
  std::vector<std::string> classes;  ///< of the activations
};
TopDownRun driveThrough(const TopDownSetting& setting);

/// True objects that are hard to see and that the map holds: confirmed, within 1.5 m of the truth,
/// of its class, in the frame before. Small: under 24 px of the network's input (√ of the box's
/// area), and 10 px or more on the longer side. Half-hidden: .25 to .7 of what lies in the image
/// is in visibility.
struct HardRecall {
  std::size_t small = 0, small_found = 0, hidden = 0, hidden_found = 0;
  std::size_t ordinary_found = 0;  ///< of all, by a box that is not primed
  std::size_t false_alarms = 0;    ///< boxes, primed ones included, on no object
  std::size_t false_primed = 0;    ///< of these, primed
  std::size_t frames = 0;
  HardRecall& operator+=(const HardRecall& more);
  double recall() const {
    return static_cast<double>(small_found + hidden_found) / static_cast<double>(small + hidden);
  }
  double falseAlarms() const {
    return static_cast<double>(false_alarms) / static_cast<double>(frames);
  }
};
/// Found: by a box of IoU ½ with its outline cut at the image, one box for one object. Primed
/// answers count from `least` nats for the object on. `known` says which objects are on the map,
/// so that runs can be compared over the same ones.
HardRecall hardRecall(const TopDownRun& run, const TopDownRun& known, double input_scale,
                      double least);

}  // namespace perdure::test
