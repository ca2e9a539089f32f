// Pairs images of two cameras that were taken at the same time.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/capture/live/camera_session.h"

namespace perdure::capture {

class CameraTimeline {
 public:
  /// Returns whether the image is in order. Its stamp must increase, and must not be ahead of
  /// `now_ns` by more than `interval_ns`.
  bool takes(const CameraImage& image, std::int64_t now_ns, double interval_ns);
  /// Returns the stamp of the last image, even if that image was out of order; nothing before the
  /// first image.
  std::optional<std::int64_t> last_ns() const { return last_ns_; }
  /// Returns the smoothed time between images; 0: not known.
  double period_ns() const { return period_ns_; }
  bool flows(std::int64_t now_ns, double longest_ns) const;

 private:
  std::optional<std::int64_t> last_ns_, arrived_ns_;
  std::uint64_t number_ = 0;
  double period_ns_ = 0.0;
};

/// Pairs images by the nearest stamp. An image of cam0 waits for its partner no longer than the
/// tolerance, and is then passed on alone. If cam1 sends no images, images of cam0 do not wait.
/// Images of cam1 wait until later images of cam0 arrive, and are then dropped.
class StereoPairing {
 public:
  explicit StereoPairing(double rate_hz);

  /// Takes an image of cam0 or cam1 and returns the images to publish: cam0 first, then cam1 with
  /// the same number. `now_ns`: CLOCK_BOOTTIME.
  std::vector<CameraImage> first(CameraImage image, std::int64_t now_ns);
  std::vector<CameraImage> second(CameraImage image, std::int64_t now_ns);
  std::vector<CameraImage> due(std::int64_t now_ns);

  /// Returns the tolerance: a third of the time between two images, at most 10 ms, which is vio's
  /// own.
  std::int64_t toleranceNs() const;
  /// Returns a sentence with the fix if most images of cam0 have no partner although cam1 sends
  /// images; otherwise empty.
  const std::string& problem() const { return problem_; }
  /// Returns a sentence if the stamps of a pair typically differ by more than 2 ms; otherwise
  /// empty.
  const std::string& note() const { return note_; }
  /// Returns the counts "stereo_unpaired_cam0", "…_cam1", "camera_out_of_order_cam0" and "…_cam1".
  const ReasonCounts& reasons() const { return reasons_; }

 private:
  struct Waiting {
    CameraImage image;
    std::int64_t arrived_ns;
    bool in_order;
  };
  using Seconds = std::deque<CameraImage>;

  double intervalNs() const;
  Seconds::iterator nearest(std::int64_t time_ns);
  bool mayBePaired(const Waiting& first, std::int64_t now_ns) const;
  void goAlone(const Waiting& first, std::int64_t now_ns);
  CameraImage partnerOf(const Waiting& first, Seconds::iterator partner);
  void dropSeconds(std::size_t n);
  void dropPassed();
  void judge();
  void judgeDifference();

  const double asked_ns_;
  CameraTimeline first_, second_;
  std::deque<Waiting> firsts_;
  Seconds seconds_;
  std::optional<std::int64_t> alone_ns_;  ///< stamp of cam0's last image without a partner
  // Statistics since the last assessment, while both cameras send images:
  std::vector<double> apart_ms_;
  std::size_t alone_ = 0, late_ = 0;
  double told_ms_ = 0.0;
  std::string problem_, note_;
  ReasonCounts reasons_;
};

}  // namespace perdure::capture
