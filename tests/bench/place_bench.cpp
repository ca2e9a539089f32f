// Measures the search for the body on a map of OBJECTS objects in streets, from SEEN objects of one
// place, without a prior pose. It times the index of the map, the search along streets driven
// before, and the search elsewhere. Prints the CPU time of this thread, medians of five places.
// usage: place_bench [OBJECTS [SEEN]] (default: 100,000 and 24)
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include "common/mapping/places/constellation.h"
#include "common/math/so3.h"

namespace {

using namespace perdure;
using namespace perdure::mapping;

constexpr int kPlaces = 5;
constexpr double kStreet_m = 120.0;  ///< distance between neighbouring streets
constexpr std::uint32_t kClasses = 5;

double cpuMs() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

class Town {
 public:
  explicit Town(std::size_t objects) : random_(7) {
    // An object stands every 8 m on either side of a street.
    const double length_m = 4.0 * static_cast<double>(objects);
    const double side_m = std::sqrt(length_m * kStreet_m / 2.0);
    while (objects_.size() < objects) {
      const bool along_x = any(0.0, 1.0) < 0.5;
      const double street = kStreet_m * std::floor(any(0.0, side_m) / kStreet_m);
      const double along = any(0.0, side_m), off = any(0.0, 1.0) < 0.5 ? -5.0 : 5.0;
      PlacedObject o;
      o.id = objects_.size() + 1;
      o.p = along_x ? Eigen::Vector3d(along, street + off, 0.7)
                    : Eigen::Vector3d(street + off, along, 0.7);
      o.yaw = wrapAngle((along_x ? 0.0 : 1.5708) + any(-0.1, 0.1));
      o.covariance = Eigen::Vector4d(0.04, 0.04, 0.02, 0.01).asDiagonal();
      const auto best = static_cast<std::uint32_t>(any(0.0, 1.0) < 0.7 ? 0 : any(1.0, kClasses));
      for (std::uint32_t c = 0; c < kClasses; ++c) o.pmf.push_back({c, c == best ? 0.92 : 0.02});
      objects_.push_back(o);
    }
    for (double street = 0.0; street < side_m; street += kStreet_m) {
      for (double along = 0.0; along < side_m; along += 12.0) {
        driven_.emplace_back(along, street);
        driven_.emplace_back(street, along);
      }
    }
  }

  double any(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  /// Returns the `count` objects nearest to `body`, in the body's frame.
  std::vector<PlacedObject> seenFrom(const LevelPose& body, std::size_t count) {
    std::vector<PlacedObject> seen = objects_;
    const auto nearer = [&](const PlacedObject& a, const PlacedObject& b) {
      return (a.p - body.p).squaredNorm() < (b.p - body.p).squaredNorm();
    };
    std::nth_element(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(count), seen.end(),
                     nearer);
    seen.resize(count);
    for (PlacedObject& o : seen) {
      o = transformed(body.inverse(), o);
      o.p += Eigen::Vector3d(any(-0.3, 0.3), any(-0.3, 0.3), any(-0.1, 0.1));
    }
    return seen;
  }
  const std::vector<PlacedObject>& objects() const { return objects_; }
  const std::vector<Eigen::Vector2d>& driven() const { return driven_; }

 private:
  std::mt19937 random_;
  std::vector<PlacedObject> objects_;
  std::vector<Eigen::Vector2d> driven_;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + kPlaces / 2, values.end());
  return values[kPlaces / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const auto count = static_cast<std::size_t>(argc > 1 ? std::atol(argv[1]) : 100'000);
  const auto seen = static_cast<std::size_t>(argc > 2 ? std::atol(argv[2]) : 24);
  Town town(count);
  const PlaceParameters parameters;
  double start = cpuMs();
  const MapIndex index(town.objects(), town.driven(), parameters);
  std::printf("%zu objects: index %.0f ms\n", count, cpuMs() - start);
  LevelGaussian anywhere;
  anywhere.mean.p << index.centre(), 0.0;
  anywhere.covariance.diagonal() << index.spread2(), 1e6, 100.0;
  std::vector<double> known, unknown;
  int found = 0, foreign = 0;
  for (int place = 0; place < kPlaces; ++place) {
    const Eigen::Vector2d at = town.driven()[static_cast<std::size_t>(
        town.any(0.0, 0.999) * static_cast<double>(town.driven().size()))];
    const LevelPose body{{at.x(), at.y(), 0.0}, town.any(-3.0, 3.0)};
    auto objects = town.seenFrom(body, seen);
    start = cpuMs();
    const auto match = bestMatch(objects, index, anywhere, parameters);
    known.push_back(cpuMs() - start);
    found += match && (match->T_MB.mean.p - body.p).head<2>().norm() < 1.0 &&
             match->score - match->next > std::log(match->cells);
    for (PlacedObject& o : objects)
      o.p.head<2>() = Eigen::Vector2d(town.any(-30, 30), town.any(-30, 30));
    start = cpuMs();
    const auto none = bestMatch(objects, index, anywhere, parameters);
    unknown.push_back(cpuMs() - start);
    foreign += none && none->score - none->next > 8.0 + std::log(none->cells);
  }
  std::printf("search, driven before %.0f ms (%d of %d found), not driven %.0f ms (%d believed)\n",
              median(known), found, kPlaces, median(unknown), foreign);
  return found == kPlaces && foreign == 0 ? 0 : 1;
}
