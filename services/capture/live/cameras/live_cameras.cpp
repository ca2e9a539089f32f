#include "services/capture/live/cameras/live_cameras.h"

#include <utility>

namespace perdure::capture {

std::string cameraName(std::size_t i) { return "cam" + std::to_string(i); }

LiveCameras::LiveCameras(const std::vector<OpenCamera>& cameras, double rate_hz,
                         const std::function<void(CameraImage)>& give) {
  if (cameras.size() > 1) pairing_.emplace(rate_hz);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    cameras_.emplace_back(cameras[i], rate_hz, [give, name = cameraName(i)](CameraImage image) {
      image.frame.camera = name;
      give(std::move(image));
    });
  }
}

std::vector<CameraImage> LiveCameras::pair(CameraImage image, std::int64_t now_ns) {
  if (pairing_) {
    return image.frame.camera == cameraName(0) ? pairing_->first(std::move(image), now_ns)
                                               : pairing_->second(std::move(image), now_ns);
  }
  std::vector<CameraImage> alone;
  alone.push_back(std::move(image));
  return alone;
}

std::vector<CameraImage> LiveCameras::due(std::int64_t now_ns) {
  return pairing_ ? pairing_->due(now_ns) : std::vector<CameraImage>{};
}

std::string LiveCameras::named(std::size_t i, const std::string& text, const char* between) const {
  return pairing_ && !text.empty() ? cameraName(i) + between + text : text;
}

std::string LiveCameras::problem() const {
  std::string text;
  std::size_t i = 0;
  for (const auto& camera : cameras_) {
    text = joined(text, named(i++, camera.state().problem(), ": "));
  }
  // While a camera has a problem, problems of the pairs are not reported.
  return text.empty() && pairing_ ? pairing_->problem() : text;
}

std::string LiveCameras::name() const {
  std::string text;
  std::size_t i = 0;
  for (const auto& camera : cameras_) {
    text = joined(text, named(i++, camera.state().name(), " "), "; ");
  }
  return text;
}

std::string LiveCameras::note() const {
  std::string text;
  std::size_t i = 0;
  for (const auto& camera : cameras_) {
    text = joined(text, named(i++, camera.state().note(), ": "));
  }
  return pairing_ ? joined(text, pairing_->note()) : text;
}

void LiveCameras::report(ReasonCounts& counts) const {
  std::size_t i = 0;
  for (const auto& camera : cameras_) {
    const std::string of = pairing_ ? "_" + cameraName(i++) : "";
    const ReasonCounts its = camera.state().reasons();
    for (const auto& [reason, n] : its.all()) counts.add(reason + of, n);
  }
  if (pairing_) counts.add(pairing_->reasons());
}

}  // namespace perdure::capture
