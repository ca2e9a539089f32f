// Tests whole runs of `perdure simulate`: the outputs, equal repeated and resumed runs, and invalid
// input.
#include "tools/simulate/simulate.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "common/base/errors.h"
#include "common/replay/dataset.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

fs::path freshFolder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("perdure_simulate_" + name);
  fs::remove_all(folder);
  return folder;
}

SimulateOptions roomInto(const fs::path& out) {
  SimulateOptions options;
  options.scene = "room";
  options.seed = 3;
  options.out = out;
  options.world.seconds = 0.5;
  options.world.width = 96, options.world.height = 72;
  options.world.rate_hz = 10.0;
  return options;
}

/// Returns the content of every file by its path in the folder.
std::map<std::string, std::string> contentsOf(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    std::ostringstream bytes;
    bytes << stream.rdbuf();
    contents[fs::relative(entry.path(), folder).string()] = bytes.str();
  }
  return contents;
}

void expectSameFolders(const fs::path& a, const fs::path& b) {
  const auto first = contentsOf(a), second = contentsOf(b);
  ASSERT_EQ(first.size(), second.size());
  for (const auto& [name, bytes] : first)
    EXPECT_TRUE(second.contains(name) && second.at(name) == bytes) << name;
}

TEST(Simulate, GivesTheSameBytesAgainWhateverTheNumberOfThreads) {
  auto options = roomInto(freshFolder("one_thread"));
  options.threads = 1;
  EXPECT_TRUE(simulate(options, {}));
  auto again = roomInto(freshFolder("two_threads"));
  EXPECT_TRUE(simulate(again, {}));
  expectSameFolders(options.out, again.out);
  EXPECT_EQ(contentsOf(again.out).count("mav0/cam0/data/1000000000000.png"), 1U);
}

TEST(Simulate, CarriesOnWhereItWasCutAndEndsWithTheSameBytes) {
  const auto whole = roomInto(freshFolder("whole"));
  simulate(whole, {});
  const auto cut = roomInto(freshFolder("cut"));
  EXPECT_THROW(simulate(cut,
                        [](const SimulateProgress& progress) {
                          if (progress.frame == 3) throw std::runtime_error("cut");
                        }),
               std::runtime_error);
  EXPECT_FALSE(fs::exists(cut.out / "visibility_truth.csv"));
  // Simulates that the last image was not written to the disk.
  fs::remove(cut.out / "mav0/cam0/data/1000200000000.png");
  std::size_t resumed = 0;
  EXPECT_TRUE(simulate(cut, [&](const SimulateProgress& progress) { resumed = progress.resumed; }));
  EXPECT_EQ(resumed, 2U);
  expectSameFolders(whole.out, cut.out);
  EXPECT_FALSE(simulate(cut, {})) << "it is complete";
  fs::remove(cut.out / "mav0/cam0/data/1000200000000.png");
  EXPECT_TRUE(simulate(cut, {})) << "an image is missing";
  expectSameFolders(whole.out, cut.out);
}

TEST(Simulate, AFolderBelongsToOneProcessAndIsWholeAtTheEnd) {
  const auto options = roomInto(freshFolder("shared"));
  const auto refuses = [&](const std::function<void()>& during) {
    fs::remove_all(options.out);
    try {
      simulate(options, [&](const SimulateProgress& progress) {
        if (progress.frame == 5) during();
      });
    } catch (const StartupError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refuses([&] { simulate(options, {}); }), HasSubstr("another process (process"));
  EXPECT_THAT(refuses([&] {
                while (!fs::remove(options.out / "mav0/cam0/data/1000000000000.png")) continue;
              }),
              HasSubstr("were removed while it was written"));
  EXPECT_THAT(refuses([&] {
                fs::remove_all(options.out);
                simulate(options, {});
              }),
              HasSubstr("were removed while it was written"));
}

TEST(Simulate, WritesAFolderThatTheDatasetReaderReads) {
  auto options = roomInto(freshFolder("read"));
  options.world.stereo = true;
  options.world.mono8 = true;
  options.format = ImageFormat::kJpeg;
  simulate(options, {});
  replay::DatasetOptions wanted;
  wanted.path = options.out;
  const auto dataset = replay::Dataset::open(wanted);
  EXPECT_EQ(dataset->frameCount(), 5U);
  ASSERT_EQ(dataset->calibration().cameras.size(), 2U);
  const sim::Scene scene = sim::makeScene("room", 3, options.world);
  const auto& was = scene.rig.calibration.cameras[1];
  const auto& is = dataset->calibration().cameras[1];
  EXPECT_EQ(is.fx, was.fx);
  EXPECT_EQ(is.distortion_coefficients, was.distortion_coefficients);
  EXPECT_LT((is.T_BC.matrix() - was.T_BC.matrix()).norm(), 1e-12);
  EXPECT_EQ(is.rate_hz, 10.0);
  std::size_t frames = 0, samples = 0;
  while (const auto message = dataset->next()) {
    if (const auto* frame = std::get_if<Frame>(&*message)) {
      EXPECT_EQ(frame->width, 96U);
      ++frames;
    }
    samples += std::holds_alternative<ImuSample>(*message);
  }
  EXPECT_EQ(frames, 10U);
  EXPECT_GE(samples, 100U);
  EXPECT_TRUE(dataset->reasons().all().empty());
  ASSERT_TRUE(dataset->truth());
  const TimePoint end = kSceneEpoch + durationFromSeconds(0.4);
  for (const auto& pose : dataset->truth()->poses()) {
    if (pose.time != end) continue;
    EXPECT_LT((pose.T_WB.p - scene.body.poseAt(0.4).p).norm(), 1e-9);
  }
}

TEST(Simulate, WithoutImagesHasTheTruthOfTheSameFrames) {
  const auto drawn = roomInto(freshFolder("drawn"));
  simulate(drawn, {});
  auto options = roomInto(freshFolder("truth_only"));
  options.images = false;
  simulate(options, {});
  EXPECT_TRUE(fs::is_empty(options.out / "mav0/cam0/data"));
  const auto with = sim::readTruth(drawn.out), without = sim::readTruth(options.out);
  EXPECT_EQ(with.objects.size(), without.objects.size());
  ASSERT_EQ(with.views.size(), without.views.size());
  ASSERT_FALSE(with.views.at(0).empty());
  for (const auto& [frame, views] : with.views) {
    const auto& coarse = without.views.at(frame);
    ASSERT_EQ(views.size(), coarse.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      EXPECT_EQ(views[i].object_id, coarse[i].object_id);
      EXPECT_EQ(views[i].box.x1, coarse[i].box.x1);
      if (views[i].box.area() < 400.0) continue;
      EXPECT_NEAR(views[i].visible_fraction, coarse[i].visible_fraction, 0.15);
    }
  }
}

TEST(Simulate, DrawsEachSoManyThFrameAndNumbersThemFromNought) {
  auto options = roomInto(freshFolder("every"));
  options.every = 2;
  simulate(options, {});
  const auto contents = contentsOf(options.out);
  EXPECT_EQ(contents.count("mav0/cam0/data/1000100000000.png"), 0U);
  EXPECT_EQ(contents.count("mav0/cam0/data/1000400000000.png"), 1U);
  EXPECT_NE(contents.at("mav0/cam0/sensor.yaml").find("rate_hz: 5\n"), std::string::npos);
  EXPECT_EQ(sim::readTruth(options.out).views.rbegin()->first, 2U);
}

ExitCode refusalOf(const SimulateOptions& options) {
  try {
    simulate(options, {});
  } catch (const StartupError& error) {
    return error.code();
  }
  return ExitCode::kOk;
}

TEST(Simulate, RefusesUnknownScenesAndFoldersOfSomethingElse) {
  auto options = roomInto(freshFolder("refused"));
  options.scene = "moon";
  EXPECT_EQ(refusalOf(options), ExitCode::kUsage);
  EXPECT_FALSE(fs::exists(options.out));
  options.scene = "room";
  fs::create_directories(options.out);
  std::ofstream(options.out / "thesis.tex") << "dear";
  EXPECT_EQ(refusalOf(options), ExitCode::kUsage);
  EXPECT_EQ(contentsOf(options.out).size(), 1U);
  fs::remove(options.out / "thesis.tex");
  options.images = false;
  EXPECT_EQ(refusalOf(options), ExitCode::kOk);
  options.seed = 4;
  EXPECT_EQ(refusalOf(options), ExitCode::kUsage);
}

}  // namespace
}  // namespace perdure::tools
