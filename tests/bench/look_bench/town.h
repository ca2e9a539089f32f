// A town of square blocks with parked cars, walks through its streets, and what a camera sees.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include "services/semantic_filter/core/planning/expectation.h"
#include "tests/services/semantic_filter/scene.h"

namespace perdure::semantic_filter::bench {

inline constexpr int kNodes = 6;          ///< crossings along one side of the town
inline constexpr double kBlock_m = 60.0;  ///< between two crossings
inline constexpr double kFrame_m = 2.0, kSpeed = 8.0;

struct Street {
  int a = 0, b = 0;         ///< crossings
  double occupancy = 0.0;   ///< share of its parking places that are taken
  double popularity = 1.0;  ///< how often it is chosen in a walk
};

/// A parking place beside a street.
struct Parking {
  std::size_t street = 0;
  State car;  ///< the car that stands here, or would
  bool taken = false;
  double seen_s = 0.0;  ///< time at which it was last in view
};

/// A sequence of crossings.
using Walk = std::vector<int>;

class Town {
 public:
  explicit Town(std::uint64_t seed);

  const std::vector<Street>& streets() const { return streets_; }
  std::vector<Parking>& parking() { return parking_; }
  const std::vector<Parking>& parking() const { return parking_; }
  /// Returns the street between two crossings; nothing if they are not adjacent.
  std::optional<std::size_t> streetBetween(int a, int b) const;
  const std::vector<int>& adjacentTo(int node) const { return adjacent_[node]; }
  static Eigen::Vector2d place(int node);
  /// Returns whether no house stands between the two places.
  static bool inSight(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

 private:
  std::vector<Street> streets_;
  std::vector<Parking> parking_;
  std::vector<std::vector<int>> adjacent_;
};

/// Returns the body's poses on a walk, every `step_m`, with turns on the spot in between. The first
/// is at `start_s`.
std::vector<TimedView> posesOf(const Walk& walk, double step_m, double start_s);
double lengthOf(const Walk& walk);

/// Returns the shortest walk found from `start` through all streets.
Walk shortestTour(const Town& town, int start, std::mt19937& random);
/// Returns a walk that chooses streets by their popularity.
Walk wander(const Town& town, int start, double metres, std::mt19937& random);

/// The view of a camera on a pose: boxes of the cars in sight, and false ones. Notes the parking
/// places in view as seen.
std::vector<Detection> see(Town& town, const TimedView& view, const CameraModel& camera,
                           std::mt19937& random);

}  // namespace perdure::semantic_filter::bench
