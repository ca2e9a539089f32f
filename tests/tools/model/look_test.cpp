// Tests the drawings and comparisons of `perdure model` on a network with known answers.
#include "tools/model/look.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "common/base/errors.h"
#include "tests/services/inference/tiny_onnx.h"
#include "tools/model/check.h"
#include "tools/model/importer.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("perdure_look_" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  fs::path path_;
};

template <class Action>
std::string messageOf(const Action& action) {
  try {
    action();
  } catch (const StartupError& e) {
    return e.what();
  }
  return "nothing was said";
}

void writeFloats(const fs::path& file, const std::vector<float>& values) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(float)));
}

TEST(Look, ScoresAreTheNetworksOwnWithoutCalibration) {
  const Folder folder;
  const auto network = inference::testing::TinyOnnx{}.write(folder.path_);
  const Look look = lookAt(network, nullptr, 0.05);
  ASSERT_FALSE(look.sights.empty());
  EXPECT_EQ(look.sights[0].name, "car");
  // The logit against the background is 1; the calibration of its model.json, T = 2 and c = 3/4, is
  // removed.
  EXPECT_NEAR(look.sights[0].score, 1 / (1 + std::exp(-1.0)), 1e-4);
  for (const Sight& s : look.sights) EXPECT_GE(s.score, 0.05);
}

TEST(Look, DrawsIntoACopyOfThePicture) {
  const Folder folder;
  const Frame ramp = greyRamp(64, 48);
  const auto bytesOf = [](const Frame& frame) {
    return std::vector<std::uint8_t>(frame.data->begin(), frame.data->end());
  };
  const auto before = bytesOf(ramp);
  drawSights(ramp, {{{10, 20, 40, 40}, "car", 0.5}, {{-500, -500, 900, 900}, "bus", 0.2}},
             folder.path_ / "seen.png");
  EXPECT_EQ(bytesOf(ramp), before);
  const Frame drawn = readPicture(folder.path_ / "seen.png");
  ASSERT_EQ(drawn.data->size(), before.size());
  EXPECT_NE(bytesOf(drawn), before);
}

TEST(Look, SaysWhatIsMissing) {
  EXPECT_THAT(messageOf([] { readPicture("/nowhere.jpg"); }), HasSubstr("give --image a"));
  EXPECT_THAT(messageOf([] { drawSights(greyRamp(8, 8), {}, "/nowhere/seen.png"); }),
              HasSubstr("/nowhere/seen.png cannot be written"));
  for (const char* name : {"seen", "a.b/seen", "seen.", "seen.abc"}) {
    EXPECT_THAT(messageOf([&] { drawSights(greyRamp(8, 8), {}, name); }),
                HasSubstr(std::string("--out ") + name + ": a drawing is a .png or a .jpg"));
  }
  EXPECT_THAT(messageOf([] { lookAt("/nowhere.onnx", nullptr, 0.5); }), HasSubstr("is missing"));
}

TEST(Look, SaysThatTheDiskIsFull) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  const Folder folder;
  fs::create_symlink("/dev/full", folder.path_ / "seen.png");
  try {
    drawSights(greyRamp(8, 8), {}, folder.path_ / "seen.png");
    FAIL() << "nothing was said";
  } catch (const StartupError& e) {
    EXPECT_EQ(e.code(), ExitCode::kInputOutput);
    EXPECT_THAT(e.what(), HasSubstr("No space left on device; free space"));
  }
}

TEST(Check, TellsAnswersThatDifferAndTensorsOfAnotherSize) {
  const Folder folder;
  const auto network = inference::testing::TinyOnnx{}.write(folder.path_);
  writeFloats(folder.path_ / "input.f32", std::vector<float>(3 * 48 * 64, 0.25F));
  const auto planes = [](std::vector<float> channels) {
    std::vector<float> all;
    for (const float c : channels) all.insert(all.end(), 4, c);
    return all;
  };
  writeFloats(folder.path_ / "box32.f32", planes({0.5F, 1.0F, -0.5F, 2.0F}));
  writeFloats(folder.path_ / "logits32.f32", planes({0.0F, 1.0F, -2.0F}));
  writeFloats(folder.path_ / "azimuth32.f32", planes({0, 6, 0, 0, 0, 0.5F, 0, 0}));
  EXPECT_LT(checkAnswers(network, folder.path_).difference, 1e-6);
  writeFloats(folder.path_ / "logits32.f32", planes({0.0F, 1.0F, -2.5F}));
  const Answers wrong = checkAnswers(network, folder.path_);
  EXPECT_EQ(wrong.tensor, "logits32");
  EXPECT_NEAR(wrong.difference, 0.5 / 2.5, 1e-6);
  writeFloats(folder.path_ / "logits32.f32", planes({NAN, 1.0F, -2.0F}));
  EXPECT_GT(checkAnswers(network, folder.path_).difference, kMostDifference);
  writeFloats(folder.path_ / "box32.f32", {1.0F});
  EXPECT_THAT(messageOf([&] { checkAnswers(network, folder.path_); }),
              HasSubstr("the network gives a tensor of 16 values"));
}

TEST(Import, NamesItsFilesByTheNetwork) {
  EXPECT_EQ(importedPath("a/net.onnx", ""), "a/net.perdure.onnx");
  EXPECT_EQ(importedPath("a/net.v2.onnx", "b"), "b/net.v2.perdure.onnx");
}

}  // namespace
}  // namespace perdure::tools
