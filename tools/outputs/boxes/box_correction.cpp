#include "tools/outputs/boxes/box_correction.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "common/base/algorithms/median.h"

namespace perdure::tools {
namespace {

/// Logarithms of the scales, and the shifts in widths of the image.
using Parameters = Eigen::Vector4d;
using Active = std::array<bool, 4>;

BoxChange changeBy(const Parameters& p, const CameraModel& camera) {
  BoxChange change;
  change.A = p.head<2>().array().exp().matrix().asDiagonal();
  change.b = camera.width() * p.tail<2>();
  return change;
}

/// Normal equations of the tracks.
struct Normal {
  Eigen::Matrix4d H = Eigen::Matrix4d::Zero(), of_gradients = H;
  Parameters g = Parameters::Zero();
};

/// Deviations of a track and their derivatives.
struct Linear {
  Eigen::VectorXd r;
  Eigen::Matrix<double, Eigen::Dynamic, 4> J;
};

class Estimator {
 public:
  Estimator(const std::vector<const BoxTrack*>& tracks, const FrameGlances& frames,
            const CameraModel& camera)
      : tracks_(tracks), frames_(frames), camera_(camera) {}

  /// Gauss-Newton on the active parameters. Returns false if they are not observable.
  bool descend(const Active& active) {
    constexpr int kRounds = 5;
    at_.setZero();
    for (int round = 0; round < kRounds; ++round) {
      const Normal normal = normalOf(active);
      const Eigen::Matrix4d inverse = normal.H.inverse();
      sigma_ = (inverse * normal.of_gradients * inverse).diagonal().cwiseSqrt();
      at_ -= inverse * normal.g;
      if (!at_.allFinite() || at_.cwiseAbs().maxCoeff() > 1.0) return false;
    }
    return true;
  }
  const Parameters& at() const { return at_; }
  const Parameters& sigma() const { return sigma_; }

 private:
  std::optional<Eigen::VectorXd> deviationsAt(const BoxTrack& track, const Parameters& p) const {
    const auto off = deviationsOf(track, changeBy(p, camera_), frames_, camera_);
    if (!off || residualOf(*off) == kWorstDeviation) return std::nullopt;
    return Eigen::VectorXd(off->reshaped());
  }

  std::optional<Linear> linear(const BoxTrack& track, const Active& active) const {
    constexpr double kStep = 1e-3;
    const auto r = deviationsAt(track, at_);
    if (!r) return std::nullopt;
    Linear out{*r, Eigen::Matrix<double, Eigen::Dynamic, 4>::Zero(r->size(), 4)};
    for (int i = 0; i < 4; ++i) {
      if (!active[static_cast<std::size_t>(i)]) continue;
      const auto other = deviationsAt(track, at_ + kStep * Parameters::Unit(i));
      if (!other) return std::nullopt;
      out.J.col(i) = (*other - *r) / kStep;
    }
    return out;
  }

  Normal normalOf(const Active& active) const {
    std::vector<Linear> all;
    std::vector<double> squares;
    for (const BoxTrack* track : tracks_) {
      auto one = linear(*track, active);
      if (!one) continue;
      squares.push_back(one->r.squaredNorm() / static_cast<double>(one->r.size()));
      all.push_back(*std::move(one));
    }
    const double usual = std::max(1e-8, medianOf(std::vector<double>(squares)));
    constexpr double kPrior = 0.5;  // standard deviation of the parameters
    Normal normal;
    normal.H.diagonal().setConstant(usual / (kPrior * kPrior));
    for (std::size_t i = 0; i < all.size(); ++i) {  // Geman and McClure
      const double weight = std::pow(1.0 + squares[i] / (4.0 * usual), -2.0);
      const Parameters g = weight * all[i].J.transpose() * all[i].r;
      normal.H += weight * all[i].J.transpose() * all[i].J;
      normal.g += g, normal.of_gradients += g * g.transpose();
    }
    normal.g += usual / (kPrior * kPrior) * at_;
    return normal;
  }

  const std::vector<const BoxTrack*>& tracks_;
  const FrameGlances& frames_;
  const CameraModel& camera_;
  Parameters at_ = Parameters::Zero(), sigma_ = Parameters::Zero();
};

}  // namespace

std::optional<BoxCorrection> correctionOf(const std::vector<const BoxTrack*>& tracks,
                                          const FrameGlances& frames, const CameraModel& camera) {
  constexpr double kSurely = 6.0;
  const Parameters least(0.03, 0.03, 0.02, 0.02);
  constexpr std::size_t kLeast = 15;
  if (tracks.size() < kLeast) return std::nullopt;
  Active active{true, true, true, true};
  Estimator estimator(tracks, frames, camera);
  for (int left = 4; left > 0; --left) {
    const bool ok = estimator.descend(active);
    if (!ok) return std::nullopt;
    const Parameters& p = estimator.at();
    int weakest = -1;
    double lowest = 1.0;
    for (int i = 0; i < 4; ++i) {
      if (!active[static_cast<std::size_t>(i)]) continue;
      const double over = std::abs(p[i]) / std::max(least[i], kSurely * estimator.sigma()[i]);
      if (over < lowest) lowest = over, weakest = i;
    }
    if (weakest < 0) {
      BoxCorrection out;
      const BoxChange change = changeBy(p, camera);
      out.scale = change.A.diagonal(), out.shift_px = change.b;
      out.scale_sigma = estimator.sigma().head<2>();
      out.shift_sigma_px = camera.width() * estimator.sigma().tail<2>();
      return out;
    }
    active[static_cast<std::size_t>(weakest)] = false;
  }
  return std::nullopt;
}

}  // namespace perdure::tools
