#include "services/semantic_filter/core/keyframe.h"

#include <algorithm>
#include <limits>

namespace perdure::semantic_filter {
namespace {

using Keyframes = std::vector<std::shared_ptr<const Keyframe>>;

/// By the view from the two places, or by the boxes where the thing itself moves.
double changeBetween(const Eigen::Vector3d& place, const Keyframe& a, const Keyframe& b,
                     const ViewScales& scales) {
  const auto centre = [](const BoxMeasurement& z) -> Eigen::Vector2d {
    return Eigen::Vector2d(z.sides[0] + z.sides[2], z.sides[1] + z.sides[3]) / 2.0;
  };
  const double shift = (centre(a.z) - centre(b.z)).norm() / a.from->camera.fx();
  const double growth = std::abs(std::log(a.z.height() / b.z.height()));
  return std::max(viewChange(place, a.from->T_WC, b.from->T_WC, scales),
                  shift / scales.image_angle + growth / scales.log_distance);
}

/// Change of view to the nearest of the others.
double apart(const Eigen::Vector3d& place, const Keyframes& all, std::size_t of,
             const ViewScales& scales) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i != of) least = std::min(least, changeBetween(place, *all[i], *all[of], scales));
  }
  return least;
}

/// The newest stays: what moves is estimated at its time.
void thin(const Eigen::Vector3d& place, Keyframes& all, const ViewScales& scales,
          std::size_t limit) {
  while (all.size() > limit) {
    std::size_t least = 0;
    double least_apart = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < all.size(); ++i) {
      const double d = apart(place, all, i, scales);
      if (d < least_apart) least = i, least_apart = d;
    }
    all.erase(all.begin() + static_cast<std::ptrdiff_t>(least));
  }
}

}  // namespace

bool remember(Object& object, Keyframe keyframe, const ViewScales& scales,
              const SmoothParameters& parameters) {
  const Eigen::Vector3d place = object.best().x.head<3>();
  for (const auto& other : object.keyframes) {
    if (changeBetween(place, *other, keyframe, scales) < parameters.new_view) return false;
  }
  object.keyframes.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
  thin(place, object.keyframes, scales, static_cast<std::size_t>(parameters.keyframes));
  return true;
}

void joinKeyframes(Object& a, const Object& b, const ViewScales& scales,
                   const SmoothParameters& parameters) {
  a.keyframes.insert(a.keyframes.end(), b.keyframes.begin(), b.keyframes.end());
  std::stable_sort(a.keyframes.begin(), a.keyframes.end(),
                   [](const auto& x, const auto& y) { return x->from->time < y->from->time; });
  thin(a.best().x.head<3>(), a.keyframes, scales, static_cast<std::size_t>(parameters.keyframes));
}

}  // namespace perdure::semantic_filter
