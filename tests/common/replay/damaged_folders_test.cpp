// Folders in EuRoC's layout with damaged files or stamps: each finding names its own fix.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "common/base/errors.h"
#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "common/replay/files/output_place.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Maps the `index` of a line, from 0, and its stamp in ns to the new stamp.
using NewStamp = std::function<std::int64_t(std::int64_t index, std::int64_t ns)>;

void changeStamps(const fs::path& file, const NewStamp& to) {
  std::istringstream lines(readText(file));
  std::string line, text;
  std::getline(lines, text);
  for (std::int64_t i = 0; std::getline(lines, line); ++i) {
    const auto at = line.find(',');
    text += "\n" + std::to_string(to(i, std::stoll(line.substr(0, at)))) + line.substr(at);
  }
  writeText(file, text + "\n");
}

/// Makes a folder of distinct images of the calibration's size; `change` is applied to each file.
fs::path damaged(const std::string& name,
                 const std::function<void(std::size_t, const fs::path&)>& change) {
  const auto root = tinyEuroc(name);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(root / "mav0/cam0/data"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (std::size_t i = 0; i < files.size(); ++i) change(i, files[i]);
  return root;
}

DataFindings findingsOf(const fs::path& root) {
  return checkData(Dataset::open({.path = root})->recording(), {});
}
/// Returns the text of the finding with this code, or "" if there is none. The text of a fatal
/// finding begins with "fatal ".
std::string textOf(const fs::path& root, const std::string& code) {
  for (const auto& finding : findingsOf(root)) {
    if (finding.code == code)
      return (finding.grade == DataFinding::Grade::kFatal ? "fatal " : "") + finding.text;
  }
  return {};
}

TEST(DamagedFolder, ASoundOneHasNoFinding) {
  EXPECT_THAT(findingsOf(tinyEuroc("damaged_none")), IsEmpty());
}

TEST(DamagedFolder, EmptyImagesAreCountedAndTheFirstNamed) {
  const auto root = damaged("images_empty", [](std::size_t i, const fs::path& file) {
    if (i % 2 == 1) writeText(file, "");
  });
  EXPECT_THAT(textOf(root, "images_empty"),
              AllOf(HasSubstr("2 of the 5 images"), HasSubstr("1050000000.png")));
}

TEST(DamagedFolder, ImagesThatAreCutOffAreToldWithTheFirst) {
  const auto some = damaged("images_cut", [](std::size_t i, const fs::path& file) {
    if (i == 0 || i == 4) truncate(file, 0.6);
  });
  EXPECT_THAT(textOf(some, "images_unreadable"),
              AllOf(HasSubstr("2 of "), HasSubstr("1000000000.png"), HasSubstr("is missing")));
  const auto all =
      damaged("images_all_cut", [](std::size_t, const fs::path& file) { truncate(file, 0.6); });
  EXPECT_THAT(textOf(all, "image_unreadable"),
              AllOf(HasSubstr("fatal no image of cam0"), HasSubstr("1000000000.png"),
                    HasSubstr("the end of the image is missing")));
  const auto none =
      damaged("images_all_empty", [](std::size_t, const fs::path& file) { writeText(file, ""); });
  EXPECT_THAT(textOf(none, "image_unreadable"),
              AllOf(HasSubstr("fatal no image of cam0"), HasSubstr("1000000000.png has 0 bytes")));
}

TEST(DamagedFolder, LinksToNothingAndOtherEndingsAreNamed) {
  const auto errorIn = [](const fs::path& root) {
    EXPECT_EQ(startupCodeOf([&] { Dataset::open({.path = root}); }), ExitCode::kData);
    return startupErrorOf([&] { Dataset::open({.path = root}); });
  };
  const auto links = damaged("images_links", [](std::size_t, const fs::path& file) {
    fs::remove(file);
    fs::create_symlink("/nowhere/" + file.filename().string(), file);
  });
  EXPECT_THAT(errorIn(links), AllOf(HasSubstr("holds 5 links to nothing"),
                                    HasSubstr("1000000000.png to /nowhere/1000000000.png")));
  const auto heic = damaged("images_heic", [](std::size_t, fs::path file) {
    const auto from = file;
    fs::rename(from, file.replace_extension(".heic"));
  });
  EXPECT_THAT(errorIn(heic), AllOf(HasSubstr("5 files in .heic, which is not read"),
                                   HasSubstr("convert them to PNG or JPEG")));
  const auto list = tinyEuroc("images_list");
  writeText(list / "mav0/cam0/data.csv", "#timestamp [ns],filename\n");
  EXPECT_THAT(errorIn(list), HasSubstr("cam0/data.csv has no frame"));
}

TEST(DamagedFolder, StampsThatLostDigitsAreToldSo) {
  const auto root = tinyEuroc("stamps_equal");
  changeStamps(root / "mav0/imu0/data.csv", [](auto, std::int64_t) { return 1'024'000'000; });
  EXPECT_THAT(textOf(root, "stamps_equal"),
              AllOf(HasSubstr("fatal 60 of 61 stamps of the IMU are equal"), HasSubstr("float")));
  EXPECT_THAT(textOf(root, "clocks_apart"), IsEmpty());
  const auto twice = tinyEuroc("lines_twice");
  changeStamps(twice / "mav0/imu0/data.csv",
               [](std::int64_t i, std::int64_t) { return 950'000'000 + i / 2 * 5'000'000; });
  EXPECT_THAT(textOf(twice, "stamps_equal"), IsEmpty());
}

TEST(DamagedFolder, AnIndexIsNoTime) {
  const auto root = tinyEuroc("stamps_count");
  std::string list = "#timestamp [ns],filename\n";
  for (int i = 0; i < 5; ++i) list += std::to_string(i) + ",1000000000.png\n";
  for (int i = 5; i < 20; ++i) list += std::to_string(i) + ",1050000000.png\n";
  writeText(root / "mav0/cam0/data.csv", list);
  EXPECT_THAT(textOf(root, "stamps_count"),
              AllOf(HasSubstr("fatal the stamps of the images (0 … 19) are counts")));
  EXPECT_THAT(textOf(root, "clocks_apart"), IsEmpty());
}

// These stamps are consecutive integers, too.
TEST(DamagedFolder, SamplesOfAKilohertzInWholeMillisecondsAreNoCount) {
  const auto root = tinyEuroc("stamps_1khz");
  std::string list = "#timestamp [ns],filename\n", samples = "#timestamp [ns],w,w,w,a,a,a\n";
  for (int i = 0; i < 8; ++i) list += std::to_string(50 * i) + ",1000000000.png\n";
  for (int i = 0; i < 400; ++i) samples += std::to_string(i) + ",0,0,0,0,0,9.8\n";
  writeText(root / "mav0/cam0/data.csv", list);
  writeText(root / "mav0/imu0/data.csv", samples);
  EXPECT_THAT(textOf(root, "stamps_unit"), HasSubstr("multiply them by 1000000"));
  EXPECT_THAT(textOf(root, "stamps_count"), IsEmpty());
}

TEST(DamagedFolder, WholeMilliOrMicrosecondsAreSeenByTheRates) {
  for (const std::int64_t factor : {1'000, 1'000'000}) {
    const auto root = tinyEuroc("stamps_unit" + std::to_string(factor));
    std::string list = "#timestamp [ns],filename\n";
    for (std::int64_t i = 0; i < 8; ++i)
      list += std::to_string((1'000'000'000 + i * 50'000'000) / factor) + ",1000000000.png\n";
    writeText(root / "mav0/cam0/data.csv", list);
    changeStamps(root / "mav0/imu0/data.csv",
                 [&](std::int64_t, std::int64_t ns) { return ns / factor; });
    EXPECT_THAT(textOf(root, "stamps_unit"),
                AllOf(HasSubstr(factor == 1000 ? "in µs" : "in ms"),
                      HasSubstr("multiply them by " + std::to_string(factor))));
  }
}

TEST(DamagedFolder, AFileThatIsThereIsNotMissing) {
  const auto folder = freshFolder("files_of_no_kind");
  writeText(folder / "a.bag.active", "#ROSBAG V2.0\n");
  writeText(folder / "b.txt", "some words");
  writeText(folder / "c", "#ROSBAG V2.0\n");
  writeText(folder / "d.bag", "#ROSBAG V2.0\n" + std::string(100, 'x'));
  const auto errorOf = [&](const char* name) {
    EXPECT_EQ(startupCodeOf([&] { Dataset::open({.path = folder / name}); }), ExitCode::kData);
    return startupErrorOf([&] { Dataset::open({.path = folder / name}); });
  };
  EXPECT_THAT(errorOf("a.bag.active"), HasSubstr("run `rosbag reindex` on it and name it .bag"));
  EXPECT_THAT(errorOf("b.txt"), HasSubstr("not a recording that is known"));
  EXPECT_THAT(errorOf("c"), HasSubstr("name it .bag"));
  EXPECT_THAT(errorOf("d.bag"), HasSubstr("cut off"));
}

TEST(OutputPlace, NeverOverWhatIsRead) {
  const auto root = freshFolder("overwriting");
  writeText(root / "run.mcap", "a recording");
  const auto codeOf = [&](const fs::path& data) {
    return startupCodeOf([&] { refuseOverwriting(root / "run.mcap", data, "--record"); });
  };
  EXPECT_EQ(codeOf(root / "." / "run.mcap"), ExitCode::kUsage);
  EXPECT_EQ(codeOf(root), ExitCode::kUsage);
  EXPECT_NO_THROW(refuseOverwriting(root / "run.mcap", root / "other.mcap", "--record"));
  EXPECT_NO_THROW(refuseOverwriting(root / "none.mcap", root / "run.mcap", "--record"));
}

TEST(OutputPlace, NeverInTheSensorsOfTheData) {
  const auto root = tinyEuroc("output_place");
  const auto codeOf = [&](const fs::path& out, const fs::path& data) {
    return startupCodeOf([&] { refuseInside(out, data, "--out"); });
  };
  fs::create_directory_symlink(root / "mav0/cam0", root / "link");
  EXPECT_EQ(codeOf(root / "mav0/cam0/data", root), ExitCode::kUsage);
  EXPECT_EQ(codeOf(root / "link/new/folder", root), ExitCode::kUsage);
  EXPECT_EQ(codeOf(root / "out/../mav0/out", root), ExitCode::kUsage);
  EXPECT_EQ(codeOf(root / "mav0/out", root / "mav0/"), ExitCode::kUsage);
  EXPECT_EQ(codeOf(root, root), ExitCode::kUsage);
  EXPECT_EQ(codeOf(root / "out", root), ExitCode::kOk);
  EXPECT_EQ(codeOf(root / "pose", root), ExitCode::kOk) << "no such sensor is there";
  const auto run = freshFolder("output_of_run");
  writeText(run / "run.mcap", "a recording");
  EXPECT_EQ(codeOf(run, run), ExitCode::kOk);
  EXPECT_EQ(codeOf(root.parent_path() / "mav0", root), ExitCode::kOk);
}

}  // namespace
}  // namespace perdure::replay
