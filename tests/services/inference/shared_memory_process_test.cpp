// Tests a real inference process that reads images from shared memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>

#include "tests/services/inference/service_rig.h"
#include "tests/services/inference/tiny_model.h"

namespace perdure::inference {
namespace {

using namespace std::chrono_literals;
using test::Child;
using Rig = testing::ServiceRig;

TEST(InferenceService, LooksAtImagesInSharedMemoryAndStillHearsItself) {
  if (!findProgram("iox-roudi")) {
    GTEST_SKIP() << "iox-roudi is not installed: deploy/install --runtime";
  }
  if (!test::ownFiles())
    GTEST_SKIP()
        << "no /tmp of one's own: mount is not allowed here, or the programs are below /tmp";
  test::Folder folder;
  Child roudi({"iox-roudi", "-m", "off", "-c", (test::sources() / "deploy/roudi.toml").string()},
              folder.file("roudi.log"));
  ASSERT_TRUE(test::eventually(10s, [&] {
    return roudi.log().find("RouDi is ready") != std::string::npos;
  })) << roudi.log();
  bus::Options options = test::ownNetwork();
  options.shared_memory_mb = 8;
  const std::string model = testing::TinyModel{}.write(folder.file("model"));
  Rig rig(options, {"--set", "model.path=" + model, "--set", "bus.shared_memory_mb=8"});
  for (int i = 0; i < 20; ++i) {
    rig.send(64, 64);
    ASSERT_TRUE(rig.answered(rig.sent - 1)) << rig.service->log();
  }
  EXPECT_TRUE(
      rig.until([&] { return rig.health.reasons.contains("frame_cam0_in_shared_memory"); }));
  EXPECT_TRUE(rig.until([&] { return rig.health.reasons["frame_cam0_in_shared_memory"] == 20; }));
  EXPECT_TRUE(rig.until([&] {
    rig.send(64, 64);  // otherwise Health reports missing frames
    return rig.health.message == "images go through shared memory";
  }));
  EXPECT_FALSE(rig.health.reasons.contains("detections_incompatible_qos"));
  roudi.signal(SIGKILL);
  EXPECT_TRUE(rig.until([&] { return rig.health.message.starts_with("RouDi is gone"); }));
  rig.send(64, 64);
  EXPECT_TRUE(rig.answered(rig.sent - 1)) << "it goes on";
  rig.service->signal(SIGTERM);
  EXPECT_EQ(rig.service->wait(5s), 0) << rig.service->log();
}

}  // namespace
}  // namespace perdure::inference
