// Detections in formats and units that are not those of the table.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/replay/files/boxes/detection_file.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr char kPlain[] = "frame,class,x1,y1,x2,y2,score\n";

DetectionFile readBoxes(const std::string& text, const std::string& name = "d.csv") {
  DetectionFileOptions options;
  options.file = freshFolder("foreign_boxes") / name;
  options.width = 320, options.height = 240;
  options.numbers = {{"000000", 0}, {"000007", 1}};
  writeText(options.file, text);
  return DetectionFile::read(options, ClassAliases());
}
std::string errorOf(const std::string& text) {
  return startupErrorOf([&] { readBoxes(text); });
}
/// Rows of boxes that end at `right` and `bottom` each fourth time.
std::string rowsTo(int right, int bottom) {
  std::string text = kPlain;
  for (int k = 0; k < 40; ++k) {
    const bool end = k % 4 == 0;
    const std::string corner = std::to_string(k);
    text += "0,car," + corner + "," + corner + "," +
            std::to_string(end ? right : right / 2 + k % 9) + "," +
            std::to_string(end ? bottom : bottom / 2 + k % 9) + ",.9\n";
  }
  return text;
}

TEST(ForeignBoxes, LabelsOfKittiTrackingAreRead) {
  const auto file = readBoxes(
      "0 -1 DontCare -1 -1 -10 219 188 245 218 -1000 -1000 -1000 -10 -1 -1 -1\n"
      "7 0 Van 0 0 -1.79 29 61 45 92 2 1.8 4.4 -4.5 1.8 13.4 -2.1\n");
  ASSERT_EQ(file.rows(), 1U);
  const auto boxes = file.at(7);
  ASSERT_EQ(boxes->size(), 1U);
  EXPECT_EQ(boxes->front().box.y2, 92.0);
  EXPECT_EQ(file.classCounts().begin()->first, "van");
  EXPECT_EQ(readBoxes("0 -1 Car 0 0 0 2 1 9 7 -1 -1 -1 -1000 -1000 -1000 -10 .4\n").rows(), 1U);
}

TEST(ForeignBoxes, FramesMayBeNamesOfImages) {
  EXPECT_EQ(readBoxes(std::string(kPlain) + "000007.png,car,1,2,9,9,.9\n").firstFrame(), 1U);
  EXPECT_EQ(readBoxes(std::string(kPlain) + "5,car,1,2,9,9,.9\n").firstFrame(), 5U);
}

TEST(ForeignBoxes, PercentAndScoresOfZeroAreRefused) {
  EXPECT_THAT(errorOf(rowsTo(100, 99)), AllOf(HasSubstr("percent"), HasSubstr("divide by 100")));
  EXPECT_EQ(errorOf(rowsTo(200, 99)), "");
  EXPECT_THAT(errorOf(std::string(kPlain) + "0,car,1,2,9,9,0\n"), HasSubstr("all scores are 0"));
}

TEST(ForeignBoxes, BordersOfOtherImagesAreFound) {
  EXPECT_EQ(readBoxes(rowsTo(319, 239)).whyBeyond(), "");
  EXPECT_THAT(readBoxes(rowsTo(255, 191)).whyBeyond(), HasSubstr("10 boxes end at x = 255"));
  EXPECT_EQ(readBoxes(rowsTo(255, 239)).whyBeyond(), "") << "a pillar may hide the right side";
  EXPECT_THAT(readBoxes(rowsTo(319, 279)).whyBeyond(), HasSubstr("y = 279"));
  EXPECT_THAT(readBoxes(rowsTo(239, 319)).whyBeyond(), HasSubstr("x and y are exchanged"));
}

TEST(ForeignBoxes, FoldersOfLabelsAreNamedWithACommand) {
  const auto errorIn = [](const std::string& name, const std::string& text) {
    const auto folder = freshFolder("foreign_boxes") / "labels";
    std::filesystem::create_directories(folder);
    writeText(folder / name, text);
    DetectionFileOptions options;
    options.file = folder, options.width = 320, options.height = 240;
    return startupErrorOf([&] { DetectionFile::read(options, ClassAliases()); });
  };
  EXPECT_THAT(errorIn("000001.txt", "2 .5 .5 .1 .2\n"),
              AllOf(HasSubstr("YOLO's labels"), HasSubstr("awk"), HasSubstr("*320")));
  EXPECT_THAT(errorIn("000001.txt", "Car 0 0 1 2 3 4 5 -1 -1 -1 -9 -9 -9 0 .7\n"),
              HasSubstr("KITTI's labels"));
  EXPECT_THAT(errorIn("1.xml", "<annotation>\n"), HasSubstr("Pascal VOC's labels"));
  EXPECT_THAT(errorIn("notes.md", "none\n"), HasSubstr("is a folder"));
}

TEST(ForeignBoxes, OtherJsonIsNamedByItsKeys) {
  EXPECT_THAT(errorOf(R"([{"frame": 0, "detections": []}])"),
              AllOf(HasSubstr("the keys detections, frame"), HasSubstr("image_id, category_id")));
}

}  // namespace
}  // namespace perdure::replay
