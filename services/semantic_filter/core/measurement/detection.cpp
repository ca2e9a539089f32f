#include "services/semantic_filter/core/measurement/detection.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {

namespace {

BoxStyles stylesOf(const ModelInfo& info, const ClassPriors& priors, BoxExtent boxes) {
  BoxStyles styles;
  if (boxes == BoxExtent::kOutline) {
    for (const ClassPrior& prior : priors.classes) styles.by_class[prior.name].shape = prior.shape;
  }
  if (info.side_insets.size() != 4 * info.classes.size() || info.classes.empty()) return styles;
  std::map<std::string, Eigen::Vector4d> offsets;
  for (std::size_t k = 0; k < info.classes.size(); ++k) {
    const Eigen::Vector4d inset(&info.side_insets[4 * k]);
    // Left and top move to larger coordinates, right and bottom to smaller ones.
    const Eigen::Vector4d offset(inset[0], inset[1], -inset[2], -inset[3]);
    offsets[info.classes[k]] = offset;
    styles.rest.offset += offset / static_cast<double>(info.classes.size());
  }
  for (auto& [name, style] : styles.by_class) style.offset = styles.rest.offset;
  for (const auto& [name, offset] : offsets) styles.by_class[name].offset = offset;
  return styles;
}

/// Returns the log ratio of *other* to clutter. To the network, an object of no known class
/// resembles clutter or one of its classes.
double logRatioOfOther(const BoxDetection& e, double lookalike_nats) {
  const double share = lookalikeProbability(e.lookalike, lookalike_nats);
  return std::log(1.0 - share + share * std::exp(e.log_ratio_best));
}

double shared(double a1, double a2, double b1, double b2) {
  return std::min(a2, b2) - std::max(a1, b1);
}

/// Returns the variance of a side, by noise and b, px².
double variance(const BoxMeasurement& z, int side) { return z.variance[side] + z.lasting[side]; }

/// Whether two sides may be the same edge in the image.
bool sameEdge(const BoxMeasurement& a, int side_a, const BoxMeasurement& b, int side_b) {
  const double d = a.sides[side_a] - b.sides[side_b];
  return a.measured[side_a] &&
         d * d < gates::kSameEdge * (variance(a, side_a) + variance(b, side_b));
}

/// Whether `a` stands lower in the image than `b`. `slope`: dy/dx of a level line.
bool reachesLower(const BoxMeasurement& a, const BoxMeasurement& b, double slope) {
  const double apart = 0.5 * (a.sides[0] + a.sides[2] - b.sides[0] - b.sides[2]);
  const double lower =
      a.sides[3] - b.sides[3] - slope * apart - 0.5 * std::abs(slope) * (a.width() + b.width());
  return lower > 0.0 && lower * lower > gates::kLower * (variance(a, 3) + variance(b, 3));
}

/// Marks the sides of `far` at which `near` begins.
void markBeside(BoxDetection& far, const BoxDetection& near) {
  constexpr double kFaces = 0.5;  // share of the side that the nearer box covers
  const BoxMeasurement &a = far.z, &b = near.z;
  const bool rows = shared(a.sides[1], a.sides[3], b.sides[1], b.sides[3]) > kFaces * a.height();
  const bool columns = shared(a.sides[0], a.sides[2], b.sides[0], b.sides[2]) > kFaces * a.width();
  far.beside_nearer[0] |= rows && sameEdge(a, 0, b, 2);
  far.beside_nearer[2] |= rows && sameEdge(a, 2, b, 0);
  far.beside_nearer[3] |= columns && sameEdge(a, 3, b, 1);
}

}  // namespace

Model makeModel(const ModelInfo& info, const ClassPriors& priors) {
  Model model;
  model.hash = model.network = info.hash;
  model.classes = info.classes;
  model.names = std::make_shared<const ClassNames>(info.classes.begin(), info.classes.end());
  for (std::size_t k = 0; k < info.classes.size(); ++k) model.index.emplace(info.classes[k], k);
  model.input_width = info.input_width;
  model.box_sigma = info.box_sigma;
  const auto styles = [&](BoxExtent boxes) {
    return std::make_shared<const BoxStyles>(stylesOf(info, priors, boxes));
  };
  model.styles = styles(info.boxes);
  if (info.boxes == BoxExtent::kUnknown && info.side_insets.empty()) {
    model.outline_styles = styles(BoxExtent::kOutline);
  }
  return model;
}

BoxNoise boxNoise(const Model& model, double image_width) {
  return {model.box_sigma, model.input_width > 0.0 ? image_width / model.input_width : 0.0};
}

const char* flawOf(const Detection& detection, const Model& model) {
  const Box& b = detection.box;
  if (!std::isfinite(b.x1 + b.y1 + b.x2 + b.y2)) return "detections_not_finite";
  if (b.x1 >= b.x2 || b.y1 >= b.y2) return "detections_box_inside_out";
  if (detection.activations.size() != model.classes.size() + 1) {
    return "detections_classes_mismatch";
  }
  for (const float a : detection.activations) {
    if (std::isnan(a - detection.activations[0])) return "detections_not_finite";
  }
  for (const double sigma : detection.side_sigma) {
    if (!std::isfinite(sigma)) return "detections_not_finite";
  }
  if (!detection.azimuth) return nullptr;
  if (!std::isfinite(*detection.azimuth + detection.azimuth_sigma)) return "detections_not_finite";
  return detection.azimuth_sigma > 0.0 ? nullptr : "detections_azimuth_without_sigma";
}

std::optional<BoxDetection> makeBoxDetection(const Detection& detection, const Model& model,
                                             double width, double height, const BoxParameters& box,
                                             const ClutterParameters& clutter) {
  const Box& b = detection.box;
  if (flawOf(detection, model)) return std::nullopt;
  BoxDetection e;
  const double zero = detection.activations[0];
  double best = -clutter.max_log_ratio, odds = 0.0;
  std::vector<double>& log_ratio = e.log_ratio.write(model.classes.size());
  for (std::size_t k = 0; k < model.classes.size(); ++k) {
    const double ratio = detection.activations[k + 1] - zero;
    log_ratio.push_back(std::clamp(ratio, -clutter.max_log_ratio, clutter.max_log_ratio));
    best = std::max(best, log_ratio.back());
    odds += std::exp(log_ratio.back());
  }
  BoxNoise noise = boxNoise(model, width);
  noise.sides = detection.side_sigma;
  noise.clutter_probability = 1.0 / (1.0 + odds);
  e.z = measure(b, width, height, box, noise);
  if (e.z.width() < 1.0 || e.z.height() < 1.0) return std::nullopt;
  e.log_clutter = logClutter(e.z, width, height, clutter);
  e.log_ratio_best = best;
  e.lookalike = clutter.other_lookalike;
  e.log_ratio_other = logRatioOfOther(e, 0.0);
  e.azimuth = detection.azimuth;
  e.azimuth_sigma = detection.azimuth_sigma;
  return e;
}

void markSidesBesideNearer(std::vector<BoxDetection>& boxes, const View& view) {
  const Eigen::Vector3d up = view.T_WC().R().transpose() * view.up_W;
  if (up.y() >= 0.0) return;  // the camera is upside down
  const double slope = -up.x() / up.y();
  for (BoxDetection& far : boxes) {
    for (const BoxDetection& near : boxes) {
      if (reachesLower(near.z, far.z, slope)) markBeside(far, near);
    }
  }
}

std::array<bool, 4> withSidesBesideNearer(std::array<bool, 4> hidden, const BoxDetection& box) {
  for (std::size_t i = 0; i < 4; ++i) hidden[i] = hidden[i] || box.beside_nearer[i];
  return hidden;
}

std::optional<std::vector<double>> topDownRatios(const Detection& detection, const Model& model,
                                                 const ClutterParameters& clutter) {
  if (detection.activations.size() != model.classes.size() + 1) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t k = 0; k < model.classes.size(); ++k) {
    const double ratio = detection.activations[k + 1] - detection.activations[0];
    if (std::isnan(ratio)) return std::nullopt;
    ratios.push_back(std::clamp(ratio, -clutter.max_log_ratio, clutter.max_log_ratio));
  }
  return ratios;
}

std::string classSeenIn(const BoxDetection& detection, const Model& model) {
  const auto& ratios = detection.log_ratio;
  const auto most = std::max_element(ratios.begin(), ratios.end());
  if (most == ratios.end() || *most <= 0.0) return {};
  return model.classes[static_cast<std::size_t>(most - ratios.begin())];
}

double lookalikeProbability(double prior, double lookalike_nats) {
  constexpr double kMost = 0.5;  // limit; from another side it may resemble no class
  const double looks_alike = prior * std::exp(std::min(lookalike_nats, 100.0));
  return std::min(looks_alike / (1.0 - prior + looks_alike), std::max(kMost, prior));
}

double logRatio(const BoxDetection& detection, const Model& model, const std::string& class_name,
                double lookalike_nats) {
  const auto it = model.index.find(class_name);
  if (it != model.index.end()) return detection.log_ratio[it->second];
  return lookalike_nats == 0.0 ? detection.log_ratio_other
                               : logRatioOfOther(detection, lookalike_nats);
}

}  // namespace perdure::semantic_filter
