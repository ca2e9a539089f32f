// Description of a network's input and of its raw outputs: the contents of model.json.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/types/detections.h"

namespace perdure::inference {

/// Layout of the network's heads. Each family has a decode rule (core/decode/decode.cpp).
enum class Family {
  kYolox,
  kYoloFastest,
  kFastestDet,
  kPerdure,
  kYolov5,   ///< also YOLOv7
  kYolov8,   ///< also YOLOv9 to v12, YOLO26, RTMDet
  kNanoDet,  ///< also PicoDet
  kSsd,
  kDetr,  ///< also related networks with sigmoids (RT-DETR)
  kYoloFastestV2,
};

enum class Fit {
  kLetterboxTopLeft,  ///< one scale, image in the top left corner, rest padded (YOLOX)
  kLetterboxCentre,   ///< one scale, image in the middle, rest padded
  kResize,            ///< each side has its own scale; the aspect ratio changes
};

struct Input {
  int width = 0, height = 0;  ///< pixels, multiples of every stride
  Fit fit = Fit::kResize;
  bool rgb = false;  ///< true if the network was trained with RGB, not BGR
  double pad = 0.0;  ///< value of padding, before mean and scale
  /// input = (pixel − mean) · scale. Both are in the network's colour order.
  std::array<double, 3> scale = {1.0, 1.0, 1.0};
  std::vector<double> mean = {0.0, 0.0, 0.0};
};

/// One resolution of the head, with the names of its raw (pre-activation) tensors.
struct Level {
  int stride = 0;  ///< pixels of input per cell
  /// YOLOX and FastestDet: three tensors (1,4,H,W), (1,1,H,W), (1,K,H,W). YOLO-FastestV2 with A
  /// anchors: (1,4·A,H,W), (1,A,H,W), and one (1,K,H,W) for all anchors.
  std::string box, objectness, classes;
  /// YOLO-Fastest: one tensor (1,H,W,A·(5+K)) and A anchors (width, height, pixels of input).
  /// YOLOv5: (1,A·(5+K),H,W) or (1,A,H,W,5+K), and anchors. YOLOv8: (1,4·bins+K,H,W), or `box` and
  /// `classes` as two tensors. NanoDet: (1,K+4·bins,H,W), classes first.
  std::string tensor;
  std::vector<std::pair<double, double>> anchors;
  /// Perdure: `box` (1,4,H,W) and logits (1,1+K,H,W), background first. If the model has them,
  /// azimuth (1,2·bins,H,W) and spread (1,4,H,W).
  std::string logits, azimuth, spread;
};

/// Names of tensors that contain all levels: either `predictions`, or `boxes` and `scores`. The
/// levels then have no tensors of their own.
struct Outputs {
  std::string predictions;    ///< YOLOv5 (1,N,5+K), YOLOv8 (1,4+K,N), NanoDet (1,N,K+4·bins)
  std::string boxes, scores;  ///< (1,N,4) and (1,N,C); YOLOv8 (1,4,N) and (1,K,N)
  bool any() const { return !predictions.empty() || !boxes.empty(); }
};

/// Meaning of the four numbers of a complete box.
struct BoxForm {
  enum class Kind {
    kCentre,   ///< centre x, y, width, height
    kCorners,  ///< x1, y1, x2, y2
    kOffsets,  ///< centre relative to a prior, in its sizes; log of the ratio of sizes
  };
  Kind kind = Kind::kCentre;
  bool y_first = false;                          ///< each pair is (y, x)
  bool shares = false;                           ///< shares of the input's sides; else pixels
  std::vector<std::array<double, 4>> priors;     ///< centre x, y, width, height, in shares
  std::array<double, 2> variances = {0.1, 0.2};  ///< factors of the offsets of centre and size
};

/// Which score column is the background.
enum class Background { kNone, kFirst, kLast };

/// Calibration of answers to predictions without a reported box (core/decode/prime.h). If the best
/// candidate has the posterior log-odds s, the answer is `offset` + `slope`·s nats for the object's
/// existence. If no candidate has a score of at least `floor`, it is `nothing` nats.
struct PrimedCalibration {
  double floor = 0.0;  ///< in (0, 1), below the score threshold; 0: not fitted, no answers
  double slope = 0.0, offset = 0.0, nothing = 0.0;
};

/// Calibration that converts a score to a log-likelihood ratio against clutter (decode/evidence.h).
struct Calibration {
  double temperature = 1.0;   ///< > 0; above 1 if the network is overconfident
  double clutter_rate = 0.5;  ///< in (0, 1): share of the reported boxes that are clutter
  double bias = 0.0;          ///< nats, added to the posterior log-odds of every class
  PrimedCalibration primed = {};
};

/// Output of the azimuth: probabilities of `bins` equal parts of the circle, and a residual for
/// each.
struct Azimuth {
  int bins = 0;                      ///< 0: the network has no azimuth
  double sigma = 0.35;               ///< radians, remaining error if one bin is certain
  std::vector<std::string> classes;  ///< classes whose azimuth is reported
};

struct ModelDescription {
  std::string name;
  std::string digest;  ///< digest of the network and its weights; empty: not known
  Family family = Family::kYolox;
  Input input;
  std::vector<std::string> classes;  ///< lower-case, unique, in the order of the network
  bool class_softmax = false;        ///< soft-max over the classes; else independent sigmoids
  bool applied = false;              ///< the network's scores are already probabilities
  Background background = Background::kNone;
  double objectness_exponent = 1.0;  ///< score = objectness^a · class^b
  double class_exponent = 1.0;
  std::vector<Level> levels;
  Outputs outputs;
  bool for_onnx_runtime = false;  ///< OpenCV lacks one of its operators
  BoxForm box_form;               ///< form of the boxes in `outputs`
  /// YOLOv8, NanoDet: a side's distance is the mean over 0 … bins − 1. If `bins` is 1, the output
  /// is the distance itself.
  int bins = 0;
  bool exponents = false;    ///< with one bin, the value is the logarithm of the distance
  double cell_offset = 0.5;  ///< YOLOv8, NanoDet: distances start at (g + offset)·s
  Azimuth azimuth;
  double reach = 0.0;         ///< perdure: cells by which a cell's centre may lie outside its box
  double spread_scale = 0.0;  ///< perdure: factor from spread to standard deviation; 0: no spread
  double box_sigma = 0.0;  ///< standard deviation of a side relative to the box's size; 0: unknown
  BoxExtent boxes = BoxExtent::kUnknown;
  bool upright = true;  ///< images may be turned upright (core/network/image_fit.h)
  /// Insets of the sides by class (see ModelInfo).
  std::map<std::string, std::array<double, 4>> side_insets;
  Calibration calibration;
};

}  // namespace perdure::inference
