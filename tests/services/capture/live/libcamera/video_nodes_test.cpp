// Tests the reading of open video nodes, and the removal of one.
#include "services/capture/live/libcamera/video_nodes.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace perdure::capture {
namespace {

TEST(VideoNodes, SeesThatOneThatIsOpenIsThereNoMore) {
  const std::filesystem::path folder =
      ::testing::TempDir() + "/perdure_descriptors_" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  const auto link = [&](const char* name, const char* to) {
    std::filesystem::create_symlink(to, folder / name);
  };
  link("0", "/dev/null");
  link("1", "/dev/video0");
  link("2", "/tmp/video (deleted)");
  EXPECT_FALSE(openVideoNodeVanished(folder));
  link("3", "/dev/video1 (deleted)");
  EXPECT_TRUE(openVideoNodeVanished(folder));
  EXPECT_FALSE(openVideoNodeVanished(folder / "none"));
  std::filesystem::remove_all(folder);
}

TEST(VideoNodes, AFileThatIsNoCameraHasNoBuffers) { EXPECT_TRUE(videoNodesWithBuffers().empty()); }

TEST(VideoNodes, WhatIsTakenAwayHasNothingToReadAndIsStillOpen) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], "image", 5), 5);
  const auto readable = [&] {
    pollfd of{ends[0], POLLIN, 0};
    return poll(&of, 1, 0);
  };
  ASSERT_EQ(readable(), 1);
  takeAway(ends[0]);
  EXPECT_EQ(readable(), 0) << "an image that the driver had given is not seen any more";
  v4l2_buffer buffer{};
  EXPECT_EQ(ioctl(ends[0], VIDIOC_DQBUF, &buffer), -1);
  EXPECT_EQ(errno, ENOTTY);
  pollfd writer{ends[1], 0, 0};
  EXPECT_EQ(poll(&writer, 1, 0), 1);
  EXPECT_TRUE(writer.revents & POLLERR) << "the other end is closed";
  EXPECT_EQ(close(ends[0]), 0);
  EXPECT_EQ(close(ends[1]), 0);
}

}  // namespace
}  // namespace perdure::capture
