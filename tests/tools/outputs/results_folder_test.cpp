#include "tools/outputs/results_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>

#include "common/base/errors.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

void writeTo(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

std::string readFrom(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

fs::path folderOf(const char* name) {
  const fs::path folder = fs::path(::testing::TempDir()) / name;
  fs::remove_all(folder);
  return folder;
}

/// The results of a finished run.
fs::path earlierRun(const char* name) {
  const fs::path out = folderOf(name);
  writeTo(out / "report.json", "earlier");
  writeTo(out / "map.sqlite", "earlier map");
  writeTo(out / "map.sqlite-wal", "of the earlier map");
  writeTo(out / "truth/old.txt", "earlier");
  return out;
}

TEST(ResultsFolder, AnEmptyOneIsWrittenDirectly) {
  const fs::path out = folderOf("results_empty");
  {
    ResultsFolder results(out);
    EXPECT_EQ(results.folder(), out);
    try {
      const ResultsFolder second(out);
      FAIL() << "two runs in one folder";
    } catch (const StartupError& error) {
      EXPECT_THAT(error.what(),
                  HasSubstr(fmt::format("another process (process {}) writes", getpid())));
    }
    writeTo(out / "events.jsonl", "of a run that fails");
  }
  EXPECT_TRUE(fs::exists(out / "events.jsonl"));
  const fs::path other = folderOf("results_never");
  { const ResultsFolder results(other); }
  EXPECT_FALSE(fs::exists(other)) << "it was new and stayed empty";
}

TEST(ResultsFolder, OneThatWasReplacedDuringTheRunIsAFailure) {
  const fs::path out = folderOf("results_replaced");
  ResultsFolder results(out);
  fs::rename(out, out.string() + "_old");
  fs::create_directories(out);
  EXPECT_THROW(results.keep(), StartupError);
}

TEST(ResultsFolder, AnEarlierRunStaysWhereTheNewOneFails) {
  const fs::path out = earlierRun("results_fail");
  {
    const ResultsFolder results(out);
    writeTo(results.folder() / "map.sqlite", "half a map");
    EXPECT_EQ(readFrom(out / "map.sqlite"), "earlier map");
  }
  EXPECT_EQ(readFrom(out / "map.sqlite"), "earlier map");
  EXPECT_EQ(readFrom(out / "map.sqlite-wal"), "of the earlier map");
  EXPECT_FALSE(fs::exists(out / "unfinished"));
}

TEST(ResultsFolder, WhatIsKeptTakesThePlaceOfTheEarlierRun) {
  const fs::path out = earlierRun("results_kept");
  {
    ResultsFolder results(out);
    writeTo(results.folder() / "report.json", "new");
    writeTo(results.folder() / "map.sqlite", "new map");
    writeTo(results.folder() / "truth/new.txt", "new");
    results.keep();
  }
  EXPECT_EQ(readFrom(out / "report.json"), "new");
  EXPECT_EQ(readFrom(out / "map.sqlite"), "new map");
  EXPECT_FALSE(fs::exists(out / "map.sqlite-wal")) << "it is the earlier map's";
  EXPECT_TRUE(fs::exists(out / "truth/new.txt"));
  EXPECT_FALSE(fs::exists(out / "truth/old.txt"));
  EXPECT_FALSE(fs::exists(out / "unfinished"));
}

TEST(ResultsFolder, WhatAKilledRunLeftIsRemoved) {
  const fs::path out = earlierRun("results_killed");
  writeTo(out / "unfinished/run.mcap", "half a record");
  ResultsFolder results(out);
  EXPECT_FALSE(fs::exists(out / "unfinished/run.mcap"));
}

}  // namespace
}  // namespace perdure::tools
