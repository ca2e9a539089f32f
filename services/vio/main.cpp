// perdure-vio: estimates the pose of the body from camera, IMU and speed.
#include <chrono>
#include <functional>
#include <opencv2/core/utility.hpp>

#include "common/bus/once.h"
#include "common/bus/topics.h"
#include "common/service/service.h"
#include "common/vision/jpeg.h"
#include "services/vio/known_pose_node.h"
#include "services/vio/node.h"
#include "services/vio/state_file.h"

namespace {

using namespace perdure;

/// Decodes the frames of the configured cameras, and delivers each frame once.
class FrameInput {
 public:
  FrameInput(service::Context& context, const vio::Config& config, ReasonCounts& reasons,
             std::function<void(const Frame&)> onFrame)
      : onFrame_(std::move(onFrame)),
        reasons_(reasons),
        once_(config.cameras.size()),
        gaps_(config.cameras.size()) {
    auto& frames = context.needs("frames", "fix the camera, or start capture");
    for (std::size_t i = 0; i < config.cameras.size(); ++i) {
      context.on(bus::frameTopic(config.cameras[i]), [this, &context, &frames, i](const Frame& m) {
        if (!once_[i].first(m.stamp.source, m.stamp.sequence)) {
          return reasons_.add("frames_repeated");
        }
        const auto missed = gaps_[i].before(m.stamp.source, m.stamp.sequence);
        if (missed > 0) reasons_.add("frames_missed", missed);
        if (i == 0) context.health().frameIn();
        // An image that cannot be decoded is dropped. No output is published for it.
        if (hand(m) && i == 0) frames.heard();
      });
    }
  }

 private:
  bool hand(const Frame& frame) {
    const auto pixels = vision::decompressed(frame, ImageEncoding::kMono8);
    if (pixels) onFrame_(*pixels);
    if (!pixels) reasons_.add(pixels.error());
    return pixels.has_value();
  }

  std::function<void(const Frame&)> onFrame_;
  ReasonCounts& reasons_;
  std::vector<bus::Once> once_;
  std::vector<bus::Gaps> gaps_;
};

/// Connects the inputs and outputs that both nodes have. `own` are reasons counted outside the
/// node.
template <class Node>
void connect(service::Context& context, const vio::Config& config, Node& node,
             const ReasonCounts& own) {
  context.countReasons([&]() -> const ReasonCounts& { return node.reasons(); });
  context.countReasons([&]() -> const ReasonCounts& { return own; });
  context.on(bus::kTopic<Calibration>, [&](const Calibration& m) { node.onCalibration(m); });
  if (config.moving_mask.enabled) {
    context.on(bus::kTopic<Objects>, [&](const Objects& m) { node.onObjects(m); });
  }
  context.onHealth([&] { context.health().state(node.health(), node.status()); });
}

void estimate(service::Context& context, const vio::Config& config) {
  const vio::StateFile file(config.state_directory);
  const auto odometry = context.sink(bus::kTopic<Odometry>);
  vio::Node node(config, context.instance(),
                 {.odometry =
                      [&](const Odometry& m) {
                        odometry(m);
                        context.health().frameOut();
                      },
                  .landmarks = context.sink(bus::kTopic<Landmarks>),
                  .calibration = context.sink(bus::kEstimatedCalibration)});
  ReasonCounts own;
  if (const auto text = file.read()) {
    if (const auto restored = node.restoreState(*text); !restored) {
      context.log().warn("the saved state is left aside: {}", restored.error().detail);
      own.add(restored.error());
    }
  }
  connect(context, config, node, own);
  auto& samples = context.needs("inertial samples", "fix the IMU, or start capture");
  context.on(bus::kTopic<ImuSample>, [&](const ImuSample& m) {
    samples.heard();
    node.onImu(m);
  });
  context.on(bus::kTopic<SpeedSample>, [&](const SpeedSample& m) { node.onSpeed(m); });
  const FrameInput frames(context, config, own, [&](const Frame& m) { node.onFrame(m); });
  context.every(std::chrono::seconds(1), [&] {
    if (const auto kept = file.write(node.saveState()); !kept) own.add(kept.error());
  });
  context.run();
}

void followGivenPoses(service::Context& context, const vio::Config& config) {
  const auto landmarks = context.sink(bus::kTopic<Landmarks>);
  vio::KnownPoseNode node(config, context.instance(), [&](const Landmarks& m) {
    landmarks(m);
    context.health().frameOut();
  });
  ReasonCounts own;
  connect(context, config, node, own);
  auto& poses = context.needs("odometry", "start the program that gives the poses");
  context.on(bus::kTopic<Odometry>, [&](const Odometry& m) {
    poses.heard();
    node.onOdometry(m);
  });
  const FrameInput frames(context, config, own, [&](const Frame& m) { node.onFrame(m); });
  context.run();
}

void serve(service::Context& context, const vio::Config& config) {
  cv::setNumThreads(1);  // images are too small to gain from threads
  config.odometry == "given" ? followGivenPoses(context, config) : estimate(context, config);
}

}  // namespace

int main(int argc, char** argv) {
  vio::Config config;
  return service::runService(
      argc, argv,
      {.process = "vio",
       .summary = "Where the body is: odometry and sparse points from camera, IMU and speed.",
       .describe = [&](config::Fields& fields) { vio::describe(config, fields); },
       .body = [&](service::Context& context) { serve(context, config); }});
}
