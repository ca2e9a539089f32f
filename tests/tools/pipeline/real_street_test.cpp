// The pipeline on KITTI tracking with given poses and boxes, if the data is available.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "common/replay/files/text_file.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tools/evaluate/object_score.h"
#include "tools/pipeline/pipeline.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

class RealStreet : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::is_directory(root()))
      GTEST_SKIP() << root() << " is absent: the real street is not run";
  }
  static fs::path root() {
    return fs::path(std::getenv("PERDURE_SOURCE")) / "../shared/data/kitti_tracking";
  }
  static PipelineOptions options(const std::string& sequence, const fs::path& out) {
    PipelineOptions options;
    options.data = root().string();
    options.sequence = sequence;
    options.odometry = (root() / "poses_orb" / (sequence + ".txt")).string();
    options.detections = (root() / "det_rrc_azimuth" / (sequence + ".csv")).string();
    options.out = out.string();
    return options;
  }
  static void run(const PipelineOptions& options) {
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
  }
  static Cell cellOf(const fs::path& out, const char* csv, const std::string& sequence) {
    const auto labels = replay::readKittiLabels(root() / "label_02" / (sequence + ".txt"));
    auto calibration = replay::readTrackingCalibration(root() / "calib" / (sequence + ".txt"));
    const auto size = replay::trackingImageSize(sequence);
    calibration.width = size.width, calibration.height = size.height;
    auto rows = readObjectRows(out / csv);
    std::erase_if(rows, [](const EstimateRow& row) { return row.class_name != "car"; });
    const auto poses = posesByFrame(replay::PoseFile::read(out / "trajectory.tum").poses(), rows);
    const auto truth = sortTruth(labels, staticTracks(labels, calibration.T_RI, poses));
    return scoreObjects(rows, truth, poses, calibration, {}).cells[2][2];
  }
};

// A quarter of a pixel may decide to which of two cars a box beside a van belongs. The street is
// therefore run five times with shifted boxes, and the median run counts. A car that is detected
// twenty frames late is accepted; one that is never detected is not.
TEST_F(RealStreet, TheParkedCarsOfSequence0000AreFound) {
  std::vector<double> recall, precision, inst_recall, inst_precision;
  for (const double origin : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const fs::path out = replay::freshFolder("street_0000");
    auto shifted = options("0000", out);
    shifted.box_origin = origin;
    run(shifted);
    const Cell final_rows = cellOf(out, "objects_final.csv", "0000");
    const Cell inst = cellOf(out, "objects_inst.csv", "0000");
    EXPECT_EQ(final_rows.truth, 61U);
    recall.push_back(final_rows.recall()), precision.push_back(final_rows.precision());
    inst_recall.push_back(inst.recall()), inst_precision.push_back(inst.precision());
  }
  const auto middle = [](std::vector<double>& v) {
    std::nth_element(v.begin(), v.begin() + 2, v.end());
    return v[2];
  };
  EXPECT_GE(middle(recall), 0.80);
  EXPECT_GE(middle(precision), 0.75);
  EXPECT_GE(middle(inst_recall), 0.70);
  EXPECT_GE(middle(inst_precision), 0.80);
}

TEST_F(RealStreet, TwoRunsGiveIdenticalBytes) {
  const fs::path out = replay::freshFolder("street_twice");
  run(options("0003", out / "one"));
  run(options("0003", out / "two"));
  for (const char* file : {"objects_inst.csv", "objects_final.csv", "objects.json", "events.jsonl",
                           "trajectory.tum", "map.geojson"}) {
    EXPECT_EQ(replay::readText(out / "one" / file), replay::readText(out / "two" / file)) << file;
  }
}

TEST_F(RealStreet, InstUpToFrame100IsTheSameWhenTheDetectionsAreCutThere) {
  const fs::path out = replay::freshFolder("street_prefix");
  const auto upTo100 = [](const fs::path& file, std::size_t column) {
    std::string text;
    for (const auto& line : replay::readLines(file, "")) {
      const auto frame = replay::parseInteger(replay::split(line.text, ',')[column]);
      if (frame.value_or(0) <= 100) text += line.text + "\n";
    }
    return text;
  };
  auto cut = options("0000", out / "cut");
  replay::writeText(out / "cut.csv", upTo100(cut.detections, 0));
  cut.detections = (out / "cut.csv").string();
  run(options("0000", out / "whole"));
  run(cut);
  EXPECT_EQ(upTo100(out / "whole/objects_inst.csv", 1), upTo100(out / "cut/objects_inst.csv", 1));
}

TEST_F(RealStreet, EverySequenceRunsWithoutLabelsToo) {
  const fs::path folder = replay::freshFolder("street_unlabelled");
  fs::create_directories(folder / "data");
  fs::create_directory_symlink(fs::canonical(root() / "calib"), folder / "data/calib");
  for (const std::string sequence : {"0012", "0017"}) {
    auto unlabelled = options(sequence, folder / sequence);
    unlabelled.data = (folder / "data").string();
    run(unlabelled);
    EXPECT_TRUE(fs::exists(folder / sequence / "objects_final.csv"));
  }
}

}  // namespace
}  // namespace perdure::tools
