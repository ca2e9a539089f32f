#include "services/semantic_filter/core/belief/ground_surface.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/small_cholesky.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {

constexpr std::size_t kNearest = 12, kLeast = 3;
constexpr int kMostHeights = static_cast<int>(kNearest + BodyPath::kPlaces);
using PerHeight = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostHeights, 1>;
using HeightMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostHeights, kMostHeights>;
// m, standard deviation of the ground from the mean of the contributing heights
constexpr double kLevelSigma = 10.0;
constexpr double kBounce = 0.03;       // m, variation of the body's height as it moves
constexpr double kSurelyStands = 0.9;  // least ClassPrior::stands of a class that contributes

double GroundRoughness::ratio(double assumed) const {
  constexpr double kLeastRatio = 0.01, kMostRatio = 9.0;
  return std::clamp((assumed + squares_) / (assumed + things_), kLeastRatio, kMostRatio);
}

void GroundRoughness::learn(double above, const GroundHeight& others, double own_variance,
                            double ratio, double share) {
  constexpr double kMost = 9.0;
  const double rest = others.variance - others.uneven + own_variance;
  const double tells = others.uneven / (others.uneven + rest);
  const double weight = share * tells * tells;
  if (!(weight > 1e-6)) return;
  const double square = std::min(above * above, kMost * (others.uneven + rest));
  squares_ += weight * ratio * (square - rest) / others.uneven;
  things_ += weight;
}

void BodyPath::advance(const Eigen::Vector3d& body) {
  constexpr double kApart = 4.0;  // m
  if (!places_.empty() && (body - places_[places_.size() - 1]).norm() < kApart) return;
  if (places_.size() == kPlaces) {
    std::copy(places_.begin() + 1, places_.end(), places_.begin());
    places_.resize(kPlaces - 1);
  }
  places_.push_back(body);
}

GroundSurface::GroundSurface(const std::vector<Track>& tracks, const BodyPath& path,
                             const GroundRoughness& roughness_scale, const Eigen::Vector3d& up_W,
                             const ClassPriors& priors, const GroundParameters& parameters)
    : parameters_(parameters),
      ratio_(roughness_scale.ratio(parameters.prior_objects)),
      axes_(levelling(up_W).toRotationMatrix().topRows<2>()),
      up_(up_W.normalized()) {
  constexpr double kSure = 0.8, kHalf = 0.5;
  if (!parameters.use) return;
  if (parameters.body_height_m > 0.0) {
    for (const Eigen::Vector3d& p : path) {
      path_.push_back({0, horizontal(p), up_.dot(p) - parameters.body_height_m, kBounce * kBounce});
    }
  }
  stands_.reserve(tracks.size());
  for (const Track& o : tracks) {
    const Hypothesis& best = o.best();
    if (best.ground_contact.variance <= 0.0 || best.moving || best.weight < kHalf) continue;
    if (o.existence < kSure || priors.of(best.class_name).stands < kSurelyStands) continue;
    stands_.push_back({o.id, horizontal(best.x.head<3>()),
                       underside(best.x, up_) + best.ground_contact.above,
                       best.ground_contact.variance + parameters.sigma_m * parameters.sigma_m});
  }
}

void GroundSurface::updateRoughness(GroundRoughness& roughness_scale, const Track& track,
                                    double share) const {
  const Hypothesis& best = track.best();
  if (best.ground_contact.variance <= 0.0 || best.moving) return;
  const auto others = below(best.x.head<3>(), track.id);
  if (!others) return;
  const double own = best.ground_contact.variance + parameters_.sigma_m * parameters_.sigma_m;
  roughness_scale.learn(underside(best.x, up_) + best.ground_contact.above - others->mean, *others,
                        own, ratio_, std::min(share, 1.0));
}

ScratchVector<GroundSurface::Near> GroundSurface::around(const std::vector<Stand>& stands,
                                                         const Eigen::Vector2d& here,
                                                         ObjectId except, std::size_t most) const {
  ScratchVector<Near> nearest;
  for (const Stand& s : stands) {
    const double apart = (s.place - here).squaredNorm();
    const bool reaches = apart <= parameters_.reach_m * parameters_.reach_m;
    if (reaches && (s.id == 0 || s.id != except)) nearest.push_back({apart, &s});
  }
  std::sort(nearest.begin(), nearest.end(), [](const Near& a, const Near& b) {
    return a.apart < b.apart || (a.apart == b.apart && a.stand->id < b.stand->id);
  });
  if (nearest.size() > most) nearest.resize(most);
  return nearest;
}

std::optional<GroundHeight> GroundSurface::below(const Eigen::Vector3d& place,
                                                 ObjectId except) const {
  const Eigen::Vector2d here = horizontal(place);
  ScratchVector<Near> points = around(path_, here, except, BodyPath::kPlaces);
  const std::size_t on_path = points.size(), least = on_path > 0 ? 1 : kLeast;
  const ScratchVector<Near> things = around(stands_, here, except, kNearest);
  points.insert(points.end(), things.begin(), things.end());
  if (points.size() < least) return std::nullopt;
  double level = 0.0;
  for (const Near& near : points) level += near.stand->height / static_cast<double>(points.size());
  const double slope = ratio_ * std::pow(parameters_.slope, 2);
  const double rough = ratio_ * std::pow(parameters_.roughness, 2);
  const double body = std::pow(parameters_.body_height_sigma_m, 2);
  while (points.size() >= least) {
    const auto n = static_cast<Eigen::Index>(points.size()), m = static_cast<Eigen::Index>(on_path);
    HeightMatrix K(n, n);
    PerHeight z(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Stand& a = *points[static_cast<std::size_t>(i)].stand;
      const Eigen::Vector2d da = a.place - here;
      z[i] = a.height - level;
      for (Eigen::Index j = 0; j <= i; ++j) {
        const Eigen::Vector2d db = points[static_cast<std::size_t>(j)].stand->place - here;
        K(i, j) = K(j, i) = kLevelSigma * kLevelSigma + slope * da.dot(db) +
                            0.5 * rough * (da.norm() + db.norm() - (da - db).norm());
      }
      K(i, i) += a.variance;
    }
    K.topLeftCorner(m, m).array() += body;
    const Cholesky S(K);
    if (!S.positive()) return std::nullopt;
    const HeightMatrix J = S.solve(HeightMatrix::Identity(n, n));
    const PerHeight weighed = J * z;
    // Finds the object whose height differs most from the prediction by the others.
    Eigen::Index worst = 0;
    double most_off = 0.0;
    for (Eigen::Index i = m; i < n; ++i) {
      const double off = weighed[i] * weighed[i] / J(i, i);
      if (off > most_off) worst = i, most_off = off;
    }
    if (most_off > gates::kGroundOutlier) {
      points.erase(points.begin() + worst);
      continue;
    }
    const double prior = kLevelSigma * kLevelSigma;
    const PerHeight shares = prior * J.rowwise().sum();
    double noise = body * std::pow(shares.head(m).sum(), 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      noise += shares[i] * shares[i] * points[static_cast<std::size_t>(i)].stand->variance;
    }
    const double variance = std::max(prior * (1.0 - shares.sum()), noise);
    return GroundHeight{level + prior * weighed.sum(), variance, variance - noise};
  }
  return std::nullopt;
}

double underside(const State& x, const Eigen::Vector3d& up) {
  return up.dot(x.head<3>()) - 0.5 * std::exp(x[kSize + 2]);
}

}  // namespace perdure::semantic_filter
