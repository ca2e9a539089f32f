#include "common/mapping/places/map_index.h"

#include <algorithm>
#include <tuple>

namespace perdure::mapping {
namespace {

/// Trajectories farther away than kWays times known_within_m have no effect.
constexpr double kWays = 4.0;
constexpr double kAnyShare = 0.02;  ///< share of objects on the map far from all trajectories

std::vector<Eigen::Vector2d> placesOf(const std::vector<PlacedObject>& objects) {
  std::vector<Eigen::Vector2d> places;
  places.reserve(objects.size());
  for (const PlacedObject& o : objects) places.push_back(o.p.head<2>());
  return places;
}

}  // namespace

std::uint32_t mostProbable(const PlacedObject& o) {
  return std::max_element(
             o.pmf.begin(), o.pmf.end(),
             [](const auto& a, const auto& b) { return a.probability < b.probability; })
      ->name;
}

PlaceGrid::PlaceGrid(double width, const std::vector<Eigen::Vector2d>& places) : width_(width) {
  for (std::size_t k = 0; k < places.size(); ++k) {
    cells_[keyOf(cell(places[k].x()), cell(places[k].y()))].push_back(k);
  }
}

MapIndex::MapIndex(std::vector<PlacedObject> objects, std::vector<Eigen::Vector2d> driven,
                   const PlaceParameters& parameters)
    : parameters_(parameters),
      objects_(std::move(objects)),
      driven_(std::move(driven)),
      by_place_(kReach_m, placesOf(objects_)),
      by_way_(kWays * parameters.known_within_m, driven_) {
  const auto n = static_cast<double>(objects_.size());
  for (const PlacedObject& o : objects_) {
    centre_ += o.p.head<2>() / n;
    for (const ClassShare& c : o.pmf) common_[c.name] += c.probability / n;
  }
  for (const PlacedObject& o : objects_) {
    spread2_ += (o.p.head<2>() - centre_).cwiseAbs2() / n;
  }
  pairUp(parameters);
}

void MapIndex::pairUp(const PlaceParameters& parameters) {
  const PlaceGrid near(parameters.pair_most_m, placesOf(objects_));
  for (std::size_t c = 0; c < objects_.size(); ++c) {
    near.around(objects_[c].p.head<2>(), [&](std::size_t d) {
      const double distance = (objects_[c].p - objects_[d].p).head<2>().norm();
      if (c == d || distance < parameters.pair_least_m || distance > parameters.pair_most_m) return;
      pairs_[{mostProbable(objects_[c]), mostProbable(objects_[d])}].push_back({distance, c, d});
    });
  }
  for (auto& [classes, list] : pairs_) {
    std::sort(list.begin(), list.end(), [](const Pair& a, const Pair& b) {
      return std::tie(a.distance, a.c, a.d) < std::tie(b.distance, b.c, b.d);
    });
  }
}

const std::vector<MapIndex::Pair>* MapIndex::pairsOf(std::uint32_t class_c,
                                                     std::uint32_t class_d) const {
  const auto found = pairs_.find({class_c, class_d});
  return found == pairs_.end() ? nullptr : &found->second;
}

double MapIndex::knownShare(const Eigen::Vector2d& at) const {
  const double reach = parameters_.known_within_m;
  double nearest = kWays * kWays * reach * reach;
  by_way_.around(
      at, [&](std::size_t k) { nearest = std::min(nearest, (driven_[k] - at).squaredNorm()); });
  return kAnyShare + parameters_.known_share * std::exp(-0.5 * nearest / (reach * reach));
}

double MapIndex::commonShare(std::uint32_t class_number) const {
  const auto at = common_.find(class_number);
  return at == common_.end() ? 0.0 : at->second;
}

}  // namespace perdure::mapping
