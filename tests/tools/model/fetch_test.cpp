// Tests the list of known networks, and `perdure model fetch` with a server on loopback. The
// command downloads, checks and imports a file, or describes these steps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "common/base/errors.h"
#include "common/base/subprocess.h"
#include "services/inference/model_file.h"
#include "tests/tools/model/python.h"
#include "tools/model/known.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

fs::path sourceTree() {
  const char* folder = std::getenv("PERDURE_SOURCE");
  return folder != nullptr ? folder : ".";
}

std::string contentOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Serves a folder on a port that the system chooses.
constexpr const char* kServer = R"(
import http.server, os, sys
os.chdir(sys.argv[1])
server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), http.server.SimpleHTTPRequestHandler)
with open(sys.argv[2] + ".new", "w") as f:
    f.write(str(server.server_address[1]))
os.rename(sys.argv[2] + ".new", sys.argv[2])
server.serve_forever()
)";

class Fetch : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!testing::pythonHasOnnx()) GTEST_SKIP() << "python3-onnx is not installed";
    if (!findProgram("curl")) GTEST_SKIP() << "curl is not installed";
    folder_ = fs::temp_directory_path() / ("perdure_fetch_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "served");
    networks_ = testing::generated("tiny_networks.py");
    fs::copy_file(networks_ / "yolox/net.onnx", folder_ / "served/tiny.onnx");
    serve();
    known_ = {{"name", "tiny"},
              {"maker", "tests"},
              {"licence", "none"},
              {"family", "yolox"},
              {"source", "made here"},
              {"input", "64x64"},
              {"classes_file", "coco.names"},
              {"keys", {{"box_sigma", 0.07}}},
              {"uses",
               {{"street",
                 {{"classes", {"car", "person"}},
                  {"calibration", {{"clutter_rate", 0.66}}},
                  {"measured", "nowhere"}}},
                {"room", {{"classes", {"dog"}}}}}}};
    describeFile(fs::file_size(folder_ / "served/tiny.onnx"),
                 sha256Of(folder_ / "served/tiny.onnx"));
  }
  void TearDown() override {
    if (server_) server_->stop(std::chrono::seconds(5));
    fs::remove_all(folder_);
    if (!networks_.empty()) fs::remove_all(networks_);
  }
  void serve() {
    const fs::path port = folder_ / "port";
    server_ = std::make_unique<Subprocess>(
        ProgramOptions{.command = {"/usr/bin/python3", "-c", kServer, (folder_ / "served").string(),
                                   port.string()},
                       .log = folder_ / "server.log"});
    for (int i = 0; i < 500 && !fs::exists(port); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    port_ = contentOf(port);
    ASSERT_FALSE(port_.empty()) << contentOf(folder_ / "server.log");
  }
  void describeFile(std::uintmax_t bytes, const std::string& sum) {
    known_["files"] = {{{"name", "tiny.onnx"},
                        {"url", "http://127.0.0.1:" + port_ + "/tiny.onnx"},
                        {"bytes", bytes},
                        {"sha256", sum}}};
    std::ofstream(folder_ / "list.json") << json{{"networks", {known_}}};
  }
  /// Runs `perdure model fetch tiny`. The tiny networks have three classes, although the list names
  /// coco's.
  ProgramAnswer fetched(std::vector<std::string> more = {}) {
    std::vector<std::string> command = {(sourceTree() / "build/release/bin/perdure").string()};
    if (const char* bin = std::getenv("PERDURE_BIN")) command = {std::string(bin) + "/perdure"};
    command.insert(command.end(), {"model", "fetch", "tiny", "--list",
                                   (folder_ / "list.json").string(), "--out", out().string()});
    command.insert(command.end(), more.begin(), more.end());
    return runProgram({.command = command, .environment = {{"no_proxy", "127.0.0.1"}}});
  }
  fs::path out() const { return folder_ / "out"; }

  fs::path folder_, networks_;
  std::unique_ptr<Subprocess> server_;
  std::string port_;
  json known_;
};

TEST_F(Fetch, TakesChecksImportsAndCalibrates) {
  // Three classes, as in the tiny networks.
  std::ofstream(folder_ / "three.names") << "car\nperson\ndog\n";
  known_["classes_file"] = fs::absolute(folder_ / "three.names").string();
  describeFile(fs::file_size(folder_ / "served/tiny.onnx"), sha256Of(folder_ / "served/tiny.onnx"));
  const auto answer = fetched({"--input", "128x64"});
  ASSERT_EQ(answer.status, 0) << answer.output;
  EXPECT_THAT(answer.output, HasSubstr("sha256 as known"));
  EXPECT_THAT(answer.output, HasSubstr("'detection.classes=[car, person]'"));
  const auto file = inference::readModelFile((out() / "tiny.perdure.onnx").string(), "", {});
  EXPECT_EQ(file.description.input.width, 128);
  EXPECT_NE(file.description.calibration.clutter_rate, 0.66);
  EXPECT_THAT(answer.output, HasSubstr("the calibration was measured at 64x64, not at this size: "
                                       "perdure model calibrate"));
  EXPECT_DOUBLE_EQ(file.description.box_sigma, 0.07);

  const auto usual = fetched({"--input", "64x64"});
  ASSERT_EQ(usual.status, 0) << usual.output;
  const auto same = inference::readModelFile((out() / "tiny.perdure.onnx").string(), "", {});
  EXPECT_DOUBLE_EQ(same.description.calibration.clutter_rate, 0.66);

  // Existing files are not downloaded again: this run works without the server, for another kind of
  // place.
  server_->stop(std::chrono::seconds(5));
  const auto again = fetched({"--for", "room"});
  ASSERT_EQ(again.status, 0) << again.output;
  EXPECT_THAT(again.output, HasSubstr("there       "));
  EXPECT_THAT(again.output, HasSubstr("no calibration was measured for room"));
}

TEST_F(Fetch, KeepsNothingWithAnotherSum) {
  describeFile(fs::file_size(folder_ / "served/tiny.onnx"), std::string(64, 'a'));
  const auto answer = fetched();
  EXPECT_EQ(answer.status, 65);
  EXPECT_THAT(answer.output, HasSubstr("it was changed there, or on the way; nothing was kept"));
  EXPECT_TRUE(fs::is_empty(out()));
  std::ofstream(out() / "tiny.onnx") << "another file";
  const auto there = fetched();
  EXPECT_EQ(there.status, 65);
  EXPECT_THAT(there.output, HasSubstr("remove it, or give another --out"));
  EXPECT_EQ(contentOf(out() / "tiny.onnx"), "another file");
}

TEST_F(Fetch, SaysWhatItWouldDoWhereThereIsNoNetwork) {
  server_->stop(std::chrono::seconds(5));
  const auto answer = fetched();
  EXPECT_EQ(answer.status, 69);
  const std::string path = (out() / "tiny.onnx").string();
  EXPECT_THAT(answer.output, HasSubstr("curl -L -o " + path + " http://127.0.0.1:" + port_));
  EXPECT_THAT(answer.output, HasSubstr("sha256sum -c"));
  EXPECT_TRUE(fs::is_empty(out()));
  fs::remove_all(out());
  const auto dry = fetched({"--dry-run", "--input", "128x64"});
  EXPECT_EQ(dry.status, 0);
  EXPECT_THAT(dry.output, HasSubstr("would make the folder " + out().string()));
  EXPECT_THAT(dry.output, HasSubstr("perdure model import " + path + " --classes=/"));
  EXPECT_THAT(dry.output, HasSubstr("coco.names --family=yolox --input=128x64\n"));
  EXPECT_THAT(dry.output, HasSubstr("curl -L -o " + path));
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Fetch, WrongNamesAreUsage) {
  const auto place = fetched({"--for", "sea"});
  EXPECT_EQ(place.status, 64);
  EXPECT_THAT(place.output, HasSubstr("room, street"));
  known_["name"] = "other";
  describeFile(1, std::string(64, 'a'));
  const auto name = fetched();
  EXPECT_EQ(name.status, 64);
  EXPECT_THAT(name.output, HasSubstr("tiny is not a known network; known are other"));
  std::ofstream(folder_ / "list.json") << "[]";
  EXPECT_EQ(fetched().status, 78);
}

TEST(KnownNetworks, OfAnotherListAreLookedAt) {
  const fs::path list =
      fs::temp_directory_path() / ("perdure_known_" + std::to_string(getpid()) + ".json");
  json known;
  std::ifstream(sourceTree() / "config/models/known/networks.json") >> known;
  json& file = known["networks"][0]["files"][0];
  file["sha256"] = std::string(64, 'A');
  std::ofstream(list) << known;
  EXPECT_EQ(knownNetworks(list).front().files.front().sha256, std::string(64, 'a'));
  file["bytes"] = -1;
  std::ofstream(list) << known;
  EXPECT_THROW(knownNetworks(list), StartupError);
  fs::remove(list);
}

TEST(KnownNetworks, OfTheListHaveAllThatIsNeeded) {
  const auto networks = knownNetworks(sourceTree() / "config/models/known/networks.json");
  EXPECT_GE(networks.size(), 4u);
  for (const auto& network : networks) {
    EXPECT_FALSE(network.licence.empty());
    EXPECT_FALSE(network.accuracy.empty());
    for (const auto& file : network.files) EXPECT_THAT(file.url, ::testing::StartsWith("https://"));
    const std::string names =
        "\n" + contentOf(sourceTree() / "config/models" / network.classes_file);
    for (const auto& use : network.uses) {
      for (const auto& name : use.classes) {
        EXPECT_THAT(names, HasSubstr("\n" + name + "\n")) << network.name << ", " << use.name;
      }
    }
    EXPECT_THAT(describe(network), HasSubstr(network.files.front().sha256));
  }
}

// The checksums in the list belong to files that were tested.
TEST(KnownNetworks, AreTheFilesAtHand) {
  const fs::path weights = sourceTree() / "../shared/data/weights";
  if (!fs::exists(weights)) GTEST_SKIP() << "../shared/data is absent: no network to try";
  for (const auto& network : knownNetworks(sourceTree() / "config/models/known/networks.json")) {
    for (const auto& file : network.files) {
      EXPECT_EQ(sha256Of(weights / file.name), file.sha256) << file.name;
      EXPECT_EQ(fs::file_size(weights / file.name), file.bytes) << file.name;
    }
  }
}

}  // namespace
}  // namespace perdure::tools
