// Another vendor's DDS reads `objects` and writes `detections` through the gateway, with the real
// semantic_filter: Fast DDS 2.9 with types that fastddsgen generated from the same IDL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tests/services/run_until.h"
#include "tests/support/camera.h"

namespace perdure {
namespace {

using namespace std::chrono_literals;

Calibration calibration() {
  Calibration c;
  c.source = 77;
  c.cameras = {tests::cameraAhead(640, 480, 500)};
  return c;
}

/// Returns the lines "frame K next N objects M | …" by frame.
std::map<std::uint64_t, std::string> linesOf(const std::string& log) {
  std::map<std::uint64_t, std::string> lines;
  std::istringstream text(log);
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string frame;
    std::uint64_t k = 0;
    if (words >> frame >> k && frame == "frame") lines[k] = line;
  }
  return lines;
}

/// Returns the line that the peer must print for a message.
std::string expected(const Objects& m) {
  std::ostringstream text;
  text << "frame " << m.stamp.sequence << " next " << m.next_id << " objects " << m.objects.size();
  for (const auto& o : m.objects) {
    char line[256];
    std::snprintf(line, sizeof line, " | %lu %s %.3f %.2f %.2f %.2f", o.id, o.best().name.c_str(),
                  o.existence, o.best().mean[0], o.best().mean[1], o.best().mean[2]);
    text << line;
  }
  return text.str();
}

TEST(Interop, FastDdsFeedsDetectionsAndReadsObjects) {
  test::Folder folder;
  const bus::Domain domain(test::ownNetwork());
  const bus::Participant participant(domain, "test");
  bus::Writer<Odometry> odometry(participant, bus::kTopic<Odometry>);
  bus::Writer<Calibration> calibrations(participant, bus::kTopic<Calibration>);
  bus::Reader<Objects> objects(participant, bus::kTopic<Objects>);
  bus::Reader<Detections> detections(participant, bus::kTopic<Detections>);
  bus::Reader<Health> health(participant, bus::kTopic<Health>);
  bus::Reader<ModelInfo> models(participant, bus::kTopic<ModelInfo>);
  bus::WaitLoop loop(participant);
  std::string counts, model;
  loop.on(health, [&](const Health& m) {
    counts.clear();
    for (const auto& [reason, n] : m.reasons) counts += reason + "=" + std::to_string(n) + " ";
  });
  loop.on(models, [&](const ModelInfo& m) { model = m.name; });
  std::map<std::uint64_t, std::string> ours;
  std::size_t boxes = 0, things = 0;
  loop.on(objects, [&](const Objects& m) {
    ours[m.stamp.sequence] = expected(m);
    things = m.objects.size();
  });
  loop.on(detections, [&](const Detections& m) {
    boxes += m.detections.size();
    ASSERT_EQ(m.detections.size(), 1u);
    EXPECT_EQ(m.detections[0].box.x2, 360.25);
    EXPECT_EQ(m.detections[0].activations, (std::vector<float>{0.0F, 4.0F, -4.0F}));
  });
  const test::Child filter(
      {(test::programs() / "perdure-semantic-filter").string(), "--set",
       "class_priors=" + (test::sources() / "config" / "class_priors.yaml").string(), "--set",
       "restore.timeout_s=0.2"},
      folder.file("filter.log"));
  ASSERT_TRUE(calibrations.write(calibration()));
  const test::Child gateway(
      {"/bin/sh", "-c",
       "eval \"$(" + (test::programs() / "perdure").string() + " env)\" && exec " +
           (test::programs() / "final_gateway").string()},
      folder.file("gateway.log"));
  const char* domain_id = std::getenv("PERDURE_DOMAIN");
  const test::Child peer({std::getenv("PERDURE_FAST_PEER"), domain_id ? domain_id : "0", "280.5",
                          "200", "360.25", "270"},
                         folder.file("peer.log"));
  const auto matched = [&] { return odometry.matched() >= 2 && detections.matched() >= 1; };
  ASSERT_TRUE(test::runUntil(loop, matched))
      << odometry.matched() << " readers of odometry, " << detections.matched()
      << " writers of detections; " << peer.log();
  std::uint64_t next = 0;
  const auto send = [&] {
    Odometry pose;
    pose.stamp.source = 77;
    pose.stamp.sequence = next;
    pose.stamp.time = fromNanoseconds(static_cast<std::int64_t>(next) * 100'000'000);
    pose.instance = 78;
    pose.world = {5, 0};
    pose.state = OdometryState::kTracking;
    pose.T_WB.p.x() = 0.005 * static_cast<double>(next++);
    ASSERT_TRUE(odometry.write(pose));
    const auto end = std::chrono::steady_clock::now() + 30ms;
    while (std::chrono::steady_clock::now() < end) loop.runOnce(5ms);
  };
  // Sends until all connections are open. Fast DDS sends latched samples within three seconds.
  while (next < 400 && (boxes == 0 || model.empty() || linesOf(peer.log()).empty())) send();
  constexpr std::uint64_t kFrames = 60, kUnderWay = 5;
  const std::uint64_t first = next;
  boxes = 0;
  while (next < first + kFrames) send();
  EXPECT_GE(boxes, kFrames - kUnderWay) << "detections that Fast DDS wrote and Cyclone DDS read";
  EXPECT_GE(things, 1u) << "the filter believes in what it was fed; " << counts << filter.log();
  EXPECT_EQ(model, "fast");
  std::size_t compared = 0, with_things = 0;
  for (const auto& [frame, line] : linesOf(peer.log())) {
    if (frame < first || !ours.contains(frame)) continue;
    EXPECT_EQ(line, ours.at(frame));
    ++compared;
    with_things += line.find('|') != std::string::npos;
  }
  EXPECT_GE(compared, kFrames - 2 * kUnderWay);
  EXPECT_GE(with_things, kFrames / 2) << "beliefs that Cyclone DDS wrote and Fast DDS read";
}

}  // namespace
}  // namespace perdure
