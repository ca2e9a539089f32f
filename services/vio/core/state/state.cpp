#include "services/vio/core/state/state.h"

#include <cmath>

#include "common/base/check.h"
#include "common/math/so3.h"

namespace perdure::vio {
namespace {

/// Returns the size of the workspace, in numbers, for an update with m rows of a state of size n.
Eigen::Index roomOfUpdate(Eigen::Index n, Eigen::Index m) {
  return 2 * Workspace::need(n, m) + Workspace::need(m, m) + Workspace::need(m, 1) +
         Workspace::need(n, 1);
}

/// Returns the number of errors of a camera.
int cameraSize(double readout_s, const Estimated& estimated) {
  return 6 + (estimated.lens ? kLensSize : 0) + (estimated.readout && readout_s != 0.0 ? 1 : 0);
}

}  // namespace

int calibrationSize(const std::vector<double>& readout_s, const Estimated& estimated) {
  int size = kNavSize + 1 + (estimated.scale ? kScaleSize : 0);
  for (const double s : readout_s) size += cameraSize(s, estimated);
  return size;
}

Workspace::Matrix Workspace::take(Eigen::Index rows, Eigen::Index columns) {
  double* const at = memory_.data() + taken_;
  taken_ += need(rows, columns);
  check(taken_ <= memory_.size(), "a workspace is begun with room for all that is taken");
  return {at, rows, columns};
}

State::State(const std::vector<RigidTransform>& cameras, double offset, int max_clones,
             int max_points, const std::vector<double>& readouts, const Estimated& estimated)
    : T_BC(cameras),
      time_offset_s(offset),
      readout_s(readouts.empty() ? std::vector<double>(cameras.size(), 0.0) : readouts),
      lens(cameras.size(), LensError::Zero()),
      estimated_(estimated) {
  check(cameras.size() <= kMaxCameras && readout_s.size() == cameras.size(),
        "each of at most two cameras has a read-out, or none");
  cameras_[0] = kNavSize;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    rolls_[c] = readout_s[c] != 0.0;
    cameras_[c + 1] = cameras_[c] + cameraSize(readout_s[c], estimated);
  }
  size_ = calibrationEnd();
  const int capacity = size_ + 6 * (max_clones + 2) + 3 * max_points;
  P_ = Eigen::MatrixXd::Zero(capacity, capacity);
  // Reserves room for the larger of two updates: all points, or compressed rows of calibration and
  // clones.
  const int count = static_cast<int>(cameras.size());
  workspace_.begin(roomOfUpdate(
      capacity, std::max(2 * count * max_points, camerasSize() + 6 * (max_clones + 2))));
  clones.reserve(static_cast<std::size_t>(max_clones + 2));
  points.reserve(static_cast<std::size_t>(max_points));
}

const Clone* State::clone(std::uint64_t frame) const {
  for (const Clone& c : clones) {
    if (c.frame == frame) return &c;
  }
  return nullptr;
}

const PointState* State::point(std::uint64_t id) const {
  for (const PointState& p : points) {
    if (p.id == id) return &p;
  }
  return nullptr;
}

int State::append(int size) {
  check(size_ + size <= P_.rows(), "the state's capacity suffices");
  const int at = size_;
  size_ += size;
  return at;
}

void State::remove(int at, int size) {
  // Moves the columns in order and without a copy. No value overwrites one that is still to be
  // moved.
  const int tail = size_ - at - size;
  for (int column = 0; column < size_; ++column) {
    if (column >= at && column < at + size) continue;
    const double* const from = P_.col(column).data();
    double* const to = P_.col(column < at ? column : column - size).data();
    if (to != from) std::copy(from, from + at, to);
    std::copy(from + at + size, from + at + size + tail, to + at);
  }
  size_ -= size;
  for (Clone& c : clones) {
    if (c.at > at) c.at -= size;
  }
  for (PointState& p : points) {
    if (p.at > at) p.at -= size;
  }
}

void State::addClone(std::uint64_t frame, TimePoint image_time, const Eigen::Vector3d& rate_B,
                     bool first_estimates, SharedCameras cameras) {
  const int n = size_, at = append(6), offset = timeOffsetAt();
  const Nav& there = first_estimates ? nav_linear : nav;
  Eigen::Matrix<double, 6, 1> J_offset;
  J_offset << rate_B, there.v_WB;
  for (int j = 0; j < n; ++j) {
    P_.block<6, 1>(at, j) = P_.block<6, 1>(0, j) + J_offset * P_(offset, j);
  }
  P_.block(0, at, n, 6) = P_.block(at, 0, 6, n).transpose();
  P_.block<6, 6>(at, at) =
      P_.block<6, 6>(at, 0) + P_.block<6, 1>(at, offset) * J_offset.transpose();
  clones.push_back({frame, image_time, nav.T_WB(), there.T_WB(), at, {}, std::move(cameras), {}});
  std::copy(lens.begin(), lens.end(), clones.back().lens.begin());
}

void State::widenMount(double rotation, double position_m) {
  Matrix6d Q = Matrix6d::Zero();
  Q.diagonal() << Eigen::Vector3d::Constant(rotation * rotation),
      Eigen::Vector3d::Constant(position_m * position_m);
  const int a = camera(0).at;
  P_.block<6, 6>(a, a) += Q;
  if (T_BC.size() < 2) return;
  const int b = camera(1).at;
  const RigidTransform T_01 = T_BC[0].inverse() * T_BC[1];
  Matrix6d J = Matrix6d::Zero();  // T_BC1 = T_BC0 · T_01
  J.topLeftCorner<3, 3>() = T_01.R().transpose();
  J.bottomLeftCorner<3, 3>() = -T_BC[0].R() * skew(T_01.p);
  J.bottomRightCorner<3, 3>().setIdentity();
  P_.block<6, 6>(b, a) += J * Q;
  P_.block<6, 6>(a, b) += (J * Q).transpose();
  P_.block<6, 6>(b, b) += J * Q * J.transpose();
}

void State::widenPose(double rotation, double position_m) {
  Eigen::Matrix<double, 6, 1> variance;
  variance << Eigen::Vector3d::Constant(rotation * rotation),
      Eigen::Vector3d::Constant(position_m * position_m);
  const int at = clones.back().at;
  for (int i = 0; i < 6; ++i) {
    P_(i, i) += variance[i];
    P_(at + i, at + i) += variance[i];
    P_(i, at + i) += variance[i];
    P_(at + i, i) += variance[i];
  }
}

void State::widenPositions(double sigma_m) {
  std::vector<int> at{kPosition};
  for (const Clone& c : clones) at.push_back(c.at + 3);
  for (const PointState& p : points) at.push_back(p.at);
  for (const int a : at) {
    for (const int b : at) P_.block<3, 3>(a, b).diagonal().array() += sigma_m * sigma_m;
  }
}

void State::removeClone(std::uint64_t frame) {
  const Clone* const gone = clone(frame);
  if (!gone) return;
  const int at = gone->at;
  clones.erase(clones.begin() + (gone - clones.data()));
  remove(at, 6);
}

void State::addPoint(std::uint64_t id, const Eigen::Vector3d& p_W,
                     const Eigen::Matrix3d& covariance, const Eigen::MatrixXd& cross) {
  const int n = size_, at = append(3);
  P_.block(at, 0, 3, n) = cross;
  P_.block(0, at, n, 3) = cross.transpose();
  P_.block(at, at, 3, 3) = covariance;
  points.push_back({id, p_W, p_W, at, 0});
}

void State::removePoint(std::uint64_t id) {
  const PointState* const gone = point(id);
  if (!gone) return;
  const int at = gone->at;
  points.erase(points.begin() + (gone - points.data()));
  remove(at, 3);
}

void State::apply(const VectorView& dx) {
  nav.q_WB = (nav.q_WB * expQuaternion(dx.segment<3>(kTheta))).normalized();
  nav.p_WB += dx.segment<3>(kPosition);
  nav.v_WB += dx.segment<3>(kVelocity);
  nav.gyro_bias += dx.segment<3>(kGyroBias);
  nav.accel_bias += dx.segment<3>(kAccelBias);
  for (std::size_t c = 0; c < T_BC.size(); ++c) {
    T_BC[c] = boxPlus(T_BC[c], dx.segment<6>(camera(c).at));
    if (const auto at = lensAt(c)) lens[c] += dx.segment<kLensSize>(*at);
    if (const auto at = readoutAt(c)) readout_s[c] += dx[*at];
  }
  time_offset_s += dx[timeOffsetAt()];
  if (const auto at = scaleAt()) gyro_scale += dx.segment<kScaleSize>(*at);
  for (Clone& c : clones) c.T_WB = boxPlus(c.T_WB, dx.segment<6>(c.at));
  for (PointState& p : points) p.p_W += dx.segment<3>(p.at);
}

Eigen::MatrixXd State::covarianceOf(std::span<const Block> blocks) const {
  int n = 0;
  for (const Block& b : blocks) n += b.size;
  Eigen::MatrixXd result(n, n);
  int row = 0;
  for (const Block& a : blocks) {
    int column = 0;
    for (const Block& b : blocks) {
      result.block(row, column, a.size, b.size) = P_.block(a.at, b.at, a.size, b.size);
      column += b.size;
    }
    row += a.size;
  }
  return result;
}

Eigen::MatrixXd State::project(const MatrixView& H, std::span<const Block> blocks) const {
  return H * covarianceOf(blocks) * H.transpose();
}

Result<void> State::update(const Eigen::MatrixXd& H, const std::vector<Block>& blocks,
                           const Eigen::VectorXd& r) {
  const Measurement one{H, blocks, r};
  return update(std::span(&one, 1));
}

Result<void> State::update(std::span<const Measurement> measurements) {
  Eigen::Index m = 0;
  for (const Measurement& z : measurements) m += z.r.size();
  const Eigen::Index n = size_;
  workspace_.begin(roomOfUpdate(n, m));
  auto PHt = workspace_.take(n, m), Wt = workspace_.take(m, n), S = workspace_.take(m, m);
  auto r = workspace_.take(m, 1), dx = workspace_.take(n, 1);
  PHt.setZero();
  Eigen::Index row = 0;
  for (const Measurement& z : measurements) {
    const Eigen::Index rows = z.r.size();
    r.middleRows(row, rows) = z.r;
    Eigen::Index column = 0;
    for (const Block& b : z.blocks) {
      PHt.middleCols(row, rows).noalias() +=
          P_.block(0, b.at, n, b.size) * z.H.middleCols(column, b.size).transpose();
      column += b.size;
    }
    row += rows;
  }
  S.setIdentity();  // only the lower triangle is used
  row = 0;
  for (const Measurement& z : measurements) {
    const Eigen::Index rows = z.r.size();
    Eigen::Index column = 0;
    for (const Block& b : z.blocks) {
      S.block(row, 0, rows, row + rows).noalias() +=
          z.H.middleCols(column, b.size) * PHt.block(b.at, 0, b.size, row + rows);
      column += b.size;
    }
    row += rows;
  }
  if (!choleskyInPlace(S)) return fail("update_not_positive");
  // K S Kᵀ = W Wᵀ with W = P Hᵀ L⁻ᵀ; dx = W L⁻¹ r.
  Wt = PHt.transpose();
  whitenInPlace(S, Wt);
  whitenInPlace(S, r);
  dx.noalias() = Wt.transpose() * r;
  if (!dx.allFinite()) return fail("update_not_finite");
  auto active = P_.topLeftCorner(size_, size_);
  active.selfadjointView<Eigen::Lower>().rankUpdate(Wt.transpose(), -1.0);
  active.triangularView<Eigen::StrictlyUpper>() = active.transpose();
  apply(dx.col(0));
  return {};
}

bool State::healthy() const {
  if (!nav.T_WB().finite() || !nav.v_WB.allFinite() || !nav.gyro_bias.allFinite() ||
      !nav.accel_bias.allFinite() || !std::isfinite(time_offset_s) || !gyro_scale.allFinite()) {
    return false;
  }
  for (std::size_t c = 0; c < T_BC.size(); ++c) {
    if (!std::isfinite(readout_s[c]) || !lens[c].allFinite()) return false;
  }
  const auto active = P_.topLeftCorner(size_, size_);
  return active.allFinite() && active.diagonal().minCoeff() >= 0.0;
}

}  // namespace perdure::vio
