#include "common/mapping/graph/pose_graph.h"

#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "common/mapping/graph/components.h"
#include "common/mapping/graph/edge_cost.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

using States = std::map<AnchorId, Eigen::Vector4d>;

constexpr double kNoWay = std::numeric_limits<double>::infinity();
/// Factor from one kernel to the next narrower one.
constexpr double kNarrowing = 0.1;
/// Relative change of cost below which the kernel is narrowed.
constexpr double kCoarse = 0.01;
constexpr int kCoarseIterations = 4;

States statesOf(const std::map<AnchorId, LevelPose>& poses) {
  States states;
  for (const auto& [id, pose] : poses) states.emplace_hint(states.end(), id, stateOf(pose));
  return states;
}

double chi2Of(const Edge& edge, const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  const double* parameters[] = {a.data(), b.data()};
  Eigen::Vector4d residual;
  EdgeCost(edge.T_ab).Evaluate(parameters, residual.data(), nullptr);
  return residual.squaredNorm();
}

ceres::Problem::Options borrowing() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

ceres::Solver::Options quietSolver(std::int64_t iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = static_cast<int>(iterations);
  options.num_threads = 1;
  // Long chains need large steps, which any damping proportional to the diagonal would prevent.
  options.initial_trust_region_radius = 1e16;
  options.logging_type = ceres::SILENT;
  return options;
}

/// The graph as a least-squares problem. Edges that were not optimised before have a separate
/// kernel.
class LeastSquares {
 public:
  LeastSquares(const PoseGraph& graph, const GraphParameters& parameters)
      : kernel_(parameters.kernel),
        loss_(kernel_),
        new_loss_(kernel_),
        options_(quietSolver(parameters.iterations)),
        states_(statesOf(graph.poses())),
        problem_(borrowing()) {
    for (const auto& [id, edge] : graph.edges()) add(edge, graph.isNew(id));
    for (auto& [id, state] : states_) {
      if (graph.isHeldFast(id) && problem_.HasParameterBlock(state.data())) {
        problem_.SetParameterBlockConstant(state.data());
      }
    }
  }

  /// Returns the final cost. Returns infinity, with unchanged states, if the solver finds no usable
  /// solution.
  double descend() { return descend(options_); }

  /// Minimises from the present states. The kernel for new edges starts as wide as their largest
  /// χ², and is then narrowed. Returns the final cost, or infinity as soon as it is certain to
  /// exceed `known`.
  double descendByWideKernels(double known) {
    ceres::Solver::Options coarse = options_;
    coarse.function_tolerance = kCoarse;
    double kernel = kernel_;
    for (const Edge& edge : new_edges_) kernel = std::max(kernel, chi2(edge));
    for (bool widest = true; kernel > kernel_; kernel *= kNarrowing, widest = false) {
      new_loss_ = ScalingLoss(kernel);
      const double cost = descend(coarse);
      // The widest kernel does not reduce the χ² of a single new edge. Any solution that accepts
      // this edge costs at least `least`.
      const double least = (converged_ ? 1.0 - kCoarse : 0.5) * cost;
      if (widest && new_edges_.size() == 1 && least > known) return kNoWay;
      coarse.max_num_iterations = std::min(coarse.max_num_iterations, kCoarseIterations);
    }
    new_loss_ = ScalingLoss(kernel_);
    return descend();
  }

  bool believesNewEdges() const {
    return std::all_of(new_edges_.begin(), new_edges_.end(),
                       [&](const Edge& edge) { return loss_.weight(chi2(edge)) >= kBelieved; });
  }

  const States& states() const { return states_; }
  /// Sets the starting point; `states` must have the same anchors.
  void setStates(const States& states) {
    for (auto& [id, state] : states_) state = states.at(id);
  }
  bool converged() const { return converged_; }
  int iterations() const { return iterations_; }

 private:
  double descend(const ceres::Solver::Options& options) {
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    converged_ = summary.termination_type == ceres::CONVERGENCE;
    iterations_ += static_cast<int>(summary.iterations.size()) - 1;
    return summary.IsSolutionUsable() ? 2.0 * summary.final_cost : kNoWay;
  }

  void add(const Edge& edge, bool is_new) {
    ScalingLoss* loss = edge.kind == EdgeKind::kOdometry ? nullptr : is_new ? &new_loss_ : &loss_;
    problem_.AddResidualBlock(new EdgeCost(edge.T_ab), loss, states_.at(edge.a).data(),
                              states_.at(edge.b).data());
    if (loss == &new_loss_) new_edges_.push_back(edge);
  }

  double chi2(const Edge& edge) const {
    return chi2Of(edge, states_.at(edge.a), states_.at(edge.b));
  }

  double kernel_;
  ScalingLoss loss_, new_loss_;
  ceres::Solver::Options options_;
  States states_;
  std::vector<Edge> new_edges_;
  ceres::Problem problem_;
  bool converged_ = false;
  int iterations_ = 0;
};

}  // namespace

void PoseGraph::addFirst(AnchorId id, const LevelPose& T_MA) {
  poses_[id] = T_MA;
  held_fast_.insert(id);
}

void PoseGraph::add(AnchorId id, AnchorId previous, const LevelGaussian& from_previous) {
  poses_[id] = poses_.at(previous) * from_previous.mean;
  add({previous, id, from_previous, EdgeKind::kOdometry});
}

EdgeId PoseGraph::add(const Edge& edge) {
  edges_[next_] = edge;
  return next_++;
}

void PoseGraph::restore(EdgeId id, const Edge& edge, double weight) {
  edges_[id] = edge;
  weights_[id] = weight;
  next_ = std::max(next_, id + 1);
}

void PoseGraph::remove(EdgeId id) {
  edges_.erase(id);
  weights_.erase(id);
}

void PoseGraph::scaleOdometry(const std::map<AnchorId, DriftVariance>& factors) {
  if (factors.empty()) return;
  for (auto& [id, edge] : edges_) {
    const auto factor = factors.find(edge.b);
    if (edge.kind != EdgeKind::kOdometry || factor == factors.end()) continue;
    edge.T_ab.covariance = factor->second.of(edge.T_ab.covariance);
  }
}

void PoseGraph::holdFirstAnchors() {
  held_fast_.clear();
  for (const auto& [id, first] : componentsOf(*this)) held_fast_.insert(first);
}

double PoseGraph::weight(EdgeId id) const {
  const auto at = weights_.find(id);
  return at == weights_.end() ? 1.0 : at->second;
}

bool PoseGraph::isNew(EdgeId id) const {
  return edges_.at(id).kind != EdgeKind::kOdometry && !weights_.contains(id);
}

double PoseGraph::chi2(const Edge& edge) const {
  return chi2Of(edge, stateOf(poses_.at(edge.a)), stateOf(poses_.at(edge.b)));
}

OptimiseReport PoseGraph::optimise() {
  OptimiseReport report;
  holdFirstAnchors();
  LeastSquares problem(*this, parameters_);
  const States start = problem.states();
  report.cost = problem.descend();
  report.converged = problem.converged();
  if (!problem.believesNewEdges()) {
    const States first = problem.states();
    problem.setStates(start);
    const double cost = problem.descendByWideKernels(report.cost);
    if (cost < report.cost) {
      report.cost = cost;
      report.converged = problem.converged();
    } else {
      problem.setStates(first);
    }
  }
  report.iterations = problem.iterations();
  take(problem.states(), report);
  holdFirstAnchors();
  return report;
}

void PoseGraph::take(const std::map<AnchorId, Eigen::Vector4d>& states, OptimiseReport& report) {
  for (auto& [id, pose] : poses_) {
    const Eigen::Vector4d& state = states.at(id);
    report.largest_move_m = std::max(report.largest_move_m, (state.head<3>() - pose.p).norm());
    pose = {state.head<3>(), wrapAngle(state[3])};
  }
  const ScalingLoss loss(parameters_.kernel);
  for (const auto& [id, edge] : edges_) {
    if (edge.kind == EdgeKind::kOdometry) continue;
    report.chi2[id] = chi2(edge);
    report.weights[id] = weights_[id] = loss.weight(report.chi2[id]);
  }
}

}  // namespace perdure::mapping
