#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "tests/architecture/document_rules.h"
#include "tests/architecture/folder_rules.h"
#include "tests/architecture/include_rules.h"
#include "tests/architecture/vocabulary_rules.h"

namespace perdure::tests {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> including(const std::string& path, const std::string& include) {
  const bool system = include.find('.') == std::string::npos;
  return violations(path,
                    system ? "#include <" + include + ">\n" : "#include \"" + include + "\"\n");
}

TEST(IncludeRules, ForbidWhatCrossesLayers) {
  EXPECT_THAT(including("services/vio/core/a.h", "common/bus/endpoint.h"),
              ElementsAre(HasSubstr("core and node know no wire, bus")));
  EXPECT_THAT(including("services/vio/node.cpp", "common/wire/codec.h"),
              ElementsAre(HasSubstr("core and node know no wire, bus")));
  EXPECT_THAT(including("services/vio/core/a.h", "thread"), ElementsAre(HasSubstr("no threads")));
  EXPECT_THAT(including("services/vio/main.cpp", "services/capture/node.h"),
              ElementsAre(HasSubstr("no service includes another")));
  EXPECT_THAT(including("common/math/a.h", "common/types/objects.h"),
              ElementsAre(HasSubstr("only those below it")));
  EXPECT_THAT(including("common/wire/a.h", "common/bus/topics.h"),
              ElementsAre(HasSubstr("only those below it")));
  EXPECT_THAT(including("common/mapping/frames/a.h", "common/mapping/graph/b.h"),
              ElementsAre(HasSubstr("a layer of a folder")));
  EXPECT_THAT(including("services/vio/core/tracks/a.h", "services/vio/core/update/b.h"),
              ElementsAre(HasSubstr("a layer of a folder")));
  EXPECT_THAT(including("services/vio/core/estimator.h", "services/vio/core/start/a.h"),
              ElementsAre(HasSubstr("a layer of a folder")));
  EXPECT_THAT(including("services/capture/live/libcamera/session.cpp",
                        "services/capture/live/cameras/live_cameras.h"),
              ElementsAre(HasSubstr("a layer of a folder")));
  EXPECT_THAT(
      including("services/capture/live/live_camera.h", "services/capture/live/libcamera/session.h"),
      ElementsAre(HasSubstr("a layer of a folder")));
  EXPECT_THAT(including("services/semantic_filter/core/belief/track.h",
                        "services/semantic_filter/core/measurement/frame.h"),
              ElementsAre(HasSubstr("a layer of a folder")));
  EXPECT_THAT(including("services/semantic_filter/core/parameters.h",
                        "services/semantic_filter/core/belief/track.h"),
              ElementsAre(HasSubstr("plain numbers")));
  EXPECT_THAT(including("services/vio/main.cpp", "dds/dds.h"),
              ElementsAre(HasSubstr("only common/bus speaks DDS")));
  EXPECT_THAT(including("common/wire/cdr.cpp", "dds/dds.h"),
              ElementsAre(HasSubstr("only common/bus speaks DDS")));
  EXPECT_THAT(including("services/vio/main.cpp", "idl/objects.h"),
              ElementsAre(HasSubstr("only common/wire knows")));
  EXPECT_THAT(including("common/bus/a.h", "tools/map/command.h"),
              ElementsAre(HasSubstr("nobody includes tools")));
  EXPECT_THAT(including("tools/map/a.cpp", "tests/process/support.h"),
              ElementsAre(HasSubstr("nobody includes tests")));
  EXPECT_THAT(violations("services/vio/core/a.cpp", "auto t = std::chrono::steady_clock::now();\n"),
              ElementsAre(HasSubstr("reads a clock")));
}

TEST(IncludeRules, AllowWhatStaysInsideThem) {
  EXPECT_THAT(including("services/vio/core/a.h", "common/camera/camera_model.h"), IsEmpty());
  EXPECT_THAT(including("services/vio/main.cpp", "common/service/service.h"), IsEmpty());
  EXPECT_THAT(including("services/vio/main.cpp", "services/vio/node.h"), IsEmpty());
  EXPECT_THAT(including("services/semantic_filter/core/belief/track.h",
                        "services/semantic_filter/core/parameters.h"),
              IsEmpty());
  EXPECT_THAT(including("services/vio/core/start/a.h", "services/vio/core/estimator.h"), IsEmpty());
  EXPECT_THAT(including("common/bus/dds.h", "dds/dds.h"), IsEmpty());
  EXPECT_THAT(including("common/wire/cdr.cpp", "dds/ddsi/ddsi_cdrstream.h"), IsEmpty());
  EXPECT_THAT(including("tools/pipeline/a.cpp", "services/vio/node.h"), IsEmpty());
}

std::vector<std::string> manyUnits(const std::string& folder, std::size_t count) {
  std::vector<std::string> paths;
  for (std::size_t i = 0; i < count; ++i) {
    paths.push_back(folder + "/unit" + std::to_string(i) + ".h");
    paths.push_back(folder + "/unit" + std::to_string(i) + ".cpp");
  }
  return paths;
}

TEST(FolderRules, CountAUnitOnceAndNameTheFolderThatHoldsTooMany) {
  EXPECT_THAT(overfullFolders(manyUnits("tools/a", kMostUnits)), IsEmpty());
  EXPECT_THAT(overfullFolders(manyUnits("tools/a", kMostUnits + 1)),
              ElementsAre(HasSubstr("tools/a holds 16 units")));
}

TEST(VocabularyRules, FindFormerWordsInCodeAndComments) {
  EXPECT_THAT(formerWords("a.h", "/// Birth of an object.\ndouble elusive = 0.0;\n"),
              ElementsAre(HasSubstr("a.h:1: 'birth' is now initiation"),
                          HasSubstr("a.h:2: 'elusive' is now detectability")));
  EXPECT_THAT(formerWords("a.h", "double lookalike_nats;  // an outlook\n"), IsEmpty());
}

TEST(DocumentRules, FindLinksAndPathsThatLeadNowhere) {
  const std::set<std::string> paths{"tools", "tools/a", "tools/a/b.h", "tools/README.md"};
  const auto lost = [&](const std::string& text) {
    return lostPaths("tools/README.md", text, paths);
  };
  EXPECT_THAT(lost("[b](a/b.h#part), [a](a/), [up](../tools), `a/b.h`, [far](https://a.b/c.md)"),
              IsEmpty());
  EXPECT_THAT(lost("`b.h`, `a/<name>.h`, `a/*.h`, `/etc/a.md`, `run a/c.h`"), IsEmpty());
  EXPECT_THAT(lost("[b](b.h) `a/c.h` `ools/a/b.h`"),
              ElementsAre(HasSubstr("the link b.h"), HasSubstr("no file is a/c.h"),
                          HasSubstr("no file is ools/a/b.h")));
}

/// Returns every header and source file, relative to the project's root.
std::vector<std::string> filesUnder(const std::filesystem::path& root,
                                    std::initializer_list<const char*> rooms) {
  std::vector<std::string> files;
  for (const char* room : rooms) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / room)) {
      const auto extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      files.push_back(std::filesystem::relative(entry.path(), root).string());
    }
  }
  return files;
}

class TheProject : public testing::Test {
 protected:
  void SetUp() override {
    const char* source = std::getenv("PERDURE_SOURCE");
    if (source == nullptr) GTEST_SKIP() << "run by ctest";
    root_ = source;
  }
  std::filesystem::path root_;
};

TEST_F(TheProject, KeepsItsLayers) {
  const auto files = filesUnder(root_, {"common", "services", "tools", "tests"});
  EXPECT_GT(files.size(), 50u);
  for (const std::string& path : files) {
    std::ifstream stream(root_ / path);
    const std::string content{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_THAT(violations(path, content), IsEmpty());
  }
}

TEST_F(TheProject, KeepsTheWordsOfItsGlossary) {
  for (const std::string& path : filesUnder(root_, {"services/semantic_filter/core"})) {
    std::ifstream stream(root_ / path);
    const std::string content{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_THAT(formerWords(path, content), IsEmpty());
  }
}

TEST_F(TheProject, KeepsItsFoldersSmall) {
  EXPECT_THAT(overfullFolders(filesUnder(root_, {"common", "services", "tools"})), IsEmpty());
}

/// Returns the files and folders of the sources, relative to the root.
std::set<std::string> pathsUnder(const std::filesystem::path& root) {
  std::set<std::string> paths;
  const auto add = [&](const auto& entry) {
    paths.insert(entry.path().lexically_relative(root).string());
  };
  for (const auto& entry : std::filesystem::directory_iterator(root)) {
    if (entry.is_regular_file()) add(entry);
  }
  for (const char* room :
       {"cmake", "common", "config", "deploy", "idl", "models", "services", "tests", "tools"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / room)) add(entry);
    paths.insert(room);
  }
  return paths;
}

TEST_F(TheProject, NamesFilesThatAreThere) {
  const auto paths = pathsUnder(root_);
  for (const std::string& path : paths) {
    if (!path.ends_with(".md")) continue;
    std::ifstream stream(root_ / path);
    const std::string content{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_THAT(lostPaths(path, content, paths), IsEmpty());
  }
}

}  // namespace
}  // namespace perdure::tests
