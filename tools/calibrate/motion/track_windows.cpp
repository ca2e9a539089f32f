#include "tools/calibrate/motion/track_windows.h"

#include <algorithm>
#include <array>
#include <future>

#include "common/replay/data_check.h"
#include "tools/data_check/image_turn.h"
#include "tools/data_check/turn_integral.h"

namespace perdure::calibrate {
namespace {

using Frames = std::vector<const replay::Recording::FrameFile*>;
using Run = std::pair<std::size_t, std::size_t>;  ///< first frame, and one past the last
using RatedRun = std::pair<Run, Eigen::Vector3d>;

constexpr std::size_t kFewestTracks = 15, kMostTracks = 40, kMostImages = 7;

Frames framesOf(const replay::Recording& recording, const WindowOptions& options) {
  Frames frames;
  for (const auto& frame : recording.frames) {
    if (frame.camera != 0 || (!frame.load && frame.path.empty())) continue;
    if (!frames.empty() && toSeconds(frame.time - frames.front()->time) > options.until_s) break;
    if (!frames.empty() && toSeconds(frame.time - frames.back()->time) < options.spacing_s)
      continue;
    frames.push_back(&frame);
  }
  return frames;
}

/// Sum of the squared rotations between consecutive images, for each axis, in rad².
Eigen::Vector3d rotationIn(const Frames& frames, const Run& run, const tools::TurnIntegral& gyro) {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (std::size_t i = run.first; i + 1 < run.second; ++i) {
    squares += gyro.between(frames[i]->time, frames[i + 1]->time).cwiseAbs2();
  }
  return squares;
}

/// Takes the runs of both halves of the drive in turn, because something may change in mid-drive.
void alternate(std::vector<RatedRun>& runs, std::size_t middle) {
  std::array<std::vector<RatedRun>, 2> halves;
  for (const RatedRun& run : runs) halves[run.first.first < middle ? 0 : 1].push_back(run);
  runs.clear();
  for (std::size_t i = 0; i < std::max(halves[0].size(), halves[1].size()); ++i) {
    for (const auto& half : halves) {
      if (i < half.size()) runs.push_back(half[i]);
    }
  }
}

/// The runs with the largest rotations; each axis counts relative to its mean.
std::vector<Run> runsOf(const Frames& frames, const std::vector<ImuSample>& samples,
                        const WindowOptions& options) {
  const tools::TurnIntegral gyro(samples);
  std::vector<RatedRun> all;
  Eigen::Vector3d mean = Eigen::Vector3d::Constant(1e-12);
  for (std::size_t begin = 0; begin < frames.size();) {
    std::size_t end = begin + 1;
    const auto lasts = [&](std::size_t i) {
      return toSeconds(frames[i]->time - frames[begin]->time);
    };
    while (end < frames.size() && (end < begin + 3 || lasts(end) <= options.seconds)) ++end;
    const bool whole = end >= begin + 3 && lasts(end - 1) < 2.0 * options.seconds;
    if (whole && gyro.covers(frames[begin]->time, frames[end - 1]->time)) {
      all.emplace_back(Run(begin, end), rotationIn(frames, {begin, end}, gyro));
      mean += all.back().second;
    }
    begin = whole ? end : begin + 1;
  }
  const auto score = [&](const auto& one) { return one.second.cwiseQuotient(mean).sum(); };
  std::ranges::stable_sort(all, [&](const auto& a, const auto& b) { return score(a) > score(b); });
  alternate(all, frames.size() / 2);
  all.erase(all.begin(), all.begin() + static_cast<long>(std::min(all.size(), options.skip)));
  all.resize(std::min(all.size(), options.most));
  std::vector<Run> runs;
  for (const auto& one : all) runs.push_back(one.first);
  std::ranges::sort(runs);
  return runs;
}

/// Keeps every N-th image, so that at most `kMostImages` remain.
void thin(TrackWindow& window) {
  const std::size_t each = (window.times.size() + kMostImages - 1) / kMostImages;
  const auto thinned = [&](auto& items) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < items.size(); i += each) items[kept++] = items[i];
    items.resize(kept);
  };
  thinned(window.times);
  for (Track& track : window.tracks) thinned(track);
}

TrackWindow windowOf(const Frames& frames, const Run& run, const CameraCalibration& camera) {
  constexpr std::uint32_t kColumns = 600;
  const int factor = replay::reductionFor(camera, kColumns);
  const auto whole = [&](const cv::Point2f& p) {
    return Eigen::Vector2d((p.x + 0.5) * factor - 0.5, (p.y + 0.5) * factor - 0.5);
  };
  TrackWindow window;
  tools::FollowedImage before;
  std::vector<cv::Point2f> last;
  std::vector<std::size_t> alive;
  for (std::size_t i = run.first; i < run.second; ++i) {
    const auto image = replay::monoImageOf(*frames[i], factor);
    if (!image || !replay::isOfCamera(*image, factor, camera)) break;
    tools::FollowedImage now(*image);
    if (window.times.empty()) {
      last = tools::cornersOf(now);
      for (const auto& corner : last) window.tracks.push_back({whole(corner)});
      for (std::size_t k = 0; k < last.size(); ++k) alive.push_back(k);
    } else {
      const auto followed = tools::follow(before, now, last);
      std::vector<cv::Point2f> found;
      std::vector<std::size_t> still;
      for (std::size_t k = 0; k < last.size(); ++k) {
        if (!followed[k]) continue;
        found.push_back(*followed[k]), still.push_back(alive[k]);
        window.tracks[alive[k]].push_back(whole(*followed[k]));
      }
      last = std::move(found), alive = std::move(still);
    }
    window.times.push_back(frames[i]->time);
    if (last.size() < kFewestTracks) break;
    before = std::move(now);
  }
  thin(window);
  // The longest tracks constrain the estimate most.
  std::ranges::stable_sort(window.tracks,
                           [](const Track& a, const Track& b) { return a.size() > b.size(); });
  window.tracks.resize(std::min(window.tracks.size(), kMostTracks));
  std::erase_if(window.tracks, [](const Track& track) { return track.size() < 2; });
  return window;
}

const auto kEarlier = [](const TrackWindow& a, const TrackWindow& b) {
  return a.times.front() < b.times.front();
};

}  // namespace

void TrackWindows::add(TrackWindows more) {
  images += more.images, blank += more.blank;
  std::ranges::move(more.windows, std::back_inserter(windows));
  std::ranges::sort(windows, kEarlier);
}

TrackWindows trackWindows(const replay::Recording& recording, const WindowOptions& options) {
  TrackWindows result;
  const Frames frames = framesOf(recording, options);
  if (frames.size() < 3 || recording.imu.size() < 3) return result;
  const CameraCalibration& camera = recording.calibration.cameras.front();
  // Image files are read in parallel, but images inside a recording file one after another.
  const auto policy = frames.front()->load ? std::launch::deferred : std::launch::async;
  const auto runs = runsOf(frames, recording.imu, options);
  constexpr std::size_t kWorkers = 4;
  std::vector<std::future<std::vector<TrackWindow>>> parts;
  for (std::size_t part = 0; part < kWorkers; ++part) {
    parts.push_back(std::async(policy, [&, part] {
      std::vector<TrackWindow> windows;
      for (std::size_t i = part; i < runs.size(); i += kWorkers) {
        windows.push_back(windowOf(frames, runs[i], camera));
      }
      return windows;
    }));
  }
  for (auto& part : parts) {
    for (TrackWindow& window : part.get()) {
      result.images += window.times.size();
      if (window.tracks.size() < kFewestTracks || window.times.size() < 3) {
        ++result.blank;
      } else {
        result.windows.push_back(std::move(window));
      }
    }
  }
  std::ranges::sort(result.windows, kEarlier);
  return result;
}

}  // namespace perdure::calibrate
