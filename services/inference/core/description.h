// What a network expects and what its raw outputs mean: the contents of model.json.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace perdure::inference {

/// How the network's heads are laid out; one decode rule each (core/decode.cpp).
enum class Family { kYolox, kYoloFastest, kFastestDet, kPerdure };

/// How an image is brought to the input size.
enum class Fit {
  kLetterboxTopLeft,  ///< one scale, image in the top left corner, rest padded (YOLOX)
  kLetterboxCentre,   ///< one scale, image in the middle, rest padded
  kResize,            ///< each side has its own scale; the aspect ratio changes
};

struct Input {
  int width = 0, height = 0;  ///< pixels, multiples of every stride
  Fit fit = Fit::kResize;
  bool rgb = false;                            ///< colour order that the network was trained with
  double pad = 0.0;                            ///< value of padding, before mean and scale
  double scale = 1.0;                          ///< input = (pixel - mean) * scale
  std::vector<double> mean = {0.0, 0.0, 0.0};  ///< in the network's colour order
};

/// One resolution of the head, by the names of its raw (pre-activation) tensors.
struct Level {
  int stride = 0;  ///< pixels of input per cell
  /// YOLOX and FastestDet: three tensors (1,4,H,W), (1,1,H,W), (1,K,H,W).
  std::string box, objectness, classes;
  /// YOLO-Fastest: one tensor (1,H,W,A·(5+K)) and A anchors (width, height, pixels of input).
  std::string tensor;
  std::vector<std::pair<double, double>> anchors;
  /// Perdure: `box` (1,4,H,W) and logits (1,1+K,H,W), background first; azimuth (1,2·bins,H,W)
  /// and spread (1,4,H,W) where the model has them.
  std::string logits, azimuth, spread;
};

/// From the network's score to a log-likelihood ratio against clutter (core/evidence.h).
struct Calibration {
  double temperature = 1.0;   ///< > 0; above 1 the network was overconfident
  double clutter_rate = 0.5;  ///< in (0, 1): share of the emitted boxes that are clutter
};

/// Azimuth as the likeliest of `bins` equal parts of the circle and a residual.
struct Azimuth {
  int bins = 0;                      ///< 0: the network has no azimuth
  double sigma = 0.35;               ///< radians, what remains where one bin is certain
  std::vector<std::string> classes;  ///< whose azimuth is reported
};

struct ModelDescription {
  std::string name;
  Family family = Family::kYolox;
  Input input;
  std::vector<std::string> classes;  ///< lower-case, unique, in the order of the network
  bool class_softmax = false;        ///< class activation: soft-max, or independent sigmoids
  double objectness_exponent = 1.0;  ///< score = objectness^a · class^b
  double class_exponent = 1.0;
  std::vector<Level> levels;
  Azimuth azimuth;
  double reach = 0.0;         ///< perdure: cells that a cell's centre may lie outside its box
  double spread_scale = 0.0;  ///< perdure: spread to standard deviation; 0: the network has none
  double box_sigma = 0.0;  ///< standard deviation of a side relative to the box's size; 0 unknown
  std::map<std::string, std::array<double, 4>> side_insets;  ///< by class; see ModelInfo
  Calibration calibration;
};

/// Names of the tensors to ask the network for, in the order that decode() takes them.
inline std::vector<std::string> tensorNames(const ModelDescription& model) {
  std::vector<std::string> names;
  for (const Level& level : model.levels) {
    if (model.family == Family::kYoloFastest) {
      names.push_back(level.tensor);
    } else if (model.family == Family::kPerdure) {
      names.insert(names.end(), {level.box, level.logits});
      if (model.azimuth.bins > 0) names.push_back(level.azimuth);
      if (model.spread_scale > 0) names.push_back(level.spread);
    } else {
      names.insert(names.end(), {level.box, level.objectness, level.classes});
    }
  }
  return names;
}

}  // namespace perdure::inference
