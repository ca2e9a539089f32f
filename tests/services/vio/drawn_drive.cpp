#include "tests/services/vio/drawn_drive.h"

#include <opencv2/imgproc.hpp>

#include "common/base/check.h"
#include "common/vision/image.h"

namespace perdure::vio::test {

Frame drawn(const SimulatedDrive& drive, double t, std::uint64_t sequence, std::size_t camera) {
  constexpr int kShift = 4;
  cv::Mat image(480, 752, CV_8UC1, cv::Scalar(90));
  const RigidTransform T_WC = drive.truth(t).T_WB() * drive.cameras()[camera].T_BC();
  for (std::size_t i = 0; i < drive.points().size(); ++i) {
    const auto p = drive.cameras()[camera].project(T_WC.inverse() * drive.points()[i]);
    if (!p || p->x() < -20 || p->y() < -20 || p->x() > 772 || p->y() > 500) continue;
    const cv::Point at(static_cast<int>(p->x() * (1 << kShift)),
                       static_cast<int>(p->y() * (1 << kShift)));
    const int radius = (4 + static_cast<int>(i % 4)) << kShift;
    cv::circle(image, at, radius, static_cast<double>(i % 2 ? 130 + i * 37 % 120 : i * 53 % 60),
               cv::FILLED, cv::LINE_AA, kShift);
  }
  Frame frame;
  frame.stamp = {1, sequence, drive.time(t), 0};
  frame.camera = camera == 0 ? "cam0" : "cam1";
  check(vision::setPixels(frame, image).has_value(), "the image is sound");
  return frame;
}

}  // namespace perdure::vio::test
