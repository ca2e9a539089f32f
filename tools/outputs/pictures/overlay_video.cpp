#include "tools/outputs/pictures/overlay_video.h"

#include <fmt/format.h>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/vision/image.h"

namespace perdure::tools {

OverlayWriter::OverlayWriter(std::filesystem::path file, const CameraCalibration& camera,
                             double rate_hz, const OverlaySettings& settings)
    : file_(std::move(file)),
      picture_(camera, settings),
      rate_hz_(rate_hz > 0.0 ? rate_hz : 10.0),
      image_size_(static_cast<int>(camera.width), static_cast<int>(camera.height)) {}

Result<void> OverlayWriter::add(const Frame& frame, const FrameGlance& glance) {
  const auto image = vision::viewOf(frame);
  if (!image) return tl::unexpected(image.error());
  if (image->size() != image_size_) return fail("image_size", "not that of the calibration");
  if (refused_) return tl::unexpected(*refused_);
  if (!video_) {
    auto opened = VideoFile::open(file_, picture_.size(), rate_hz_);
    if (!opened) return tl::unexpected(*(refused_ = opened.error()));
    video_ = *std::move(opened);
  }
  if (path_.empty()) start_ = frame.stamp.time;
  if (glance.has_objects || path_.empty()) path_.push_back(glance.T_WB.p);
  return video_->write(picture_.draw(*image, glance, path_, start_));
}

namespace {

double rateOf(const DriveLog& log, const CameraCalibration& camera) {
  const auto& frames = log.frames();
  if (frames.size() < 2) return camera.rate_hz;
  const double seconds =
      toSeconds(frames.rbegin()->second.stamp.time - frames.begin()->second.stamp.time);
  return seconds > 0.0 ? static_cast<double>(frames.size() - 1) / seconds : camera.rate_hz;
}

std::string writeFrames(const DriveLog& log, replay::Dataset& dataset, OverlayWriter& writer,
                        const std::filesystem::path& file,
                        const std::function<void(std::size_t, std::size_t)>& progress) {
  std::size_t done = 0;
  Reason last{"image_missing", "the folder has no images"};
  for (const auto& [index, glance] : log.frames()) {
    const auto frame = dataset.frameAt(index);
    const Result<void> added =
        frame && frame->data ? writer.add(*frame, glance) : Result<void>(tl::unexpected(last));
    if (!added) last = added.error();
    if (!added && added.error().code.starts_with("video_")) break;
    progress(++done, log.frames().size());
  }
  if (const auto finished = writer.finish(); !finished) last = finished.error();
  if (last.code == "video_not_written") throwUnwritten(file, last.detail);
  if (writer.frames() > 0) {
    return fmt::format("overlay.mp4: {} frames, {}", writer.frames(), writer.codec());
  }
  if (last.code.starts_with("video_")) return "overlay.mp4 is not written: " + last.detail;
  return "overlay.mp4 is not written: there are no images to draw on (" + last.detail + ")";
}

}  // namespace

std::string writeOverlay(const DriveLog& log, const replay::DatasetOptions& data,
                         const std::filesystem::path& file,
                         const std::function<void(std::size_t, std::size_t)>& progress) {
  if (log.frames().empty()) return "overlay.mp4 is not written: the drive has no frames";
  try {
    const auto dataset = replay::Dataset::open(data);
    const CameraCalibration& camera = dataset->calibration().cameras.front();
    OverlayWriter writer(file, camera, rateOf(log, camera), {.reach_m = usualReach(log)});
    return writeFrames(log, *dataset, writer, file, progress);
  } catch (const StartupError& error) {
    if (error.code() == ExitCode::kInputOutput) throw;
    return fmt::format("overlay.mp4 is not written: {}", error.what());
  }
}

}  // namespace perdure::tools
