#include "services/capture/live/live_camera.h"

#include <utility>

namespace perdure::capture {
namespace {

/// One wait for an image. Silence is measured in waits, not in time, because after a suspension of
/// the process images may be available although time has passed.
constexpr std::chrono::milliseconds kWait{100};
constexpr int kSilentIntervals = 10;

}  // namespace

LiveCamera::LiveCamera(OpenCamera open, double rate_hz, std::function<void(CameraImage)> give)
    : open_(std::move(open)), give_(std::move(give)), rate_(rate_hz), thread_([this] { run(); }) {}

LiveCamera::~LiveCamera() {
  stopping_ = true;
  thread_.join();
}

void LiveCamera::run() {
  keepOpen(stopping_, [this] {
    if (const auto session = open_()) {
      flow(**session);
    } else {
      state_.fails(session.error());
    }
  });
}

void LiveCamera::flow(CameraSession& session) {
  numbers_.reopened();
  rate_.reopened();
  int silent = 0;
  while (!stopping_ && !session.stepsAside() && silent < kSilentIntervals) {
    auto shot = session.next(kWait);
    silent = shot ? 0 : silent + 1;
    if (!shot && session.gone()) break;  // all images have been passed on
    if (!shot) continue;
    take(*std::move(shot));
    state_.flows(session.name(), joined(session.note(), rate_.note()));
  }
  if (stopping_) return;
  if (session.gone()) {
    state_.fails({"camera_lost", "the camera was unplugged; plug it in again, and it goes on."});
  } else if (session.stepsAside()) {
    state_.count("camera_reopened");
  } else {
    state_.fails({"camera_silent", "the camera " + session.name() +
                                       " gives no images; it is opened again. Is its cable "
                                       "loose?"});
  }
}

void LiveCamera::take(CameraShot shot) {
  CameraImage image;
  image.number = numbers_.of(shot.sequence);
  if (numbers_.lost() > 0) state_.count("camera_frame_lost", numbers_.lost());
  rate_.frame(image.number, shot.time_ns);
  if (!shot.frame) return state_.count(shot.frame.error().code);
  image.time_ns = shot.time_ns;
  image.frame = *std::move(shot.frame);
  give_(std::move(image));
}

}  // namespace perdure::capture
