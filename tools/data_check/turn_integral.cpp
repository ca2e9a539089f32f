#include "tools/data_check/turn_integral.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

constexpr double kHole_s = 0.35;  // OXTS has 0.2 s if one sample is missing

Eigen::Matrix3Xd withoutMean(const std::vector<Eigen::Vector3d>& turns) {
  Eigen::Matrix3Xd columns(3, static_cast<Eigen::Index>(turns.size()));
  for (std::size_t i = 0; i < turns.size(); ++i) {
    columns.col(static_cast<Eigen::Index>(i)) = turns[i];
  }
  if (!turns.empty()) columns.colwise() -= columns.rowwise().mean().eval();
  return columns;
}

double rms(const Eigen::Matrix3Xd& turns) {
  return std::sqrt(turns.squaredNorm() / std::max<double>(1.0, static_cast<double>(turns.cols())));
}

}  // namespace

TurnIntegral::TurnIntegral(const std::vector<ImuSample>& samples) : samples_(samples) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  int holes = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i > 0) {
      const double dt = toSeconds(samples[i].time - samples[i - 1].time);
      q = (q * expQuaternion(0.5 * dt * (samples[i].gyro + samples[i - 1].gyro))).normalized();
      if (dt > kHole_s) ++holes;
    }
    turned_.push_back(q);
    holes_.push_back(holes);
  }
}

std::size_t TurnIntegral::after(TimePoint time) const {
  const auto next =
      std::upper_bound(samples_.begin(), samples_.end(), time,
                       [](TimePoint t, const ImuSample& sample) { return t < sample.time; });
  const auto i = static_cast<std::size_t>(next - samples_.begin());
  return std::clamp<std::size_t>(i, 1, samples_.size() - 1);
}

bool TurnIntegral::covers(TimePoint from, TimePoint to) const {
  if (samples_.size() < 2 || from < samples_.front().time || to > samples_.back().time) {
    return false;
  }
  return holes_[after(from) - 1] == holes_[after(to)];
}

Eigen::Quaterniond TurnIntegral::at(TimePoint time) const {
  const std::size_t i = after(time);
  const Eigen::Vector3d rate = 0.5 * (samples_[i].gyro + samples_[i - 1].gyro);
  return turned_[i - 1] * expQuaternion(toSeconds(time - samples_[i - 1].time) * rate);
}

Eigen::Vector3d TurnIntegral::between(TimePoint from, TimePoint to) const {
  return logSo3(Eigen::Quaterniond(at(from).conjugate() * at(to)));
}

TurnPairs::TurnPairs(const std::vector<Eigen::Vector3d>& of_reference,
                     const std::vector<Eigen::Vector3d>& of_given)
    : reference(withoutMean(of_reference)), given(withoutMean(of_given)) {}

double TurnPairs::turning() const { return rms(reference); }

double TurnPairs::turningOfGiven() const { return rms(given); }

double TurnPairs::unexplained(const Eigen::Matrix3d& R) const {
  return (reference - R * given).squaredNorm() / std::max(1e-18, reference.squaredNorm());
}

double TurnPairs::disagreementBy(const Eigen::Matrix3d& R) const {
  return (reference - R * given).squaredNorm() /
         std::max(1e-18, reference.squaredNorm() + given.squaredNorm());
}

Eigen::Matrix3d TurnPairs::bestRotation() const {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(reference * given.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d S = Eigen::Matrix3d::Identity();
  S(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * S * svd.matrixV().transpose();
}

}  // namespace perdure::tools
