#include "tools/demo/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/sim/truth.h"
#include "tools/simulate/simulate.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class DemoPlan : public ::testing::Test {
 protected:
  DemoPlan() {
    std::string name = (fs::temp_directory_path() / "perdure-plan-XXXXXX").string();
    folder_ = mkdtemp(name.data());
    for (const char* program : {"capture", "inference", "vio", "semantic-filter", "map-store"}) {
      std::ofstream(folder_ / (std::string("perdure-") + program)) << "";
    }
    options_.data = "/data/drive";
    options_.model = "/models/net.onnx";
    options_.out = (folder_ / "out").string();
    options_.programs = folder_.string();
    options_.root = folder_.string();
  }
  ~DemoPlan() override { fs::remove_all(folder_); }

  std::vector<std::string> commandOf(const std::string& service) {
    for (const auto& plan : planServices(options_, prepareFolders(options_))) {
      if (plan.name == service) return plan.command;
    }
    return {};
  }

  fs::path folder_;
  DemoOptions options_;
};

TEST_F(DemoPlan, PacesCaptureByTheClockOrLetsItFollow) {
  options_.rate = "0.5";
  EXPECT_THAT(commandOf("capture"), Contains("pace.rate=0.5"));
  EXPECT_THAT(commandOf("capture"), Contains("pace.mode=clock"));
  options_.rate = "max";
  EXPECT_THAT(commandOf("capture"), Contains("pace.mode=follow"));
  for (const char* wrong : {"fast", "0", "-1", "2x", "nan"}) {
    options_.rate = wrong;
    EXPECT_THROW(commandOf("capture"), StartupError) << wrong;
  }
}

TEST_F(DemoPlan, ShowsItWhereTheGatewayIsInstalled) {
  const auto folders = prepareFolders(options_);
  EXPECT_FALSE(planGateway(options_, folders, 8765).has_value());
  std::ofstream(folder_ / "perdure-gateway") << "";
  const auto gateway = planGateway(options_, folders, 8765);
  ASSERT_TRUE(gateway.has_value());
  EXPECT_THAT(gateway->command, Contains("http.port=8765"));
  EXPECT_GT(freePort(), 0);
}

TEST_F(DemoPlan, GivesThePageTheTruthOfASimulatedDrive) {
  SimulateOptions drive;
  drive.scene = "room";
  drive.out = folder_ / "drive";
  drive.world = {.seconds = 0.5, .width = 64, .height = 48};
  simulate(drive, {});
  options_.data = drive.out.string();
  std::ofstream(folder_ / "perdure-gateway") << "";
  const auto folders = prepareFolders(options_);
  const fs::path file = folders.run / "truth.json";
  EXPECT_THAT(planGateway(options_, folders, 1)->command, Contains("page.truth=" + file.string()));
  const auto truth = nlohmann::json::parse(std::ifstream(file));
  ASSERT_GT(truth["path"].size(), 5u);
  EXPECT_EQ(truth["path"][0].size(), 8u);
  EXPECT_EQ(truth["objects"].size(), sim::readTruth(drive.out).objects.size());
  fs::remove(drive.out / "visibility_truth.csv");
  EXPECT_THAT(planGateway(options_, folders, 1)->command, Not(Contains(HasSubstr("page.truth"))));
}

TEST_F(DemoPlan, ShapesAreOfThePriorsThatTheFiltersConfigurationNames) {
  fs::create_directories(folder_ / "config");
  std::ofstream(folder_ / "config" / "semantic_filter.yaml") << "class_priors: mine.yaml\n";
  EXPECT_THROW(shapesFor(options_), StartupError);  // the file does not exist yet
  std::ofstream(folder_ / "mine.yaml")
      << "fallback: {size: [0.7, 0.6, 0.7], spread: [0.4, 0.4, 0.4], common: 0.5, detection: 0.6}\n"
         "other: {size: [1, 1, 1], spread: [0.4, 0.4, 0.4], common: 0.5, detection: 0.6}\n"
         "classes:\n"
         "  chair: {size: [0.5, 0.5, 0.9], spread: [0.1, 0.1, 0.1], common: 0.05, detection: 0.8}\n"
         "  car: {size: [4.2, 1.8, 1.5], spread: [0.1, 0.1, 0.1], common: 0.05, detection: 0.9,\n"
         "        shape: [[-1, 1, 1, 0.2], [1, 0.5, 0.6, 0.1]]}\n";
  const auto shapes = shapesFor(options_);
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes.at("chair").size(), 8u);  // the cuboid's corners
  double highest = -1.0, widest_on_top = 0.0;
  for (const auto& p : shapes.at("car")) highest = std::max(highest, p.z());
  for (const auto& p : shapes.at("car")) {
    if (p.z() == highest) widest_on_top = std::max(widest_on_top, std::abs(p.y()));
  }
  EXPECT_DOUBLE_EQ(widest_on_top, 0.6);
}

TEST_F(DemoPlan, GivesEachServiceWhatItNeeds) {
  EXPECT_THAT(commandOf("inference"), Contains("model.path=/models/net.onnx"));
  EXPECT_THAT(commandOf("capture"), Contains("dataset.path=/data/drive"));
  EXPECT_THAT(commandOf("map_store"), Contains(HasSubstr("out/run/state/map.sqlite")));
}

TEST_F(DemoPlan, TellsAllServicesOfSharedMemoryWhereItIsAskedFor) {
  const auto services = {"capture", "inference", "vio", "semantic_filter", "map_store"};
  for (const char* service : services) {
    EXPECT_THAT(commandOf(service), Not(Contains(HasSubstr("shared_memory"))));
  }
  options_.shared_memory_mb = 8;
  for (const char* service : services) {
    EXPECT_THAT(commandOf(service), Contains("bus.shared_memory_mb=8")) << service;
  }
}

TEST_F(DemoPlan, TellsVioThatASimulatedCarDoesNotSlide) {
  EXPECT_THAT(commandOf("vio"), Not(Contains("speed.planar=true")));
  fs::create_directories(folder_ / "drive" / "mav0" / "speed0");
  options_.data = (folder_ / "drive").string();
  std::ofstream(folder_ / "drive" / "mav0" / "speed0" / "data.csv") << "";
  EXPECT_THAT(commandOf("vio"), Not(Contains("speed.planar=true"))) << "not known to be simulated";
  std::ofstream(folder_ / "drive" / "objects_truth.json") << "{}";
  EXPECT_THAT(commandOf("vio"), Contains("speed.planar=true"));
}

TEST_F(DemoPlan, NamesTheProgramThatIsMissing) {
  fs::remove(folder_ / "perdure-vio");
  try {
    commandOf("capture");
    FAIL() << "it was not refused";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("perdure-vio is missing"));
    EXPECT_EQ(error.code(), ExitCode::kUnavailable);
  }
}

TEST_F(DemoPlan, EmptiesAnEarlierRunButNoFolderOfSomeoneElse) {
  fs::path state;
  {
    const DemoFolders earlier = prepareFolders(options_);
    state = earlier.state;
    std::ofstream(state / "old") << "";
    EXPECT_THROW(prepareFolders(options_), StartupError);  // the earlier run goes on
    EXPECT_TRUE(fs::exists(state / "old"));
  }
  prepareFolders(options_);
  EXPECT_FALSE(fs::exists(state / "old"));
  options_.out = (folder_ / "other").string();
  fs::create_directories(folder_ / "other" / "run");
  std::ofstream(folder_ / "other" / "run" / "precious") << "";
  EXPECT_THROW(prepareFolders(options_), StartupError);
  EXPECT_TRUE(fs::exists(folder_ / "other" / "run" / "precious"));
}

}  // namespace
}  // namespace perdure::tools
