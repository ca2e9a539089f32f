// Search index of a map's objects by place, and of pairs of objects by class and distance.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/mapping/parameters.h"
#include "common/mapping/places/placed_object.h"

namespace perdure::mapping {

/// Indices of points in the plane, stored by squares of a grid.
class PlaceGrid {
 public:
  PlaceGrid(double width, const std::vector<Eigen::Vector2d>& places);

  /// Calls `visit` with the indices of all points within one square's width of p, and of some
  /// beyond.
  template <class Visit>
  void around(const Eigen::Vector2d& p, const Visit& visit) const {
    for (std::int64_t x = cell(p.x()) - 1; x <= cell(p.x()) + 1; ++x) {
      for (std::int64_t y = cell(p.y()) - 1; y <= cell(p.y()) + 1; ++y) {
        const auto found = cells_.find(keyOf(x, y));
        if (found == cells_.end()) continue;
        for (const std::size_t k : found->second) visit(k);
      }
    }
  }

 private:
  std::int64_t cell(double v) const { return static_cast<std::int64_t>(std::floor(v / width_)); }
  static std::int64_t keyOf(std::int64_t x, std::int64_t y) { return x * 0x100000 + y; }

  double width_;
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells_;
};

class MapIndex {
 public:
  /// Distance beyond which a map object has no effect on a match.
  static constexpr double kReach_m = 24.0;

  /// `objects` in M; `driven`: positions in M from which they were observed.
  MapIndex(std::vector<PlacedObject> objects, std::vector<Eigen::Vector2d> driven,
           const PlaceParameters& parameters);

  const std::vector<PlacedObject>& objects() const { return objects_; }
  /// Calls `visit` with the indices of all objects within kReach_m of p, and of some beyond.
  template <class Visit>
  void around(const Eigen::Vector2d& p, const Visit& visit) const {
    by_place_.around(p, visit);
  }

  struct Pair {
    double distance;   ///< distance in the plane, m
    std::size_t c, d;  ///< indices of the two objects
  };
  /// Returns the pairs whose first object has class_c and whose second has class_d, sorted by
  /// distance; null if there are none.
  const std::vector<Pair>* pairsOf(std::uint32_t class_c, std::uint32_t class_d) const;

  /// Probability that an object at a place is on the map. It decreases with distance from the
  /// positions `driven`.
  double knownShare(const Eigen::Vector2d& at) const;
  /// Share of a class among the objects, [0, 1].
  double commonShare(std::uint32_t class_number) const;

  /// centre() returns the mean position of the objects in the plane, spread2() their mean squared
  /// distance from it along each axis, m².
  Eigen::Vector2d centre() const { return centre_; }
  Eigen::Vector2d spread2() const { return spread2_; }

 private:
  void pairUp(const PlaceParameters& parameters);

  PlaceParameters parameters_;
  std::vector<PlacedObject> objects_;
  std::vector<Eigen::Vector2d> driven_;
  PlaceGrid by_place_, by_way_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Pair>> pairs_;
  std::map<std::uint32_t, double> common_;
  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero(), spread2_ = Eigen::Vector2d::Zero();
};

/// Returns the number of the most probable class. The PMF must not be empty.
std::uint32_t mostProbable(const PlacedObject& object);

}  // namespace perdure::mapping
