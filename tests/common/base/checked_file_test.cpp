#include "common/base/checked_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <iterator>

#include "common/base/errors.h"

namespace perdure {
namespace {

namespace fs = std::filesystem;

class CheckedFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder = fs::path(testing::TempDir()) / ("checked_file_" + std::to_string(getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  static std::string contentOf(const fs::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  static ExitCode codeOf(const std::function<void()>& action) {
    try {
      action();
    } catch (const StartupError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(";")) << "the fix follows";
      return error.code();
    }
    return ExitCode::kOk;
  }

  fs::path folder;
};

TEST_F(CheckedFileTest, HasItsNameOnlyWhenItIsWhole) {
  const fs::path file = folder / "result.csv";
  writeChecked(file, "before");
  {
    CheckedFile given_up(file);
    given_up.stream() << "half";
  }
  EXPECT_EQ(contentOf(file), "before");
  CheckedFile checked(file);
  checked.stream() << "after";
  EXPECT_EQ(contentOf(file), "before");
  checked.close();
  EXPECT_EQ(contentOf(file), "after");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "nothing else is left";
}

TEST_F(CheckedFileTest, AFullDiskIsSaid) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_EQ(codeOf([] { writeChecked("/dev/full", "text"); }), ExitCode::kInputOutput);
  EXPECT_EQ(codeOf([] { writeChecked("/dev/full", std::string(1 << 20, 'x')); }),
            ExitCode::kInputOutput);
  EXPECT_FALSE(fs::is_regular_file("/dev/full"));
  std::ofstream full("/dev/full");
  full << "text";
  EXPECT_EQ(codeOf([&] { flushChecked(full, "/dev/full"); }), ExitCode::kInputOutput);
}

TEST_F(CheckedFileTest, ALimitOfTheFileSizeIsNamed) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit limit = before;
  limit.rlim_cur = 1000;
  const auto on_excess = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_EQ(fileSizeLimit(), 1000U);
  std::string message;
  try {
    writeChecked(folder / "result.csv", std::string(1 << 20, 'x'));
  } catch (const StartupError& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, on_excess);
  EXPECT_THAT(message, testing::HasSubstr("which is 1000 bytes (ulimit -f)"));
}

TEST_F(CheckedFileTest, AFolderThatIsNotThereIsSaid) {
  EXPECT_EQ(codeOf([this] { writeChecked(folder / "nowhere/file", "text"); }),
            ExitCode::kUnavailable);
}

}  // namespace
}  // namespace perdure
