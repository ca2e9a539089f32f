#include "services/semantic_filter/core/look.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {
namespace {

constexpr double kMaxLogLikelihood = 40.0;  // nats, keeps products finite

bool mayMatch(const BoxMeasurement& z, const ProjectedBox& p, const Eigen::Matrix4d& covariance) {
  for (int axis = 0; axis < 2; ++axis) {
    const double reach = 5.0 * std::sqrt(std::max(covariance(axis, axis),
                                                  covariance(axis + 2, axis + 2)) +
                                         z.variance[axis]);
    if (z.sides[axis] > p.sides[axis + 2] + reach) return false;
    if (p.sides[axis] > z.sides[axis + 2] + reach) return false;
  }
  return true;
}

void scoreBoxes(HypothesisLook& h, const std::string& class_name, const Sight& sight,
                const std::vector<Evidence>& boxes, const FrameContext& frame) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Evidence& e = boxes[i];
    if (!mayMatch(e.z, *h.box, h.covariance)) continue;
    const auto score =
        scoreBox(e.z, *h.box, h.covariance, sight.hidden, frame.parameters->box.gate);
    if (!score) continue;
    const double log_l = logRatio(e, *frame.model, class_name) + score->log_density - e.log_clutter;
    h.likelihood[i] = std::exp(std::min(log_l, kMaxLogLikelihood));
    h.nis[i] = score->nis / score->dof;
  }
}

}  // namespace

double detectionProbability(const ClassPrior& prior, double height_px, const FrameContext& frame) {
  const BoxParameters& box = frame.parameters->box;
  double half = box.min_height_px;
  if (frame.model && frame.model->input_width > 0.0) {
    half = box.min_network_px * frame.view.camera->width() / frame.model->input_width;
  }
  return prior.detection_probability / (1.0 + std::exp(-(height_px - half) / (0.2 * half)));
}

ObjectLook look(const Object& object, const Sight& sight, const std::vector<Evidence>& boxes,
                const FrameContext& frame) {
  ObjectLook result;
  result.sight = sight;
  const auto& looks = frame.parameters->looks;
  const auto worth = [&](const ViewPoint& last) {
    return worthOfLook(viewPointNow(object, last, frame.view, looks).looks, looks.correlation);
  };
  result.worth = worth(object.hit_view);
  result.worth_of_miss = worth(object.miss_view);
  for (const auto& hypothesis : object.hypotheses) {
    HypothesisLook h;
    h.likelihood.assign(boxes.size(), 0.0);
    h.nis.assign(boxes.size(), 0.0);
    h.box = projectCuboid(hypothesis.x, frame.view);
    if (h.box) {
      h.covariance = predictedCovariance(hypothesis, *h.box, frame.pose_error.covariance);
      const double height = h.box->sides[3] - h.box->sides[1];
      h.detection = sight.fraction * detectionProbability(frame.priors->of(hypothesis.class_name),
                                                          height, frame);
      scoreBoxes(h, hypothesis.class_name, sight, boxes, frame);
    }
    result.hypotheses.push_back(std::move(h));
  }
  return result;
}

double associationWeight(const Object& object, const ObjectLook& look, std::size_t z) {
  double made = 0.0, silent = 0.0;
  for (std::size_t i = 0; i < object.hypotheses.size(); ++i) {
    const HypothesisLook& h = look.hypotheses[i];
    made += object.hypotheses[i].weight * h.detection * h.likelihood[z];
    silent += object.hypotheses[i].weight * (1.0 - h.detection);
  }
  const double r = object.existence;
  return r * made / std::max(1.0 - r + r * silent, 1e-12);
}

ViewPoint viewPointNow(const Object& object, const ViewPoint& last, const View& view,
                       const LooksParameters& parameters) {
  const Eigen::Vector3d ray = view.T_WC().p - object.best().x.head<3>();
  const double distance = std::max(ray.norm(), 1e-3);
  ViewPoint now;
  now.direction_W = ray / distance;
  now.log_distance = std::log(distance);
  now.direction_C = -(view.T_WC().q.conjugate() * now.direction_W);
  if (last.looks <= 0.0) return now;
  const double change =
      (now.direction_W - last.direction_W).norm() / parameters.angle +
      (now.direction_C - last.direction_C).norm() / parameters.image_angle +
      std::abs(now.log_distance - last.log_distance) / parameters.log_distance;
  now.looks = last.looks * std::exp(-change);
  return now;
}

double worthOfLook(double looks, double correlation) {
  const auto information = [&](double n) { return n / (correlation * n + 1.0 - correlation); };
  return information(looks + 1.0) - information(looks);
}

}  // namespace perdure::semantic_filter
