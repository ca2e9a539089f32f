// One box of the network as the filter reads it: geometry and log-likelihood ratios by class.
// Eq. 6: activations before the soft-max are marginal likelihoods; only differences to the clutter
// activation matter, so that any constant added to all of them changes nothing.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/types/detections.h"
#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/measurement/box_likelihood.h"

namespace perdure::semantic_filter {

/// How a model draws its boxes, by class.
struct BoxStyles {
  std::map<std::string, BoxStyle> by_class;
  BoxStyle rest;  ///< of a class that neither it nor the priors name: the mean of its offsets

  const BoxStyle& of(const std::string& class_name) const {
    const auto it = by_class.find(class_name);
    return it == by_class.end() ? rest : it->second;
  }
};

using ClassNames = std::set<std::string>;

/// What the filter keeps of a ModelInfo.
struct Model {
  std::uint64_t hash = 0;
  std::vector<std::string> classes;
  std::shared_ptr<const ClassNames> names = std::make_shared<const ClassNames>();  ///< the same
  std::map<std::string, std::size_t> index;  ///< name to position in `classes`
  double input_width = 0.0;                  ///< of the network, 0 = unknown
  double box_sigma = 0.0;
  std::shared_ptr<const BoxStyles> styles = std::make_shared<const BoxStyles>();
};
/// Shapes are the priors', where the model says that its boxes enclose what is seen of a thing.
Model makeModel(const ModelInfo& info, const ClassPriors& priors = {});
/// What the model says of all its boxes, in images of this width in pixels.
BoxNoise boxNoise(const Model& model, double image_width);

struct BoxDetection {
  BoxMeasurement z;
  double log_clutter = 0.0;
  /// Nats by which things that show less than visibility.minimum make such a box commoner.
  double log_partial_views = 0.0;
  std::vector<double> log_ratio;  ///< by the model's class, clamped
  double log_ratio_best = 0.0;    ///< the most of them
  double log_ratio_other = 0.0;   ///< of a real thing of no known class, at first visibility
  double lookalike = 0.0;         ///< share of such things that look like one of a known class
  std::optional<double> azimuth;
  double azimuth_sigma = 0.35;
};

/// What no network can mean, as Health counts it: "detections_not_finite",
/// "detections_box_inside_out", "detections_classes_mismatch", "detections_azimuth_without_sigma".
/// A message that holds one such detection is no detection: what is missing in it would be a miss.
const char* flawOf(const Detection& detection, const Model& model);

/// Nothing for a flawed detection, or one that leaves no pixel in the image.
std::optional<BoxDetection> makeBoxDetection(const Detection& detection, const Model& model,
                                             double width, double height, const BoxParameters& box,
                                             const ClutterParameters& clutter);

/// What primed answers say: log-likelihood ratios by the model's class, by the track asked for.
using TopDownAnswers = std::map<ObjectId, std::vector<double>>;
/// Of one answer, clamped; nothing where it is not usable.
std::optional<std::vector<double>> topDownRatios(const Detection& detection, const Model& model,
                                                 const ClutterParameters& clutter);

/// The class that the network sees in it; "" where it is more like clutter than like any.
std::string classSeenIn(const BoxDetection& detection, const Model& model);

/// That a thing of no known class looks like one of a known class: `prior` is the share of such
/// things, `lookalike_nats` the nats by which its looks resembled one.
double lookalikeProbability(double prior, double lookalike_nats);

/// log g_k; classes that the model does not know are seen as "other". `lookalike_nats`: nats by
/// which its earlier looks resembled a known class, if it is of none (a toy looks like a car
/// whenever it is looked at).
double logRatio(const BoxDetection& detection, const Model& model, const std::string& class_name,
                double lookalike_nats = 0.0);

}  // namespace perdure::semantic_filter
