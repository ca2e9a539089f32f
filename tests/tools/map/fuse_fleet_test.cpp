// Tests `perdure map fuse --url`, which fuses the vehicles' maps on a server.
#include "tools/map/fuse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "services/map_store/core/map_contents.h"
#include "services/map_store/fleet/map_transfer.h"
#include "tests/common/mapping/fusion/drives.h"
#include "tests/services/map_store/fleet/files.h"
#include "tests/services/map_store/fleet/postgres_server.h"

namespace perdure::tools {
namespace {

namespace fleet = map_store::fleet;
using map_store::test::PostgresServer;
using map_store::test::rowsOf;
using map_store::test::TemporaryFolder;

class FuseFleet : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = PostgresServer::get();
    if (server_ == nullptr) GTEST_SKIP() << "PostgreSQL is not installed (deploy/install --fleet)";
    url_ = server_->makeDatabase();
    red_ = drive("red", {.seed = 1, .to_m = 250.0});
    blue_ = drive("blue", {.seed = 2, .from_m = 130.0, .to_m = 380.0, .clock_s = 1000.0});
  }
  /// A vehicle that has sent its map.
  std::string drive(const std::string& name, const mapping::test::DriveSettings& settings) {
    static const auto things = mapping::test::thingsAlongBlock(3);
    map_store::WholeMap map;
    map.contents = mapping::test::driven(things, settings).map;
    map_store::writeWholeMap(map, folder_.file(name), false);
    fleet::pushMap(folder_.file(name), url_, name);
    server_->run(url_,
                 "UPDATE perdure.maps SET file = vehicle || '-1' WHERE vehicle = '" + name + "'");
    return folder_.file(name);
  }
  std::string pulled(const std::string& name) {
    const std::string file = folder_.file("pulled-" + std::to_string(++pulls_));
    fleet::pullMap(url_, name, file);
    return file;
  }

  PostgresServer* server_ = nullptr;
  TemporaryFolder folder_;
  std::string url_, red_, blue_;
  int pulls_ = 0;
};

TEST_F(FuseFleet, GivesTheServerWhatTheFilesWouldGive) {
  const FuseOutcome outcome = fuseFleet({}, url_, "town");
  EXPECT_EQ(outcome.parts.size(), 1u);
  EXPECT_GT(outcome.merges(), 5u);
  const std::string by_files = folder_.file("by-files");
  (void)fuseFiles({{red_, blue_}, by_files});
  EXPECT_EQ(rowsOf(pulled("town"), "objects"), rowsOf(by_files, "objects"));
}

TEST_F(FuseFleet, AnotherRunReplacesItAndCountsNothingTwice) {
  (void)fuseFleet({}, url_, "town");
  const auto before = rowsOf(pulled("town"), "objects");
  (void)fuseFleet({}, url_, "town");
  EXPECT_EQ(rowsOf(pulled("town"), "objects"), before);
  EXPECT_EQ(fleet::listMaps(url_).size(), 3u);
  EXPECT_EQ(rowsOf(pulled("red"), "objects"), rowsOf(red_, "objects")) << "vehicles' are as before";
}

TEST_F(FuseFleet, RefusesTheNameOfAVehicle) {
  try {
    (void)fuseFleet({}, url_, "red");
    ADD_FAILURE() << "not refused";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("red"));
  }
  EXPECT_EQ(rowsOf(pulled("red"), "objects"), rowsOf(red_, "objects"));
}

}  // namespace
}  // namespace perdure::tools
