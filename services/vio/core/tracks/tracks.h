// Output of the tracker for the filter, and a database of the observations of each point.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/camera/camera_model.h"
#include "services/vio/core/state/lens_error.h"

namespace perdure::vio {

struct ImagePoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();       ///< observed pixel, with distortion
  Eigen::Vector2d normalised = Eigen::Vector2d::Zero();  ///< x/z, y/z, undistorted
  double scale = 1.0;  ///< mean number of pixels per unit of the normalised image at this point
  Eigen::Matrix2d to_pixels = Eigen::Matrix2d::Identity();  ///< ∂pixel / ∂normalised at this point
  double row = 0.0;  ///< −½ … ½: time since the middle row, as a share of the read-out
};

/// Undistorts a pixel. Returns nothing if the lens model has no inverse there.
std::optional<ImagePoint> imagePoint(const CameraModel& camera, const Eigen::Vector2d& pixel);

/// One tracked point at one time, in the cameras that see it. The first camera always sees it.
struct TrackedPoint {
  std::uint64_t id = 0;
  std::array<std::optional<ImagePoint>, kMaxCameras> seen;
};

struct TrackedFrame {
  std::vector<TrackedPoint> points;  ///< in order of rising id
  SharedCameras cameras = {};        ///< that undistorted the points; needed to estimate the lens
};

struct Observation {
  std::uint64_t frame = 0;
  std::array<std::optional<ImagePoint>, kMaxCameras> seen;
};

struct Track {
  std::uint64_t id = 0;
  std::vector<Observation> observations;  ///< oldest first
  std::size_t views() const;
  bool seenAt(std::uint64_t frame) const {
    return !observations.empty() && observations.back().frame == frame;
  }
};

class FeatureDatabase {
 public:
  void add(std::uint64_t frame, const TrackedFrame& tracked);
  /// Removes the observations of a frame, and tracks that become empty.
  void removeFrame(std::uint64_t frame);
  void erase(std::uint64_t id);
  template <class Predicate>
  void eraseIf(Predicate goes) {
    for (auto it = tracks_.begin(); it != tracks_.end();) {
      it = goes(it->second) ? forget(it) : std::next(it);
    }
  }
  void clear() { tracks_.clear(); }
  const std::map<std::uint64_t, Track>& tracks() const { return tracks_; }
  const Track* find(std::uint64_t id) const;

 private:
  using Tracks = std::map<std::uint64_t, Track>;
  Tracks::iterator forget(Tracks::iterator track);  ///< removes a track and returns the next

  Tracks tracks_;
  std::vector<Tracks::node_type> spare_;  ///< nodes of removed tracks, whose memory is reused
};

}  // namespace perdure::vio
