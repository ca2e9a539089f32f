// The reference for vio's times: OpenCV alone follows 200 points from frame to frame with its
// default settings. The windows have 21 pixels, the pyramid has three levels above the image. New
// points are added if fewer than 150 are left.
#pragma once

#include <ctime>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>
#include <vector>

namespace perdure::bench {

/// CPU time of this thread, in milliseconds.
inline double cpuMs() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

class PlainTracker {
 public:
  void follow(const cv::Mat& image) {
    std::vector<cv::Point2f> kept;
    if (!before_.empty() && !points_.empty()) {
      std::vector<cv::Point2f> now;
      std::vector<unsigned char> found;
      cv::calcOpticalFlowPyrLK(before_, image, points_, now, found, cv::noArray());
      for (std::size_t i = 0; i < now.size(); ++i) {
        if (found[i]) kept.push_back(now[i]);
      }
    }
    if (kept.size() < 150) {
      cv::Mat open(image.size(), CV_8UC1, cv::Scalar(255));
      for (const cv::Point2f& p : kept) cv::circle(open, cv::Point(p), 12, 0, cv::FILLED);
      std::vector<cv::Point2f> fresh;
      cv::goodFeaturesToTrack(image, fresh, 200 - static_cast<int>(kept.size()), 0.01, 12.0, open);
      kept.insert(kept.end(), fresh.begin(), fresh.end());
    }
    points_ = std::move(kept);
    before_ = image.clone();
  }

 private:
  cv::Mat before_;
  std::vector<cv::Point2f> points_;
};

}  // namespace perdure::bench
