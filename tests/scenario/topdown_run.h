// Runs the project's own network and the filter over a rendered scene with true poses, frame by
// frame. Predictions go from the filter to the network. Scores which true objects the network
// reports.
#pragma once

#include <filesystem>
#include <vector>

#include "common/types/objects.h"
#include "services/inference/config.h"
#include "tools/evaluate/simulated_truth.h"

namespace perdure::test {

/// One frame: the detections, and the objects before it.
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
  std::vector<std::string> classes;  ///< classes of the activations
};
TopDownRun driveThrough(const TopDownSetting& setting);

/// Recall of true objects that are hard to see and on the map: confirmed, within 1.5 m of the truth
/// and of its class, in the frame before. Small means under 24 px of the network's input (√ of the
/// box's area), and 10 px or more on the longer side. Half-hidden means that .25 to .7 of the part
/// in the image is visible.
struct HardRecall {
  std::size_t small = 0, small_found = 0, hidden = 0, hidden_found = 0;
  std::size_t ordinary_found = 0;  ///< all objects with a bottom-up box
  std::size_t false_alarms = 0;    ///< boxes on no object, top-down ones included
  std::size_t false_primed = 0;    ///< top-down boxes among them
  std::size_t frames = 0;
  HardRecall& operator+=(const HardRecall& more);
  double recall() const {
    return static_cast<double>(small_found + hidden_found) / static_cast<double>(small + hidden);
  }
  double falseAlarms() const {
    return static_cast<double>(false_alarms) / static_cast<double>(frames);
  }
};
/// A true object is found if a box has IoU ½ with its outline clipped to the image; each box counts
/// for one object. Top-down answers count from `least` nats for the object on. `known` determines
/// which objects are on the map, so that runs can be compared over the same objects.
HardRecall hardRecall(const TopDownRun& run, const TopDownRun& known, double input_scale,
                      double least);

}  // namespace perdure::test
