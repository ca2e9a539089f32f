// The topics around inference for tests of swaps. Sends frames and odometry at a constant rate;
// receives detections, objects, events, notices and health. Runs real processes on a separate
// network.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <memory>
#include <set>
#include <sstream>

#include "common/bus/once.h"
#include "tests/process/support.h"
#include "tests/services/inference/tiny_onnx.h"
#include "tests/services/run_until.h"
#include "tests/support/camera.h"

namespace perdure::inference::testing {

using namespace std::chrono_literals;

/// A network that reports two or more boxes with a clear class. `by_light` selects its fault on
/// bright frames: "" none, "nan", "empty", "elsewhere".
inline TinyOnnx swapNetwork(const std::string& name, const std::string& by_light = "") {
  TinyOnnx net;
  net.name = name;
  net.box = {-1.2F, -1.2F, -1.2F, -1.2F};
  net.logits = {0.0F, 5.0F, -2.0F};
  if (by_light == "nan")
    net.logits_by_light = {0.0F, 2e36F, 0.0F};  // ∞ for a brightness of 170 or
                                                // more
  if (by_light == "empty") net.logits_by_light = {1e4F, 0.0F, 0.0F};
  if (by_light == "elsewhere") net.box_by_light = {-1e4F, -1e4F, 9.0F, 9.0F};
  return net;
}

class SwapRig {
 public:
  explicit SwapRig(double rate_hz, double period_s)
      : period_(durationFromSeconds(1.0 / rate_hz)), period_s_(period_s) {
    loop_.on(detections_, [this](const Detections& d) {
      by_frame_[d.stamp.sequence].push_back(d.instance);
      answered_at_.try_emplace(d.stamp.sequence, next_);
      last_heard_ = d.instance;
    });
    loop_.on(objects_, [this](const Objects& m) {
      ++object_messages_[m.stamp.sequence];
      last_objects_ = m;
    });
    loop_.on(notices_, [this](const SwapNotice& n) {
      said_.push_back(n);
      said_at_.emplace_back(next_, nameOf(n.step));
    });
    loop_.on(events_, [this](const Event& e) { happened_.push_back(e); });
    loop_.on(models_, [this](const ModelInfo& m) { known_models_[m.name] = m; });
    loop_.on(health_, [this](const Health& h) { healths_[h.instance] = h; });
  }

  std::vector<std::string> inference(const std::string& model,
                                     std::vector<std::string> settings = {}) const {
    std::vector<std::string> command = {(test::programs() / "perdure-inference").string(), "--set",
                                        "model.path=" + model, "--set",
                                        "ownership.period_s=" + std::to_string(period_s_)};
    for (auto& s : settings) command.insert(command.end(), {"--set", std::move(s)});
    return command;
  }
  std::unique_ptr<test::Child> start(const std::vector<std::string>& command,
                                     const std::string& name) {
    return std::make_unique<test::Child>(command, folder.file(name + ".log"));
  }
  std::unique_ptr<test::Child> startFilter() {
    const auto config = test::sources() / "config";
    return start({(test::programs() / "perdure-semantic-filter").string(), "--set",
                  "class_priors=" + (config / "class_priors.yaml").string(), "--set",
                  "restore.timeout_s=0.2"},
                 "filter");
  }
  std::unique_ptr<test::Child> swap(const std::string& model, double probation_s,
                                    const std::string& name, std::vector<std::string> more = {}) {
    std::vector<std::string> command = {(test::programs() / "perdure").string(),
                                        "inference",
                                        "swap",
                                        "--model",
                                        model,
                                        "--probation",
                                        std::to_string(probation_s),
                                        "--set",
                                        "ownership.period_s=" + std::to_string(period_s_),
                                        "--log",
                                        folder.file(name + ".newcomer.log")};
    command.insert(command.end(), more.begin(), more.end());
    return start(command, name);
  }
  std::string model(const TinyOnnx& net) { return net.write(folder.file("model-" + net.name)); }

  /// Sends one frame with its odometry and waits for one period.
  void sendFrame() {
    const auto begin = std::chrono::steady_clock::now();
    const auto pixels = std::make_shared<const std::vector<std::uint8_t>>(
        64 * 48, static_cast<std::uint8_t>(bright ? 250 : 0));
    Frame frame;
    frame.stamp.source = 77;
    frame.stamp.sequence = next_;
    frame.stamp.time = fromNanoseconds(static_cast<std::int64_t>(next_) * period_.count());
    ++next_;
    frame.camera = "cam0";
    frame.width = 64;
    frame.height = 48;
    frame.data = pixels;
    Odometry odometry;
    odometry.stamp = frame.stamp;
    odometry.instance = 78;
    odometry.world = {5, 0};
    odometry.state = OdometryState::kTracking;
    ASSERT_TRUE(frames_.write(frame));
    ASSERT_TRUE(odometry_.write(odometry));
    for (auto now = begin; now < begin + period_; now = std::chrono::steady_clock::now()) {
      loop_.runOnce(std::min<std::chrono::nanoseconds>(2ms, begin + period_ - now));
    }
  }
  void sendFrames(int n) {
    for (int i = 0; i < n; ++i) sendFrame();
  }
  /// Sends frames until `so` returns true; returns false after `seconds` of frames.
  bool sendUntil(double seconds, const std::function<bool()>& so) {
    const int most = static_cast<int>(seconds / toSeconds(period_));
    for (int n = 0; n < most && !so(); ++n) sendFrame();
    return so();
  }
  bool modelsKnown(std::size_t inferences) {
    return test::runUntil(loop_, [&] {
      return frames_.matched() >= inferences && detections_.matched() >= inferences;
    });
  }
  void sendCalibration() {
    Calibration c;
    c.source = 77;
    c.cameras.push_back(tests::cameraAhead(64, 48, 60));
    ASSERT_TRUE(calibration_.write(c));
  }

  std::uint64_t next() const { return next_; }
  InstanceId heard() const { return last_heard_; }
  /// Returns how many frames in [first, last) have no answer.
  int unanswered(std::uint64_t first, std::uint64_t last) const {
    int count = 0;
    for (std::uint64_t i = first; i < last; ++i) count += !by_frame_.contains(i);
    return count;
  }
  /// Returns how many frames arrived while a network was busy, or were overwritten before it read
  /// them. They are lost by its own rate, not by the swap. The counts are up to a second old.
  int droppedByNetworks() const {
    std::uint64_t dropped = 0;
    for (const auto& [instance, h] : healths_) {
      if (h.process != "inference") continue;
      const auto missed = h.reasons.find("frames_missed");
      dropped += h.dropped + (missed == h.reasons.end() ? 0 : missed->second);
    }
    return static_cast<int>(dropped);
  }
  /// Returns the longest time from a frame to its first answer, in periods.
  int longestWait(std::uint64_t first, std::uint64_t last) const {
    std::uint64_t longest = 0;
    for (const auto& [frame, next] : answered_at_) {
      if (frame >= first && frame < last) longest = std::max(longest, next - frame - 1);
    }
    return static_cast<int>(longest);
  }
  /// Describes the unanswered frames and the notices with their frames, for the analysis of a
  /// failure.
  std::string story(std::uint64_t first, std::uint64_t last) const {
    std::ostringstream text;
    for (const auto& [frame, step] : said_at_) {
      if (frame >= first && frame < last) text << step << " at " << frame << "; ";
    }
    text << "unanswered:";
    for (std::uint64_t i = first; i < last; ++i) {
      if (!by_frame_.contains(i)) text << ' ' << i;
    }
    for (const auto& [instance, h] : healths_) {
      text << "\n"
           << h.process << " " << h.pid << ": in " << h.frames_in << " dropped " << h.dropped;
      for (const auto& [reason, n] : h.reasons) text << ' ' << reason << '=' << n;
    }
    return text.str();
  }
  /// Returns the number of messages beyond the first of each frame; readers drop them.
  int repeated(std::uint64_t first, std::uint64_t last) const {
    int n = 0;
    for (const auto& [frame, who] : by_frame_) {
      if (frame >= first && frame < last) n += static_cast<int>(who.size()) - 1;
    }
    return n;
  }
  std::set<InstanceId> answerers(std::uint64_t first, std::uint64_t last) const {
    std::set<InstanceId> all;
    for (const auto& [frame, who] : by_frame_) {
      if (frame >= first && frame < last) all.insert(who.begin(), who.end());
    }
    return all;
  }
  bool said(SwapStep step, const std::string& reason = "") const {
    return std::any_of(said_.begin(), said_.end(), [&](const SwapNotice& n) {
      return n.step == step && (reason.empty() || n.reason == reason);
    });
  }
  bool happened(const std::string& part) const {
    return std::any_of(happened_.begin(), happened_.end(), [&](const Event& e) {
      return e.kind == EventKind::kModelChanged && e.detail.find(part) != std::string::npos;
    });
  }
  /// Returns the objects that were detected more than once. A box behind another object starts a
  /// tentative object that is hidden from then on, and is forgotten after ten seconds.
  std::set<ObjectId> objectIds() const {
    std::set<ObjectId> ids;
    for (const auto& o : last_objects_.objects) {
      if (o.hits > 1) ids.insert(o.id);
    }
    return ids;
  }
  const Objects& objects() const { return last_objects_; }
  /// Returns the latest Health of the process with this name.
  Health healthOf(const std::string& process) const {
    for (const auto& [instance, h] : healths_) {
      if (h.process == process) return h;
    }
    return {};
  }
  const std::map<std::uint64_t, int>& objectMessages() const { return object_messages_; }
  const std::map<InstanceId, Health>& healths() const { return healths_; }
  void forgetNotices() { said_.clear(), happened_.clear(); }
  std::size_t inferencesHeardOf() const { return detections_.matched(); }
  bus::WaitLoop& loop() { return loop_; }

  test::Folder folder;
  bool bright = false;

 private:
  Duration period_;
  double period_s_;
  bus::Domain domain_{test::ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  bus::Writer<Frame> frames_{participant_, bus::frameTopic("cam0")};
  bus::Writer<Odometry> odometry_{participant_, bus::kTopic<Odometry>};
  bus::Writer<Calibration> calibration_{participant_, bus::kTopic<Calibration>};
  bus::Reader<Detections> detections_{participant_, bus::kTopic<Detections>};
  bus::Reader<Objects> objects_{participant_, bus::kTopic<Objects>};
  bus::Reader<Event> events_{participant_, bus::kTopic<Event>};
  bus::Reader<ModelInfo> models_{participant_, bus::kTopic<ModelInfo>};
  bus::Reader<SwapNotice> notices_{participant_, bus::kTopic<SwapNotice>};
  bus::Reader<Health> health_{participant_, bus::kTopic<Health>};
  bus::WaitLoop loop_{participant_};
  std::uint64_t next_ = 0;
  InstanceId last_heard_ = 0;
  std::map<std::uint64_t, std::vector<InstanceId>> by_frame_;
  std::map<std::uint64_t, std::uint64_t> answered_at_;  ///< the next frame at the time of the
                                                        ///< answer
  std::map<std::uint64_t, int> object_messages_;
  Objects last_objects_;
  std::vector<SwapNotice> said_;
  std::vector<std::pair<std::uint64_t, std::string>> said_at_;  ///< with the next frame at that
                                                                ///< time
  std::vector<Event> happened_;
  std::map<std::string, ModelInfo> known_models_;
  std::map<InstanceId, Health> healths_;
};

}  // namespace perdure::inference::testing
