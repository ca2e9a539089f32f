#include "services/vio/core/update/visual.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "common/math/chi2.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::vio {
namespace {

/// Returns the χ² quantile. Quantiles are cached, because a frame needs hundreds of them.
double gate(int dof, double probability) {
  constexpr int kTable = 128;
  thread_local std::array<double, kTable> table{};
  thread_local double table_probability = -1.0;
  if (table_probability != probability) {
    table.fill(0.0);
    table_probability = probability;
  }
  if (dof >= kTable) return chi2Quantile(probability, dof);
  double& entry = table[static_cast<std::size_t>(dof)];
  if (entry == 0.0) entry = chi2Quantile(probability, dof);
  return entry;
}

/// Chain rule for a quantity with the derivative J_C by p_C, a point in the camera's frame.
template <class Row>
struct Chain {
  Chain(const Row& J_C, const RigidTransform& T_WB, const RigidTransform& T_BC,
        const Eigen::Vector3d& p_W) {
    const Eigen::Matrix3d R_BW = T_WB.R().transpose(), R_CB = T_BC.R().transpose();
    const Eigen::Vector3d p_B = R_BW * (p_W - T_WB.p), p_C = R_CB * (p_B - T_BC.p);
    const Row J_B = J_C * R_CB;
    point = J_B * R_BW;
    pose << J_B * skew(p_B), -point;
    extrinsic << J_C * skew(p_C), -J_B;
  }
  Row point;
  Eigen::Matrix<double, Row::RowsAtCompileTime, 6> pose, extrinsic;
};

}  // namespace

bool projectPoint(const RigidTransform& T_WB, const RigidTransform& T_BC,
                  const Eigen::Vector3d& p_W, Eigen::Vector2d& normalised, ProjectionJacobians* J) {
  const Eigen::Vector3d p_C = T_BC.inverse() * (T_WB.inverse() * p_W);
  if (!(p_C.z() > 1e-3)) return false;
  normalised = p_C.hnormalized();
  if (!J) return true;
  Eigen::Matrix<double, 2, 3> J_C;
  J_C << 1, 0, -normalised.x(), 0, 1, -normalised.y();
  const Chain chain(Eigen::Matrix<double, 2, 3>(J_C / p_C.z()), T_WB, T_BC, p_W);
  *J = {chain.pose, chain.extrinsic, chain.point};
  return true;
}

std::optional<View> viewOf(const State& state, const Clone& clone, std::size_t camera,
                           const ImagePoint& seen, const Eigen::Vector3d& p_W,
                           const Eigen::Vector3d& p_linear, double sigma_px) {
  RowCamera row;
  const bool rolls = state.rolls(camera);
  if (rolls) row = state.rowCamera(clone, camera, seen.row);
  const RigidTransform& T_BC = rolls ? row.T_BC : state.T_BC[camera];
  View view;
  Eigen::Vector2d now, there;
  if (!projectPoint(clone.T_WB, T_BC, p_W, now) ||
      !projectPoint(clone.linear, T_BC, p_linear, there, &view.J)) {
    return std::nullopt;
  }
  const Eigen::Matrix2d weight = seen.to_pixels / sigma_px;
  view.r = weight * (normalisedOf(state, clone, camera, seen) - now);
  // Evaluated at the prediction: at the observation, the derivative and the residual would share
  // their noise, and focal lengths would be too long.
  if (state.lensAt(camera)) view.lens = pixelByLens((*clone.cameras)[camera], there) / sigma_px;
  view.J.pose = (weight * view.J.pose).eval();
  view.J.extrinsic = (weight * view.J.extrinsic).eval();
  view.J.point = (weight * view.J.point).eval();
  if (!rolls) return view;
  view.readout = seen.row * (view.J.extrinsic.leftCols<3>() * row.theta_dot +
                             view.J.extrinsic.rightCols<3>() * row.p_dot);
  view.J.extrinsic.rightCols<3>() = (view.J.extrinsic.rightCols<3>() * row.R_BR).eval();
  return view;
}

void putCamera(const State& state, std::size_t camera, const View& view,
               Eigen::Ref<Eigen::MatrixXd> H) {
  H.leftCols<6>() = view.J.extrinsic;
  if (state.lensAt(camera)) H.middleCols<kLensSize>(6) = view.lens;
  if (state.readoutAt(camera)) H.rightCols<1>() = view.readout;
}

Eigen::Vector2d normalisedOf(const State& state, const Clone& clone, std::size_t camera,
                             const ImagePoint& seen) {
  if (!state.lensAt(camera)) return seen.normalised;
  const LensError since = state.lens[camera] - clone.lens[camera];
  const auto by_lens = pixelByLens((*clone.cameras)[camera], seen.normalised);
  return seen.normalised - seen.to_pixels.inverse() * (by_lens * since);
}

std::vector<Block> calibrationAndClones(const State& state) {
  std::vector<Block> blocks;
  blocks.reserve(state.T_BC.size() + state.clones.size());
  for (std::size_t c = 0; c < state.T_BC.size(); ++c) blocks.push_back(state.camera(c));
  for (const Clone& clone : state.clones) blocks.push_back({clone.at, 6});
  return blocks;
}

Eigen::Vector3d linearisationPoint(const State& state, const Track& track,
                                   const Eigen::Vector3d& p_W) {
  const Clone* clone = state.clone(track.observations.back().frame);
  if (!clone) clone = &state.clones.back();
  return clone->linear * (clone->T_WB.inverse() * p_W);
}

PointSystem stackViews(const Track& track, const State& state, const Eigen::Vector3d& p_W,
                       double sigma_px) {
  const Eigen::Index first_clone = state.camerasSize();
  const Eigen::Index columns = first_clone + 6 * static_cast<Eigen::Index>(state.clones.size());
  const Eigen::Index capacity = 2 * static_cast<Eigen::Index>(track.views());
  PointSystem s{Eigen::MatrixXd::Zero(capacity, columns), Eigen::MatrixXd(capacity, 3),
                Eigen::VectorXd(capacity)};
  Eigen::Index row = 0, k = 0;
  std::size_t o = 0;
  const Eigen::Vector3d p_linear = linearisationPoint(state, track, p_W);
  for (const Clone& clone : state.clones) {
    const Eigen::Index column = first_clone + 6 * k++;
    while (o < track.observations.size() && track.observations[o].frame < clone.frame) ++o;
    if (o == track.observations.size()) break;
    if (track.observations[o].frame != clone.frame) continue;
    for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
      const auto& seen = track.observations[o].seen[c];
      if (!seen) continue;
      const auto view = viewOf(state, clone, c, *seen, p_W, p_linear, sigma_px);
      if (!view) return {};
      s.r.segment<2>(row) = view->r;
      const Block block = state.camera(c);
      putCamera(state, c, *view, s.H_x.block(row, block.at - kNavSize, 2, block.size));
      s.H_x.block<2, 6>(row, column) = view->J.pose;
      s.H_f.middleRows<2>(row) = view->J.point;
      row += 2;
    }
  }
  s.r.conservativeResize(row);
  s.H_x.conservativeResize(row, Eigen::NoChange);
  s.H_f.conservativeResize(row, Eigen::NoChange);
  return s;
}

InverseDepth inverseDepth(const Track& track, const State& state, const Eigen::Vector3d& p_W) {
  const Eigen::Index first_clone = state.camerasSize();
  const auto clone = std::find_if(state.clones.begin(), state.clones.end(), [&](const Clone& c) {
    return c.frame == track.observations.back().frame;
  });
  check(clone != state.clones.end(), "the newest view is in the window");
  const RigidTransform& T_BC = state.T_BC[0];
  const auto depth = [&](const RigidTransform& T_WB, const Eigen::Vector3d& p) {
    return (T_BC.inverse() * (T_WB.inverse() * p)).z();
  };
  InverseDepth result{1.0 / depth(clone->T_WB, p_W), {}, {}};
  const Eigen::Vector3d p_linear = linearisationPoint(state, track, p_W);
  const double z = depth(clone->linear, p_linear);
  const Chain chain(Eigen::RowVector3d(0, 0, -1.0 / (z * z)), clone->linear, T_BC, p_linear);
  result.x.setZero(first_clone + 6 * static_cast<Eigen::Index>(state.clones.size()));
  result.x.head<6>() = chain.extrinsic;
  result.x.segment<6>(first_clone + 6 * (clone - state.clones.begin())) = chain.pose;
  result.f = chain.point;
  return result;
}

double depthSigma(const PointSystem& s, const InverseDepth& depth, const MatrixView& P) {
  const Eigen::RowVector3d by_rows =
      s.H_f.topRows<3>().triangularView<Eigen::Upper>().transpose().solve(depth.f.transpose());
  const Eigen::RowVectorXd by_state = depth.x - by_rows * s.H_x.topRows<3>();
  return std::sqrt(by_rows.squaredNorm() + (by_state * P).dot(by_state));
}

void addScene(PointSystem& s, const InverseDepth& depth, const VisionOptions& options) {
  const Eigen::Index rows = s.r.size();
  const double scene = options.sceneInverse(), weight = 1.0 / (options.scene_scatter * scene);
  s.H_x.conservativeResize(rows + 1, Eigen::NoChange);
  s.H_f.conservativeResize(rows + 1, Eigen::NoChange);
  s.r.conservativeResize(rows + 1);
  s.H_x.row(rows) = weight * depth.x;
  s.H_f.row(rows) = weight * depth.f;
  s.r[rows] = weight * (scene - depth.value);
}

void separatePoint(PointSystem& s) {
  check(s.r.size() >= 3, "a point has at least three rows");
  Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(s.H_f);
  s.H_x.applyOnTheLeft(qr.householderQ().adjoint());
  s.r.applyOnTheLeft(qr.householderQ().adjoint());
  s.H_f.triangularView<Eigen::StrictlyLower>().setZero();
}

void dropPoint(PointSystem& s) {
  const Eigen::Index rows = s.r.size() - 3;
  s.H_x = s.H_x.bottomRows(rows).eval();
  s.r = s.r.tail(rows).eval();
}

bool passesGate(const VectorView& r, const MatrixView& S, double probability) {
  const Cholesky chol(S);
  return chol.positive() &&
         chol.whiten(r).squaredNorm() < gate(static_cast<int>(r.size()), probability);
}

bool passesGateWith(const VectorView& r, const std::function<Eigen::MatrixXd()>& P,
                    double probability) {
  if (r.squaredNorm() < gate(static_cast<int>(r.size()), probability)) return true;
  Eigen::MatrixXd S = P();
  S.diagonal().array() += 1.0;
  return passesGate(r, S, probability);
}

void compress(Eigen::MatrixXd& H, Eigen::VectorXd& r) {
  const Eigen::Index n = H.cols();
  if (H.rows() <= n) return;
  Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(H);
  r.applyOnTheLeft(qr.householderQ().adjoint());
  r.conservativeResize(n);
  H = Eigen::MatrixXd(H.topRows(n).triangularView<Eigen::Upper>());
}

}  // namespace perdure::vio
