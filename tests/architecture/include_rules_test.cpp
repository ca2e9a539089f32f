#include "tests/architecture/include_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

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
  EXPECT_THAT(including("common/bus/dds.h", "dds/dds.h"), IsEmpty());
  EXPECT_THAT(including("common/wire/cdr.cpp", "dds/ddsi/ddsi_cdrstream.h"), IsEmpty());
  EXPECT_THAT(including("tools/pipeline/a.cpp", "services/vio/node.h"), IsEmpty());
}

TEST(TheProject, KeepsItsLayers) {
  const char* source = std::getenv("PERDURE_SOURCE");
  if (source == nullptr) GTEST_SKIP() << "run by ctest";
  std::size_t files = 0;
  for (const char* room : {"common", "services", "tools", "tests"}) {
    const auto root = std::filesystem::path(source);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / room)) {
      const auto extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      std::ifstream stream(entry.path());
      const std::string content{std::istreambuf_iterator<char>(stream), {}};
      const std::string path = std::filesystem::relative(entry.path(), root).string();
      EXPECT_THAT(violations(path, content), IsEmpty());
      ++files;
    }
  }
  EXPECT_GT(files, 50u);
}

}  // namespace
}  // namespace perdure::tests
