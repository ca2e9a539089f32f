#include "services/vio/core/update/point_updates.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>

#include "common/base/check.h"
#include "services/vio/core/update/triangulation.h"
#include "services/vio/core/update/visual.h"

namespace perdure::vio {
namespace {

constexpr int kFailuresToLeave = 3;
constexpr int kFewestJumped = 8;
constexpr double kFarOff = 25.0;  ///< limit of a row's mean square, in pixel variances

/// Measurement of one point in the newest clone, with the columns [cameras, clone, point].
struct PointRows {
  static constexpr int kRows = 2 * kMaxCameras, kColumns = (7 + kLensSize) * kMaxCameras + 9;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kRows, kColumns> H;
  Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kRows, 1> r;
  std::array<Block, kMaxCameras + 2> block;
  std::size_t blocks = 0;

  Measurement measurement() const { return {H, std::span(block.data(), blocks), r}; }
};

Result<PointRows> rowsOf(const State& state, const PointState& point, const Observation& seen,
                         double sigma_px) {
  const Clone& clone = state.clones.back();
  const auto cameras = static_cast<Eigen::Index>(state.T_BC.size());
  const auto views = std::count_if(seen.seen.begin(), seen.seen.begin() + cameras,
                                   [](const auto& s) { return s.has_value(); });
  PointRows rows;
  const Eigen::Index pose = state.camerasSize();
  rows.H.setZero(2 * views, pose + 9);
  rows.r.resize(2 * views);
  for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
    rows.block[rows.blocks++] = state.camera(c);
  }
  rows.block[rows.blocks++] = {clone.at, 6};
  rows.block[rows.blocks++] = {point.at, 3};
  Eigen::Index row = 0;
  for (std::size_t c = 0; c < state.T_BC.size(); ++c) {
    if (!seen.seen[c]) continue;
    const auto view = viewOf(state, clone, c, *seen.seen[c], point.p_W, point.linear, sigma_px);
    if (!view) return fail("slam_behind_camera");
    const Block camera = rows.block[c];
    putCamera(state, c, *view, rows.H.block(row, camera.at - kNavSize, 2, camera.size));
    rows.H.block<2, 6>(row, pose) = view->J.pose;
    rows.H.block<2, 3>(row, pose + 6) = view->J.point;
    rows.r.segment<2>(row) = view->r;
    row += 2;
  }
  return rows;
}

struct Seen {
  std::size_t point;  ///< index in state.points
  const ImagePoint* pixel;
  PointRows rows;
  bool passes = false;

  void judge(const State& state, double probability) {
    const auto of_views = [&] { return state.project(rows.H, rows.measurement().blocks); };
    passes = passesGateWith(rows.r, of_views, probability);
  }
  /// Returns true if the point fails the gate, and its residual is so large that pixel noise alone
  /// cannot explain it.
  bool isFarOff() const {
    return !passes && rows.r.squaredNorm() > kFarOff * static_cast<double>(rows.r.size());
  }
};

/// Returns the state's points that the newest clone sees. Adds the ids of points behind a camera to
/// `leaving`.
std::vector<Seen> seenPoints(const State& state, const FeatureDatabase& database,
                             const VisionOptions& options, ReasonCounts& reasons,
                             std::vector<std::uint64_t>& leaving) {
  std::vector<Seen> seen;
  seen.reserve(state.points.size());
  for (std::size_t i = 0; i < state.points.size(); ++i) {
    const Track* track = database.find(state.points[i].id);
    if (!track || !track->seenAt(state.clones.back().frame)) continue;
    const Observation& newest = track->observations.back();
    auto rows = rowsOf(state, state.points[i], newest, options.sigma_px);
    if (!rows) {
      reasons.add(rows.error());
      leaving.push_back(state.points[i].id);
      continue;
    }
    seen.push_back({i, &*newest.seen[0], std::move(*rows)});
    seen.back().judge(state, options.gate_probability);
  }
  return seen;
}

/// Returns true if nearly all points fail the gate at once and most are far off, which a single
/// moving object cannot cause. Points near the axis of a turn are not far off.
bool haveJumped(const std::vector<Seen>& seen) {
  const auto all = static_cast<std::ptrdiff_t>(seen.size());
  const auto failed =
      std::count_if(seen.begin(), seen.end(), [](const Seen& s) { return !s.passes; });
  const auto far =
      std::count_if(seen.begin(), seen.end(), [](const Seen& s) { return s.isFarOff(); });
  return far >= kFewestJumped && 4 * failed > 3 * all && 2 * far > all;
}

/// Returns the innovation of a point. Its first two rows belong to the first camera, which sees
/// every tracked point.
Innovation innovationOf(const State& state, const PointRows& rows, const ImagePoint& seen,
                        double sigma_px, bool used) {
  const Measurement m = rows.measurement();
  Eigen::MatrixXd S = state.project(m.H, m.blocks);
  S.diagonal().array() += 1.0;
  const Eigen::VectorXd r = m.r;
  return {seen.pixel, sigma_px * r.head<2>(), r.dot(S.llt().solve(r)), static_cast<int>(r.size()),
          used};
}

/// Returns the rows of a track that depend on the state alone. A point without parallax gets the
/// scene's depth, and `supposed` becomes true, unless the state determines the depth
/// (tools/docs/maths/vio-visual-update.md).
Result<PointSystem> rowsOfTrack(const Track& track, const State& state, const MatrixView& P,
                                const VisionOptions& options, bool& supposed) {
  const std::vector<Ray> rays = raysOf(track, state, options.sigma_px);
  auto point = triangulate(rays, options);
  if (!point && point.error().code == "triangulation_parallel") {
    const double scene = options.sceneInverse();
    const Eigen::Vector3d p_W = rays.back().T_WC * (rays.back().normalised.homogeneous() / scene);
    PointSystem s = stackViews(track, state, p_W, options.sigma_px);
    if (s.r.size() < 4) return PointSystem{};
    separatePoint(s);
    const InverseDepth depth = inverseDepth(track, state, p_W);
    if (!(depthSigma(s, depth, P) < options.max_relative_sigma * scene)) {
      supposed = true;
      addScene(s, depth, options);
      separatePoint(s);
      dropPoint(s);
      return s;
    }
    point = triangulate(rays, options, scene);
  }
  if (!point) return tl::unexpected(point.error());
  PointSystem s = stackViews(track, state, point->p_W, options.sigma_px);
  if (s.r.size() < 4) return PointSystem{};
  separatePoint(s);
  dropPoint(s);
  return s;
}

}  // namespace

Result<UpdateCounts> updateMsckf(State& state, const std::vector<const Track*>& tracks,
                                 const VisionOptions& options, ReasonCounts& reasons) {
  UpdateCounts counts;
  const std::vector<Block> blocks = calibrationAndClones(state);
  const Eigen::MatrixXd P = state.covarianceOf(blocks);
  std::vector<PointSystem> systems;
  Eigen::Index rows = 0;
  systems.reserve(tracks.size());
  for (const Track* const track : tracks) {
    bool supposed = false;
    auto rows_of = rowsOfTrack(*track, state, P, options, supposed);
    if (!rows_of) {
      if (rows_of.error().code == "triangulation_depth") ++counts.behind;
      reasons.add(rows_of.error());
      continue;
    }
    PointSystem& s = *rows_of;
    if (s.r.size() == 0) continue;
    const auto of_views = [&] { return s.H_x * P * s.H_x.transpose(); };
    if (!passesGateWith(s.r, of_views, options.gate_probability)) {
      ++counts.gated;
      reasons.add("msckf_gated");
      continue;
    }
    ++counts.used;
    counts.supposed += supposed;
    rows += s.r.size();
    systems.push_back(std::move(s));
  }
  if (rows == 0) return counts;
  Eigen::MatrixXd H(rows, P.cols());
  Eigen::VectorXd r(rows);
  Eigen::Index row = 0;
  for (const PointSystem& s : systems) {
    H.middleRows(row, s.r.size()) = s.H_x;
    r.segment(row, s.r.size()) = s.r;
    row += s.r.size();
  }
  compress(H, r);
  if (const auto done = state.update(H, blocks, r); !done) return tl::unexpected(done.error());
  return counts;
}

Result<UpdateCounts> updateSlam(State& state, const FeatureDatabase& database,
                                const VisionOptions& options, bool may_jump, ReasonCounts& reasons,
                                std::vector<Innovation>* innovations) {
  check(!state.clones.empty(), "the newest pose is cloned");
  UpdateCounts counts;
  std::vector<std::uint64_t> leaving;
  std::vector<Seen> seen = seenPoints(state, database, options, reasons, leaving);
  counts.gated = static_cast<int>(leaving.size());
  if (may_jump && haveJumped(seen)) {
    reasons.add("images_jumped");
    counts.jumped = true;
    state.widenPose(options.jump_rotation, options.jump_position_m);
    // A rotation on the body that is not estimated stays exact.
    const int mount = state.camera(0).at;
    if (state.P()(mount, mount) > 0.0) state.widenMount(options.jump_rotation, 0.0);
    for (Seen& s : seen) s.judge(state, options.gate_probability);
  }
  std::vector<Measurement> used;
  used.reserve(seen.size());
  for (const Seen& s : seen) {
    if (innovations) {
      innovations->push_back(innovationOf(state, s.rows, *s.pixel, options.sigma_px, s.passes));
    }
    PointState& point = state.points[s.point];
    if (s.passes) {
      point.failed_gates = 0;
      used.push_back(s.rows.measurement());
      ++counts.used;
      continue;
    }
    ++counts.gated;
    reasons.add("slam_gated");
    if (++point.failed_gates >= kFailuresToLeave) leaving.push_back(point.id);
  }
  if (!used.empty()) {
    if (const auto done = state.update(used); !done) return tl::unexpected(done.error());
  }
  for (const std::uint64_t id : leaving) state.removePoint(id);
  return counts;
}

Result<void> initialisePoint(State& state, const Track& track, const VisionOptions& options) {
  const auto point = triangulate(raysOf(track, state, options.sigma_px), options);
  if (!point) {
    const bool parallel = point.error().code == "triangulation_parallel";
    return parallel ? fail("slam_depth_unknown") : tl::unexpected(point.error());
  }
  PointSystem s = stackViews(track, state, point->p_W, options.sigma_px);
  if (s.r.size() < 4) return fail("slam_few_views");
  const std::vector<Block> blocks = calibrationAndClones(state);
  separatePoint(s);
  const InverseDepth depth = inverseDepth(track, state, point->p_W);
  const double sigma = depthSigma(s, depth, state.covarianceOf(blocks));
  if (!(sigma < options.max_relative_sigma * depth.value)) return fail("slam_depth_unknown");
  const Eigen::Matrix3d R_f = s.H_f.topRows<3>();
  if (!(R_f.diagonal().cwiseAbs().minCoeff() > 1e-9)) return fail("slam_unobserved");
  const Eigen::MatrixXd H_1 = s.H_x.topRows<3>();
  const Eigen::Vector3d r_1 = s.r.head<3>();
  dropPoint(s);
  const auto of_views = [&] { return state.project(s.H_x, blocks); };
  if (!passesGateWith(s.r, of_views, options.gate_probability)) return fail("slam_gated");

  // Mean, covariance and cross-covariance of the new point follow from δf = R_f⁻¹ (r₁ − H₁ δx −
  // n₁).
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
  state.points.back().linear = linearisationPoint(state, track, point->p_W);
  compress(s.H_x, s.r);
  return state.update(s.H_x, blocks, s.r);
}

}  // namespace perdure::vio
