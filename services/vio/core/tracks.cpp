#include "services/vio/core/tracks.h"

#include <algorithm>
#include <cmath>

namespace perdure::vio {

std::optional<ImagePoint> imagePoint(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const auto normalised = camera.unproject(pixel);
  if (!normalised) return std::nullopt;
  Eigen::Matrix2d J;
  camera.distort(*normalised, &J);
  return ImagePoint{pixel, *normalised, std::sqrt(std::abs(J.determinant())), J};
}

std::size_t Track::views() const {
  std::size_t count = 0;
  for (const Observation& o : observations) {
    for (const auto& s : o.seen) count += s.has_value();
  }
  return count;
}

void FeatureDatabase::add(std::uint64_t frame, const TrackedFrame& tracked) {
  for (const TrackedPoint& point : tracked.points) {
    Track& track = tracks_[point.id];
    track.id = point.id;
    track.observations.push_back({frame, point.seen});
  }
}

void FeatureDatabase::removeFrame(std::uint64_t frame) {
  for (auto it = tracks_.begin(); it != tracks_.end();) {
    std::erase_if(it->second.observations, [&](const Observation& o) { return o.frame == frame; });
    it = it->second.observations.empty() ? tracks_.erase(it) : std::next(it);
  }
}

const Track* FeatureDatabase::find(std::uint64_t id) const {
  const auto it = tracks_.find(id);
  return it == tracks_.end() ? nullptr : &it->second;
}

}  // namespace perdure::vio
