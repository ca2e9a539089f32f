#include "tools/map/learn_context.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "services/semantic_filter/core/tracks/context.h"

namespace perdure::tools {
namespace {

using map_store::PlacedBelief;

/// By frame of reference, then along x: a sweep meets every near pair.
void sortForSweep(std::vector<PlacedBelief>& beliefs) {
  std::sort(beliefs.begin(), beliefs.end(), [](const auto& a, const auto& b) {
    return std::make_tuple(a.world.world, a.world.epoch, a.belief.best().mean[0], a.belief.id) <
           std::make_tuple(b.world.world, b.world.epoch, b.belief.best().mean[0], b.belief.id);
  });
}

std::vector<std::string> classesOf(const std::vector<PlacedBelief>& beliefs) {
  std::set<std::string> names;
  for (const auto& placed : beliefs) {
    for (const auto& c : placed.belief.classes) {
      if (c.name != kOtherClass) names.insert(c.name);
    }
  }
  return {names.begin(), names.end()};
}

/// r π of each class, as `classes`.
Eigen::VectorXd weightsOf(const ObjectBelief& belief, const std::vector<std::string>& classes) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(classes.size()));
  for (const auto& c : belief.classes) {
    const auto it = std::find(classes.begin(), classes.end(), c.name);
    if (it != classes.end()) weights[it - classes.begin()] = belief.existence * c.probability;
  }
  return weights;
}

Eigen::MatrixXd logRatios(const Eigen::MatrixXd& counts, double smoothing) {
  const Eigen::VectorXd marginal = counts.rowwise().sum();
  const double all = counts.sum();
  Eigen::MatrixXd ratios(counts.rows(), counts.cols());
  for (Eigen::Index a = 0; a < counts.rows(); ++a) {
    for (Eigen::Index b = 0; b < counts.cols(); ++b) {
      const double chance = marginal[a] * marginal[b] / all;
      ratios(a, b) = std::log((counts(a, b) + smoothing) / (chance + smoothing));
    }
  }
  return ratios;
}

}  // namespace

LearntContext learnContext(std::vector<PlacedBelief> beliefs, const LearnOptions& options) {
  std::erase_if(beliefs, [](const PlacedBelief& placed) {
    return placed.belief.classes.empty() || placed.belief.moving > 0.5;
  });
  for (auto& placed : beliefs) semantic_filter::removeContext(placed.belief);
  sortForSweep(beliefs);
  LearntContext learnt;
  learnt.objects = beliefs.size();
  const auto classes = classesOf(beliefs);
  std::vector<Eigen::VectorXd> weights;
  for (const auto& placed : beliefs) weights.push_back(weightsOf(placed.belief, classes));
  const auto n = static_cast<Eigen::Index>(classes.size());
  Eigen::MatrixXd counts = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < beliefs.size(); ++i) {
    const Eigen::Vector3d p = beliefs[i].belief.best().mean.head<3>();
    for (std::size_t j = i + 1; j < beliefs.size() && beliefs[j].world == beliefs[i].world; ++j) {
      const Eigen::Vector3d d = beliefs[j].belief.best().mean.head<3>() - p;
      if (d.x() > options.radius_m) break;
      if (d.norm() > options.radius_m) continue;
      ++learnt.pairs;
      counts += weights[i] * weights[j].transpose() + weights[j] * weights[i].transpose();
    }
  }
  if (counts.sum() <= 0.0) return learnt;
  learnt.matrix = {options.radius_m, classes, logRatios(counts, options.smoothing)};
  return learnt;
}

}  // namespace perdure::tools
