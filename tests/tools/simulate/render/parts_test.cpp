// Tests the renderer's parts that need no scene.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "tests/tools/simulate/render/small_world.h"
#include "tools/simulate/journal.h"
#include "tools/simulate/render/counter_noise.h"
#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/surface.h"
#include "tools/simulate/render/workers.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

TEST(Workers, DoEachTaskOnceWhateverTheirNumber) {
  for (const int threads : {1, 2, 5}) {
    Workers workers(threads);
    std::vector<std::atomic<int>> done(1000);
    for (int round = 0; round < 3; ++round) {
      workers.run(done.size(), [&](std::size_t i) { ++done[i]; });
    }
    for (const auto& count : done) ASSERT_EQ(count, 3);
  }
}

TEST(Workers, HandOnTheFirstFailure) {
  Workers workers(2);
  EXPECT_THROW(workers.run(100,
                           [](std::size_t i) {
                             if (i == 7) throw std::runtime_error("seven");
                           }),
               std::runtime_error);
  std::atomic<int> count = 0;
  workers.run(10, [&](std::size_t) { ++count; });
  EXPECT_EQ(count, 10);
}

TEST(Workers, FinishWhatWasPostedAndSayWhenItFailed) {
  for (const int threads : {1, 2}) {
    Workers workers(threads);
    std::atomic<int> done = 0;
    for (int i = 0; i < 20; ++i) workers.post([&done] { ++done; });
    workers.drain();
    EXPECT_EQ(done, 20);
  }
  Workers workers(2);
  workers.post([] { throw std::runtime_error("the disk is full"); });
  EXPECT_THROW(workers.drain(), std::runtime_error);
}

TEST(CounterNoise, IsNormalWithUnitDeviation) {
  double sum = 0.0, squares = 0.0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    const double n = normalOf(mixBits(1, static_cast<std::uint64_t>(i)));
    sum += n, squares += n * n;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / kDraws), 1.0, 0.01);
}

TEST(Lens, RaysGoThroughThePixelsThatTheModelProjectsThemTo) {
  const Lens lens(emptyWorld().rig.calibration.cameras[0]);
  for (const int column : {0, 40, 80, 159}) {
    for (const int row : {0, 60, 119}) {
      ASSERT_TRUE(lens.sees(column, row));
      const auto centre = lens.model().project(lens.direction(column, row).cast<double>());
      ASSERT_TRUE(centre);
      EXPECT_NEAR((*centre - Eigen::Vector2d(column, row)).norm(), 0.0, 1e-3);
      const auto beside =
          lens.model().project(lens.direction(column, row, 0.4F, -0.3F).cast<double>());
      EXPECT_NEAR((*beside - Eigen::Vector2d(column + 0.4, row - 0.3)).norm(), 0.0, 1e-2);
    }
  }
}

TEST(Lens, CarriesOnBeyondTheRangeInWhichDistortionMakesSense) {
  CameraCalibration camera = emptyWorld().rig.calibration.cameras[0];
  camera.distortion_coefficients = {-0.3, 0.0, 0.0, 0.0};
  const Lens lens(camera);
  double last = camera.cx;
  for (double x = 0.1; x < 10.0; x *= 1.3) {
    const double column = lens.projectBeyond({x, 0.0, 1.0}).x();
    EXPECT_GT(column, last);
    last = column;
  }
  EXPECT_FALSE(lens.model().project({5.0, 0.0, 1.0}));
}

TEST(Surface, RefusesMeshesWhoseListsDoNotFit) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals.assign(3, Eigen::Vector3f::UnitZ());
  mesh.uvs = {{0, 0}, {2, 0}, {0, 2}};
  mesh.triangles = {{0, 1, 2}};
  mesh.material_of = {0};
  mesh.materials.resize(1);
  Surface surface;
  surface.add(mesh);
  EXPECT_NEAR(surface.facets[0].repeats_per_metre, 2.0, 1e-6);
  mesh.triangles = {{0, 1, 3}};
  EXPECT_THROW(surface.add(mesh), std::invalid_argument);
}

JournalEntry entry(int i) {
  JournalEntry e;
  e.sensors = {{static_cast<std::uint64_t>(i), 0.1 * i, 1.0 / (3.0 + i)}};
  e.views = {{4, 1.0 / 3.0, {-0.1, 2.5, 1e-7, 1e7}}};
  return e;
}

TEST(Journal, GivesBackExactNumbersUpToTheCut) {
  const fs::path file = fs::path(testing::TempDir()) / "perdure_journal_test";
  fs::remove(file);
  const auto always = [](std::size_t) { return true; };
  {
    Journal journal(file, 1, always);
    for (int i = 0; i < 5; ++i) journal.append(entry(i));
  }
  fs::resize_file(file, fs::file_size(file) - 9);
  {
    Journal journal(file, 1, always);
    ASSERT_EQ(journal.entries().size(), 4U);
    EXPECT_EQ(journal.entries()[3].sensors[0].log_gain, entry(3).sensors[0].log_gain);
    EXPECT_EQ(journal.entries()[3].views[0].visible_fraction, 1.0 / 3.0);
    EXPECT_EQ(journal.entries()[3].views[0].box.x2, 1e-7);
    journal.append(entry(4));
  }
  const Journal shorter(file, 1, [](std::size_t frame) { return frame < 2; });
  EXPECT_EQ(shorter.entries().size(), 2U);
  const Journal other(file, 2, always);
  EXPECT_TRUE(other.entries().empty());
}

}  // namespace
}  // namespace perdure::tools
