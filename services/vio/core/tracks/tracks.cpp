#include "services/vio/core/tracks/tracks.h"

#include <cmath>

namespace perdure::vio {

std::optional<ImagePoint> imagePoint(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const auto normalised = camera.unproject(pixel);
  if (!normalised) return std::nullopt;
  Eigen::Matrix2d J;
  camera.distort(*normalised, &J);
  return ImagePoint{pixel, *normalised, std::sqrt(std::abs(J.determinant())), J,
                    pixel.y() / (camera.height() - 1) - 0.5};
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
    auto it = tracks_.find(point.id);
    if (it == tracks_.end()) {
      if (spare_.empty()) {
        it = tracks_.try_emplace(point.id).first;
      } else {
        spare_.back().key() = point.id;
        it = tracks_.insert(std::move(spare_.back())).position;
        spare_.pop_back();
      }
      it->second.id = point.id;
      it->second.observations.clear();
    }
    it->second.observations.push_back({frame, point.seen});
  }
}

FeatureDatabase::Tracks::iterator FeatureDatabase::forget(Tracks::iterator track) {
  const auto next = std::next(track);
  spare_.push_back(tracks_.extract(track));
  return next;
}

void FeatureDatabase::erase(std::uint64_t id) {
  if (const auto it = tracks_.find(id); it != tracks_.end()) forget(it);
}

void FeatureDatabase::removeFrame(std::uint64_t frame) {
  for (auto& [id, track] : tracks_) {
    std::erase_if(track.observations, [&](const Observation& o) { return o.frame == frame; });
  }
  eraseIf([](const Track& track) { return track.observations.empty(); });
}

const Track* FeatureDatabase::find(std::uint64_t id) const {
  const auto it = tracks_.find(id);
  return it == tracks_.end() ? nullptr : &it->second;
}

}  // namespace perdure::vio
