#include "common/base/files/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/common/base/files/as_nobody.h"

namespace perdure {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class Access : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "perdure-access-XXXXXX").string();
    place_ = mkdtemp(name.data());
    fs::create_directories(place_ / "drive/imu0");
    std::ofstream(place_ / "drive/imu0/data.csv") << "1";
    fs::permissions(place_, fs::perms(0755));
  }
  void TearDown() override {
    fs::permissions(place_ / "drive/imu0", fs::perms(0755));
    fs::remove_all(place_);
  }
  fs::path place_;
};

TEST_F(Access, OfWhatMayBeReadOrIsMissingThereIsNothingToSay) {
  const tests::AsNobody nobody;
  EXPECT_EQ(whyUnreadableIn(place_), "");
  EXPECT_EQ(whyUnreadable(place_ / "drive/none.csv"), "");
  EXPECT_EQ(whyUnreadable("/proc/self/none"), "");
}

TEST_F(Access, NamesTheFileItsOwnerAndTheFix) {
  const fs::path file = place_ / "drive/imu0/data.csv";
  fs::permissions(file, fs::perms(0));
  const tests::AsNobody nobody;
  const std::string why = whyUnreadable(file);
  EXPECT_THAT(why, StartsWith(file.string() + " may not be read by "));
  EXPECT_THAT(why, AllOf(HasSubstr("permission denied; it belongs to "), HasSubstr("(mode 0)"),
                         HasSubstr("chmod a+r")));
  EXPECT_EQ(whyUnreadableIn(place_), why);
}

TEST_F(Access, NamesTheFolderThatMayNotBeEntered) {
  const fs::path folder = place_ / "drive/imu0";
  fs::permissions(folder, fs::perms(0));
  const tests::AsNobody nobody;
  EXPECT_THAT(whyUnreadable(folder / "data.csv"), StartsWith(folder.string() + " may not"));
  EXPECT_THAT(whyUnreadableIn(place_ / "drive"), StartsWith(folder.string() + " may not"));
}

}  // namespace
}  // namespace perdure
