#include "services/vio/core/updater_slam.h"

#include <Eigen/Dense>

#include "common/base/check.h"
#include "services/vio/core/triangulation.h"
#include "services/vio/core/visual.h"

namespace perdure::vio {
namespace {

constexpr int kFailuresToLeave = 3;

/// The newest clone's views of one point: rows × [extrinsics, clone, point].
struct PointRows {
  Eigen::MatrixXd H;
  Eigen::VectorXd r;
  Block point;
};

Result<PointRows> rowsOf(const State& state, const PointState& point, const Observation& seen,
                         double sigma_px) {
  const Clone& clone = state.clones.back();
  const auto cameras = static_cast<Eigen::Index>(state.T_BC.size());
  PointRows rows{Eigen::MatrixXd::Zero(2 * cameras, 6 * cameras + 9),
                 Eigen::VectorXd(2 * cameras),
                 {point.at, 3}};
  Eigen::Index row = 0;
  for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
    if (!seen.seen[c]) continue;
    Eigen::Vector2d now, first;
    ProjectionJacobians J;
    if (!projectPoint(clone.T_WB, state.T_BC[c], point.p_W, now) ||
        !projectPoint(clone.first, state.T_BC[c], point.first, first, &J)) {
      return fail("slam_behind_camera");
    }
    const double weight = seen.seen[c]->scale / sigma_px;
    rows.H.block<2, 6>(row, 6 * static_cast<Eigen::Index>(c)) = weight * J.extrinsic;
    rows.H.block<2, 6>(row, 6 * cameras) = weight * J.pose;
    rows.H.block<2, 3>(row, 6 * cameras + 6) = weight * J.point;
    rows.r.segment<2>(row) = weight * (seen.seen[c]->normalised - now);
    row += 2;
  }
  rows.H.conservativeResize(row, Eigen::NoChange);
  rows.r.conservativeResize(row);
  return rows;
}

std::vector<Block> commonBlocks(const State& state) {
  std::vector<Block> blocks;
  for (int c = 0; c < static_cast<int>(state.T_BC.size()); ++c) {
    blocks.push_back({state.extrinsicsAt(c), 6});
  }
  blocks.push_back({state.clones.back().at, 6});
  return blocks;
}

bool gateOf(const State& state, const PointRows& rows, const VisionOptions& options) {
  std::vector<Block> blocks = commonBlocks(state);
  blocks.push_back(rows.point);
  Eigen::MatrixXd S = state.project(rows.H, blocks);
  S.diagonal().array() += 1.0;
  return passesGate(rows.r, S, options.gate_probability);
}

Result<void> updateWith(State& state, const std::vector<PointRows>& used) {
  std::vector<Block> blocks = commonBlocks(state);
  const Eigen::Index common = 6 * static_cast<Eigen::Index>(blocks.size());
  Eigen::Index m = 0;
  for (const PointRows& p : used) m += p.r.size();
  const Eigen::Index n = common + 3 * static_cast<Eigen::Index>(used.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(m, n);
  Eigen::VectorXd r(m);
  Eigen::Index row = 0, column = common;
  for (const PointRows& p : used) {
    H.block(row, 0, p.r.size(), common) = p.H.leftCols(common);
    H.block(row, column, p.r.size(), 3) = p.H.rightCols<3>();
    r.segment(row, p.r.size()) = p.r;
    blocks.push_back(p.point);
    row += p.r.size();
    column += 3;
  }
  return state.update(H, blocks, r);
}

}  // namespace

Result<UpdateCounts> updateSlam(State& state, const FeatureDatabase& database,
                                const VisionOptions& options, ReasonCounts& reasons) {
  check(!state.clones.empty(), "the newest pose is cloned");
  UpdateCounts counts;
  std::vector<PointRows> used;
  std::vector<std::uint64_t> leaving;
  for (PointState& point : state.points) {
    const Track* track = database.find(point.id);
    if (!track || !track->seenAt(state.clones.back().frame)) continue;
    const auto rows = rowsOf(state, point, track->observations.back(), options.sigma_px);
    if (rows && gateOf(state, *rows, options)) {
      point.failed_gates = 0;
      used.push_back(*rows);
      ++counts.used;
      continue;
    }
    ++counts.gated;
    reasons.add(rows ? "slam_gated" : rows.error().code);
    if (!rows || ++point.failed_gates >= kFailuresToLeave) leaving.push_back(point.id);
  }
  if (!used.empty()) {
    if (const auto done = updateWith(state, used); !done) return tl::unexpected(done.error());
  }
  for (const std::uint64_t id : leaving) state.removePoint(id);
  return counts;
}

Result<void> initialisePoint(State& state, const Track& track, const VisionOptions& options) {
  const auto point = triangulate(raysOf(track, state, options.sigma_px), options);
  if (!point) return tl::unexpected(point.error());
  PointSystem s = stackViews(track, state, point->p_W, point->p_W, options.sigma_px);
  if (s.r.size() < 4) return fail("slam_few_views");
  const std::vector<Block> blocks = calibrationAndClones(state);
  separatePoint(s);
  const Eigen::Matrix3d R_f = s.H_f.topRows<3>();
  if (!(R_f.diagonal().cwiseAbs().minCoeff() > 1e-9)) return fail("slam_unobserved");
  const Eigen::MatrixXd H_1 = s.H_x.topRows<3>();
  const Eigen::Vector3d r_1 = s.r.head<3>();
  dropPoint(s);
  Eigen::MatrixXd S = state.project(s.H_x, blocks);
  S.diagonal().array() += 1.0;
  if (!passesGate(s.r, S, options.gate_probability)) return fail("slam_gated");

  // δf = R_f⁻¹ (r₁ − H₁ δx − n₁): mean, covariance and cross-covariance of the new point.
  const Eigen::Matrix3d R_inverse = R_f.inverse();
  const Eigen::MatrixXd J = -R_inverse * H_1;
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(3, state.size());
  Eigen::Index column = 0;
  for (const Block& b : blocks) {
    cross.noalias() += J.middleCols(column, b.size) * state.P().middleRows(b.at, b.size);
    column += b.size;
  }
  const Eigen::Matrix3d covariance = state.project(J, blocks) + R_inverse * R_inverse.transpose();
  state.addPoint(track.id, point->p_W + R_inverse * r_1, covariance, cross);
  state.points.back().first = point->p_W;
  compress(s.H_x, s.r);
  return state.update(s.H_x, blocks, s.r);
}

}  // namespace perdure::vio
