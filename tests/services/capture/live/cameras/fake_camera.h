// A simulated camera that a test plugs in, unplugs, and triggers.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "common/base/bounded_queue.h"
#include "services/capture/live/camera_session.h"

namespace perdure::capture::testing {

class FakeCamera {
 public:
  explicit FakeCamera(std::string name, bool plugged = true)
      : state_(std::make_shared<State>(std::move(name), plugged)) {}

  OpenCamera opener() const {
    return [state = state_]() -> Result<std::unique_ptr<CameraSession>> {
      if (!state->plugged) return fail("camera_absent", state->name + " is not plugged in.");
      return std::make_unique<Session>(state);
    };
  }
  /// Adds an image of an empty scene, unless the camera is unplugged; `sequence` is the driver's
  /// count.
  void shoot(std::uint32_t sequence, std::int64_t time_ns) const {
    if (!state_->plugged) return;
    Frame frame;
    frame.width = frame.height = 8;
    frame.data = std::make_shared<std::vector<std::uint8_t>>(64);
    state_->shots.push({sequence, time_ns, std::move(frame)});
  }
  void plug() const { state_->plugged = true; }
  void unplug() const { state_->plugged = false; }
  /// Makes the session request its reopening, as if for another camera.
  void askAside() const { state_->aside = true; }
  /// Returns how often the camera was opened.
  unsigned openings() const { return state_->openings; }

 private:
  struct State {
    State(std::string of, bool is_plugged) : name(std::move(of)), plugged(is_plugged) {}
    const std::string name;
    std::atomic<bool> plugged, aside{false};
    std::atomic<unsigned> openings{0};
    BoundedQueue<CameraShot> shots{64, Overflow::kDropOldest};
  };
  class Session final : public CameraSession {
   public:
    explicit Session(std::shared_ptr<State> state) : state_(std::move(state)) {
      while (state_->shots.tryPop()) continue;
      state_->aside = false;
      ++state_->openings;
    }
    std::string name() const override { return state_->name; }
    std::string note() const override { return {}; }
    bool gone() const override { return !state_->plugged; }
    bool stepsAside() const override { return state_->aside; }
    std::optional<CameraShot> next(std::chrono::milliseconds longest) override {
      return gone() ? state_->shots.tryPop() : state_->shots.popWithin(longest);
    }

   private:
    const std::shared_ptr<State> state_;
  };

  const std::shared_ptr<State> state_;
};

}  // namespace perdure::capture::testing
