// Images of two cameras that were taken at one moment.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "services/capture/live/camera_session.h"

namespace perdure::capture {

/// The stamps of one camera.
class CameraTimeline {
 public:
  /// False where the stamp goes back, or lies ahead of `now_ns` by more than `interval_ns`.
  bool takes(const CameraImage& image, std::int64_t now_ns, double interval_ns);
  /// Of the last image that came in order, or went back; nothing before.
  std::optional<std::int64_t> last_ns() const { return last_ns_; }
  /// Between images, smoothed; 0: not known.
  double period_ns() const { return period_ns_; }
  /// Whether an image came in the last `longest_ns`.
  bool flows(std::int64_t now_ns, double longest_ns) const;

 private:
  std::optional<std::int64_t> last_ns_, arrived_ns_;
  std::uint64_t number_ = 0;
  double period_ns_ = 0.0;
};

/// Pairs by the nearest stamp. An image of cam0 waits for its partner no longer than the tolerance,
/// and then goes alone; where cam1 gives nothing it does not wait. Those of cam1 wait until one of
/// cam0 is past them, and are dropped.
class StereoPairing {
 public:
  /// `rate_hz`: what is asked for.
  explicit StereoPairing(double rate_hz);

  /// What goes out now that an image of cam0 or of cam1 has come: cam0 first, cam1 with its number.
  /// `now_ns`: CLOCK_BOOTTIME.
  std::vector<CameraImage> first(CameraImage image, std::int64_t now_ns);
  std::vector<CameraImage> second(CameraImage image, std::int64_t now_ns);
  /// What has waited long enough.
  std::vector<CameraImage> due(std::int64_t now_ns);

  /// A third of the time between two images, and no more than vio pairs by itself: 10 ms.
  std::int64_t toleranceNs() const;
  /// A sentence with the mend where most images of cam0 go alone though cam1 gives images.
  const std::string& problem() const { return problem_; }
  /// A sentence where the images of a pair are typically more than 2 ms apart.
  const std::string& note() const { return note_; }
  /// "stereo_unpaired_cam0", "stereo_unpaired_cam1", "camera_out_of_order_cam0", "…_cam1".
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
  std::optional<std::int64_t> alone_ns_;  ///< stamp of the last one of cam0 that went alone
  // Since the last judgement, while both give images:
  std::vector<double> apart_ms_;
  std::size_t alone_ = 0, late_ = 0;
  double told_ms_ = 0.0;
  std::string problem_, note_;
  ReasonCounts reasons_;
};

}  // namespace perdure::capture
