// The directions from which an object was detected. The horizontal ray from the camera to the
// object lies in one of sixteen sectors; the farthest distance in each sector is stored. Sector k
// has azimuths in [k, k + 1) / 16 turns, from x towards y in the frame of the belief.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace perdure {

inline constexpr int kDirections = 16;
inline constexpr double kDirectionWidth = 2.0 * M_PI / kDirections;  // rad
/// The farthest distance in each sector, m; 0 if the object was not detected from this direction.
using Directions = Eigen::Matrix<float, kDirections, 1>;

/// Returns the sector of a finite azimuth, rad.
inline int sectorOf(double azimuth) {
  const int sector =
      static_cast<int>(std::floor(std::remainder(azimuth, 2.0 * M_PI) / kDirectionWidth));
  return (sector + kDirections) % kDirections;
}
/// Adds a detection at a finite azimuth, rad, from a distance of `metres`, finite and > 0.
inline void addDirection(Directions& directions, double azimuth, double metres) {
  float& farthest = directions[sectorOf(azimuth)];
  farthest = std::max(farthest, static_cast<float>(metres));
}
/// Returns the directions in a frame in which azimuths are larger by `yaw` (finite, rad), to the
/// nearest sector.
inline Directions turnedBy(const Directions& directions, double yaw) {
  Directions there;
  const int shift = sectorOf(yaw + 0.5 * kDirectionWidth);
  for (int k = 0; k < kDirections; ++k) there[(k + shift) % kDirections] = directions[k];
  return there;
}
/// Returns the angle from an azimuth to a sector, rad: 0 inside the sector, at most π.
inline double angleToSector(int sector, double azimuth) {
  const double centre = (sector + 0.5) * kDirectionWidth;
  const double off = std::abs(std::remainder(azimuth - centre, 2.0 * M_PI));
  return std::max(0.0, off - 0.5 * kDirectionWidth);
}

}  // namespace perdure
