// One box of the network as the filter uses it: box, and log-likelihood ratios by class (paper, eq.
// 6). Only differences to the clutter activation matter. Derivation:
// tools/docs/maths/measurement_likelihood.md.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/shared_vector.h"
#include "common/types/detections.h"
#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/measurement/box_likelihood.h"

namespace perdure::semantic_filter {

struct BoxStyles {
  std::map<std::string, BoxStyle> by_class;
  BoxStyle rest;  ///< of a class that neither model nor priors name: mean of the offsets

  const BoxStyle& of(const std::string& class_name) const {
    const auto it = by_class.find(class_name);
    return it == by_class.end() ? rest : it->second;
  }
};

using ClassNames = std::set<std::string>;

/// The part of a ModelInfo that the filter needs.
struct Model {
  std::uint64_t hash = 0;
  /// Hash of the first model of the same network. It is the key of the learned properties of the
  /// network's boxes. It differs from `hash` if the list of classes grew.
  std::uint64_t network = 0;
  std::vector<std::string> classes;
  /// the same as `classes`
  std::shared_ptr<const ClassNames> names = std::make_shared<const ClassNames>();
  std::map<std::string, std::size_t> index;  ///< class name to position in `classes`
  double input_width = 0.0;                  ///< of the network's input, px; 0: unknown
  double box_sigma = 0.0;
  std::shared_ptr<const BoxStyles> styles = std::make_shared<const BoxStyles>();
  /// Styles of outlines; set if the model does not state what its boxes enclose. `styles` is then
  /// that of cuboids.
  std::shared_ptr<const BoxStyles> outline_styles = nullptr;
};
/// Shapes come from the priors if the model states that its boxes enclose outlines.
Model makeModel(const ModelInfo& info, const ClassPriors& priors = {});
/// Returns the errors that the model states for all its boxes, in images `image_width` pixels wide.
BoxNoise boxNoise(const Model& model, double image_width);

struct BoxDetection {
  BoxMeasurement z;
  double log_clutter = 0.0;
  /// Nats by which partial views of objects below visibility.minimum make such a box more frequent.
  double log_partial_views = 0.0;
  SharedVector<double> log_ratio;  ///< nats, by class of the model, clamped
  double log_ratio_best = 0.0;     ///< the largest of them
  double log_ratio_other = 0.0;    ///< of *other*, at its first observation
  double lookalike = 0.0;          ///< share of *other* objects that resemble a known class
  std::optional<double> azimuth;
  double azimuth_sigma = 0.35;
  /// Sides (x1, y1, x2, y2) at which a nearer box begins: the object may reach on behind it.
  std::array<bool, 4> beside_nearer{};
};

/// Marks `beside_nearer` of all boxes. On level ground, nearer objects stand lower in the image.
void markSidesBesideNearer(std::vector<BoxDetection>& boxes, const View& view);
/// Returns the sides that are `hidden` or beside a nearer box.
std::array<bool, 4> withSidesBesideNearer(std::array<bool, 4> hidden, const BoxDetection& box);

/// Returns the name of the first fault of a detection, as counted in Health, or nullptr:
/// "detections_not_finite", "detections_box_inside_out", "detections_classes_mismatch" or
/// "detections_azimuth_without_sigma". A message with one such detection is refused as a whole,
/// because a missing detection would count as a miss.
const char* flawOf(const Detection& detection, const Model& model);

/// Returns nothing if the detection has a fault, or less than a pixel of it is in the image
/// (`width`, `height`: px).
std::optional<BoxDetection> makeBoxDetection(const Detection& detection, const Model& model,
                                             double width, double height, const BoxParameters& box,
                                             const ClutterParameters& clutter);

/// Top-down answers of the network: log-likelihood ratios by class, for each predicted track.
using TopDownAnswers = std::map<ObjectId, std::vector<double>>;
/// Returns the ratios of one answer, clamped; nothing if it is not usable.
std::optional<std::vector<double>> topDownRatios(const Detection& detection, const Model& model,
                                                 const ClutterParameters& clutter);

/// Returns the class that the network prefers; "" if clutter is more likely than every class.
std::string classSeenIn(const BoxDetection& detection, const Model& model);

/// Returns the probability that an *other* object resembles a class, from `prior` and earlier nats.
double lookalikeProbability(double prior, double lookalike_nats);

/// Returns log g_k; a class that the model does not have is scored as *other*. `lookalike_nats`:
/// the nats by which an *other* object resembled a known class before, as a toy car does.
double logRatio(const BoxDetection& detection, const Model& model, const std::string& class_name,
                double lookalike_nats = 0.0);

}  // namespace perdure::semantic_filter
