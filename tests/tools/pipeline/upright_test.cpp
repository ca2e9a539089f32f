// A rendered room whose camera is mounted turned by 90° or 180°: network and filter find as
// much as with an upright camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "tests/common/replay/tiny_datasets.h"
#include "tools/evaluate/object_rows.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/pipeline/pipeline.h"
#include "tools/simulate/simulate.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

/// Mounts the camera so that its images are upright after clockwise turns.
void mount(CameraCalibration& camera, int quarters) {
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  camera.distortion_coefficients = {-0.12, 0.02, 0.0, 0.0};
  for (int i = 0; i < quarters; ++i) {
    const double across = camera.width - 1.0 - camera.cx;
    camera.cx = std::exchange(camera.cy, across);
    std::swap(camera.width, camera.height);
    camera.T_BC = camera.T_BC * RigidTransform(quarter, Eigen::Vector3d::Zero());
  }
}

fs::path render(int quarters) {
  SimulateOptions options;
  options.scene = "room";
  options.world.seconds = 12.0;
  options.world.rate_hz = 5.0;
  options.world.noise = false;
  options.out = replay::freshFolder("upright_" + std::to_string(quarters));
  sim::Scene scene = sim::makeScene(options.scene, options.seed, options.world);
  mount(scene.rig.calibration.cameras.front(), quarters);
  mount(scene.rig.true_calibration.cameras.front(), quarters);
  simulate(scene, options, {});
  return options.out;
}

struct Score {
  Cell boxes;    ///< boxes that are no clutter, IoU 0.5
  Cell objects;  ///< score of the map's objects at each frame, within 1.5 m
};

void count(const std::vector<sim::TruthView>& views, const CameraModel& camera,
           const FrameGlance& frame, Cell& cell) {
  std::vector<Box> boxes;
  for (const DetectionGlance& d : frame.detections) {
    if (d.probability > 0.5) boxes.push_back(sim::clipped(d.box, camera.width(), camera.height()));
  }
  for (const auto& view : views) {
    const Box truth = view.boxInside(camera.width(), camera.height());
    const auto best = std::max_element(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
      return intersectionOverUnion(a, truth) < intersectionOverUnion(b, truth);
    });
    const bool found = best != boxes.end() && intersectionOverUnion(*best, truth) >= 0.5;
    if (found) boxes.erase(best);
    const bool counts = view.visible_fraction > 0.5 && truth.area() > 400.0;
    cell.truth += counts, cell.matched += counts && found;
  }
  cell.false_alarms += boxes.size();
}

Score lookAt(const fs::path& drive, const std::vector<std::string>& assignments = {}) {
  PipelineOptions options;
  options.data = drive.string();
  options.odometry = "truth";
  options.detections = "model";
  options.model =
      (fs::path(std::getenv("PERDURE_SOURCE")) / "models/perdure_320x240.onnx").string();
  options.out = (drive / "out").string();
  options.assignments = assignments;
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  pipeline.finish();
  const SimulatedTruth truth = readSimulatedTruth(drive);
  Score score;
  for (const auto& [number, frame] : pipeline.outputs().log().frames()) {
    const auto views = truth.truth.views.find(number);
    if (views != truth.truth.views.end()) count(views->second, truth.camera, frame, score.boxes);
  }
  const auto poses = replay::PoseFile::read(drive / "out" / "trajectory.tum").poses();
  const auto rows = readObjectRows(drive / "out" / "objects_inst.csv");
  score.objects = scoreFrames(pairWithTruth(truth, rows, poses, "").frames, {}).cells[2][2];
  for (const auto& [name, cell] : {std::pair("boxes", score.boxes), {"objects", score.objects}}) {
    std::printf("%s of %s: recall %.3f of %d, precision %.3f\n", name, drive.filename().c_str(),
                cell.recall(), static_cast<int>(cell.truth), cell.precision());
  }
  return score;
}

TEST(Upright, ARoomIsFoundByATurnedCameraAsByAnUprightOne) {
  const Score upright = lookAt(render(0));
  EXPECT_GT(upright.boxes.recall(), 0.5);
  EXPECT_GT(upright.objects.recall(), 0.5);
  for (const int quarters : {1, 2}) {
    const fs::path drive = render(quarters);
    const Score turned = lookAt(drive);
    EXPECT_EQ(turned.boxes.truth, upright.boxes.truth);
    EXPECT_NEAR(turned.boxes.recall(), upright.boxes.recall(), 0.02);
    EXPECT_NEAR(turned.boxes.precision(), upright.boxes.precision(), 0.02);
    EXPECT_GT(turned.objects.recall(), upright.objects.recall() - 0.02);
    EXPECT_GT(turned.objects.precision(), upright.objects.precision() - 0.02);
    if (quarters == 2) continue;
    const Score as_is = lookAt(drive, {"inference.detection.turn=0"});
    EXPECT_LT(as_is.boxes.recall(), 0.2) << "the network needs the turn";
  }
}

}  // namespace
}  // namespace perdure::tools
