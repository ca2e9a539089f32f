// Targets: the files that services read at their start. They are configuration, priors, a network's
// description, and saved states.
#include "common/base/ids.h"
#include "common/config/fields.h"
#include "services/capture/core/run_state.h"
#include "services/inference/model_file.h"
#include "services/semantic_filter/priors.h"
#include "services/vio/core/state/saved_state.h"
#include "tests/fuzz/target.h"

namespace perdure::fuzz {
namespace {

/// One field of each kind.
struct Everything {
  double rate = 20.0;
  std::int64_t count = 3;
  bool on = true;
  std::string name = "ego", mode = "fast";
  std::vector<double> place{0.0, 1.5, -2.0};
  std::vector<std::string> hosts{"a", "b"};

  config::Fields fields() {
    config::Fields f;
    f.number("rate", rate, config::positive(), {"how often", "Hz", "set it above 0"});
    f.integer("tracker.count", count, config::between(1, 100), {"how many"});
    f.boolean("tracker.on", on, {"whether"});
    f.text("name", name, {"whose"});
    f.choice("mode", mode, {"fast", "exact"}, {"how"});
    f.numbers("place", place, config::between(-1e6, 1e6), {"where", "m"}, 3);
    f.texts("bus.hosts", hosts, {"with whom"});
    return f;
  }
};

constexpr char kSettings[] =
    "rate: 12.5\ntracker:\n  count: 7\n  on: false\nname: \"a name\"\nmode: exact\n"
    "place: [1, 2.5, -3e2]\nbus.hosts: [one, 'two, three']\n";

/// Printed settings must read back to the same settings, whatever was accepted before.
bool takeSettings(View bytes) {
  Everything read, again;
  config::Fields fields = read.fields(), printed = again.fields();
  const auto problems = config::readYaml(fields, textOf(bytes), "fuzz.yaml");
  for (const auto& problem : problems) require(!problem.str().empty(), "a problem says what");
  const std::string text = config::toYaml(fields);
  const auto none = config::readYaml(printed, text, "again.yaml");
  require(none.empty(), "printed settings read back: " + (none.empty() ? "" : none[0].str()));
  require(config::toYaml(printed) == text, "printed settings read back to the same");
  return problems.empty();
}

bool takeAssignment(View bytes) {
  Everything read;
  config::Fields fields = read.fields();
  return config::assign(fields, textOf(bytes)).empty();
}

constexpr char kPriors[] =
    "fallback: {size: [0.7, 0.6, 0.7], spread: [0.4, 0.35, 0.35], common: 0.5, yaw: true}\n"
    "other: {size: [1.0, 1.0, 1.0], moving: 0.1, speed: 4.0, yaw: false}\n"
    "classes:\n  car: {size: [4.0, 1.67, 1.53], stands: 0.97, frequency: 2.0, detection: 0.9,\n"
    "        shape: [[-1, 0.63, 0.92, 1], [0, 1, 1, 0.79], [1, 0.25, 0.61, 1, -0.32]]}\n"
    "  van: {azimuth_sigma: 0.3}\n";

bool takePriors(View bytes) {
  return unlessRefused([&] {
    const auto priors = semantic_filter::parseClassPriors(textOf(bytes), "priors.yaml");
    for (const auto& prior : priors.classes) {
      require(prior.log_size.allFinite() && prior.log_size_covariance.allFinite(),
              "a prior is finite");
    }
    (void)semantic_filter::shapePoints(priors);
  });
}

constexpr char kModel[] = R"({
  "comment": "a network", "name": "fast", "family": "yolo-fastest",
  "input": {"width": 320, "height": 320, "fit": "resize", "colour": "rgb", "scale": 0.004,
            "mean": [0, 0, 0]},
  "classes": ["person", "car"], "activation": {"class": "sigmoid"},
  "levels": [{"stride": 32, "tensor": "p1", "anchors": [[115, 73], [119, 199], [242, 238]]},
             {"stride": 16, "tensor": "p2", "anchors": [[12, 18], [37, 49], [52, 132]]}],
  "box_sigma": 0.15, "side_insets": {"car": [0, 0.1, 0, -0.1]},
  "calibration": {"temperature": 1.0, "clutter_rate": 0.8, "primed": {"slope": 1}}})";
constexpr char kYolox[] = R"({
  "name": "x", "family": "yolox", "box_extent": "outline",
  "input": {"width": 416, "height": 416, "fit": "letterbox_top_left", "colour": "bgr",
            "scale": [1, 2, 3], "mean": [1, 2, 3]},
  "classes": ["car"], "activation": {"class": "sigmoid"},
  "levels": [{"stride": 8, "classes": "c1", "box": "b1", "objectness": "o1"}]})";

bool takeModel(View bytes) {
  return unlessRefused([&] {
    const auto model = inference::parseModelDescription(textOf(bytes), "fuzz/model.json");
    require(model.input.width > 0 && model.input.height > 0, "a network's input has a size");
  });
}

bool takeRunState(View bytes) {
  const auto state = capture::runStateFrom(textOf(bytes));
  if (!state) return false;
  require(capture::runStateFrom(capture::toText(*state)).has_value(), "a state reads back");
  return true;
}

std::vector<Bytes> runStates() {
  return {bytesOf(capture::toText({"0a1b", "boot", 5, 6, 7, 8, true})),
          bytesOf(capture::toText({}))};
}

bool takeVioState(View bytes) {
  const auto state = vio::fromText(textOf(bytes));
  if (!state) {
    require(!state.error().code.empty(), "a refusal has a reason");
    return false;
  }
  require(state->covariance.allFinite(), "a covariance is finite");
  require(vio::fromText(vio::toText(*state)).has_value(), "a state reads back");
  return true;
}

std::vector<Bytes> vioStates() {
  vio::SavedState state;
  state.world = {17, 2};
  state.T_BC.resize(1);
  state.readout_s = {0.02};
  state.lens.assign(1, vio::LensError::Zero());
  state.estimated = {.readout = true, .scale = false, .lens = true};
  const int size = vio::calibrationSize(state.readout_s, state.estimated);
  state.covariance = 0.01 * Eigen::MatrixXd::Identity(size, size);
  return {bytesOf(vio::toText(state))};
}

}  // namespace

std::vector<Target> settingTargets() {
  const auto alone = [](std::vector<std::string> texts) {
    return [texts = std::move(texts)] {
      std::vector<Bytes> seeds;
      for (const auto& text : texts) seeds.push_back(bytesOf(text));
      return seeds;
    };
  };
  return {{"configuration", 9000, alone({kSettings}), takeSettings},
          {"assignment", 9000,
           alone({"rate=3", "place=[1, 2, 3]", "bus.hosts=[a]", "mode=exact", "tracker.on=true"}),
           takeAssignment},
          {"class_priors", 4200, alone({kPriors}), takePriors},
          {"model_description", 9000, alone({kModel, kYolox}), takeModel},
          {"run_state", 6000, runStates, takeRunState},
          {"vio_state", 6000, vioStates, takeVioState}};
}

}  // namespace perdure::fuzz
