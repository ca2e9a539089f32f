// Tracks corners through short runs of images in which the camera rotates most.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/replay/dataset.h"

namespace perdure::calibrate {

/// Pixels of one corner in two or more consecutive images, from the window's first image on.
using Track = std::vector<Eigen::Vector2d>;

struct TrackWindow {
  std::vector<TimePoint> times;  ///< stamps of the images
  std::vector<Track> tracks;
};

struct WindowOptions {
  std::size_t most = 40;   ///< largest number of windows
  std::size_t skip = 0;    ///< windows with larger rotations that are left out
  double seconds = 0.7;    ///< length of a window, at least three images; shorter ones do not
                           ///< separate slow translation from rotation
  double spacing_s = 0.0;  ///< least time between the images that are used
  double until_s = 1e9;    ///< s since the first image; later images are not used
};

struct TrackWindows {
  std::vector<TrackWindow> windows;  ///< sorted by time
  std::size_t images = 0;            ///< images that were read
  std::size_t blank = 0;             ///< windows without enough corners, or unreadable

  void add(TrackWindows more);
};

/// Windows of cam0, chosen so that they rotate about all axes. Images with another size than the
/// calibration's are not used.
TrackWindows trackWindows(const replay::Recording& recording, const WindowOptions& options);

}  // namespace perdure::calibrate
