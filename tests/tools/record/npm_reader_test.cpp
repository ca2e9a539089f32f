// Tests recordings with a foreign reader: npm's @mcap/core, and its decoders of IDL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/replay/recordings/mcap_reader.h"
#include "common/replay/recordings/recording_writer.h"
#include "tests/common/wire/examples.h"
#include "tests/process/support.h"
#include "tools/record/files.h"

namespace perdure::tools {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kOfEach = 3;

template <class T>
void addExamples(replay::RecordingWriter& recording, const std::string& topic) {
  for (unsigned seed = 1; seed <= kOfEach; ++seed) {
    T message;
    wire::Examples(seed).fill(message);
    recording.add(topic, message, 1000 + seed);
  }
  recording.cut();
}

void addAll(replay::RecordingWriter& recording) {
  addExamples<Frame>(recording, "frame/cam0");
  addExamples<ImuSample>(recording, "imu");
  addExamples<SpeedSample>(recording, "speed");
  addExamples<Calibration>(recording, "calibration");
  addExamples<Odometry>(recording, "odometry");
  addExamples<Landmarks>(recording, "landmarks");
  addExamples<Detections>(recording, "detections");
  addExamples<ModelInfo>(recording, "model");
  addExamples<SwapNotice>(recording, "inference/swap");
  addExamples<Objects>(recording, "objects");
  addExamples<Event>(recording, "events");
  addExamples<Predictions>(recording, "predictions");
  addExamples<MapNear>(recording, "map/near");
  addExamples<MapQuery>(recording, "map/query");
  addExamples<MapReply>(recording, "map/reply");
  addExamples<Health>(recording, "health");
}
constexpr std::size_t kTopics = 16;

struct Read {
  std::vector<json> messages;
  json file;
  std::map<std::string, int> errors;  ///< by topic
};

class NpmReader : public testing::Test {
 protected:
  /// Installs npm's packages once for all tests; returns the reason of a failure.
  static std::string installed(const test::Folder& place) {
    const auto here = test::sources() / "tests/tools/record/npm";
    for (const char* name : {"package.json", "read.mjs"}) {
      std::filesystem::copy_file(here / name, place.file(name));
    }
    test::Child npm({"env", "npm", "install", "--prefix", place.file(""), "--no-audit", "--no-fund",
                     "--ignore-scripts", "--fetch-retries=0", "--fetch-timeout=10000"},
                    place.file("npm.log"));
    return npm.wait(60s) == 0 ? "" : "npm or its registry is absent (deploy/install --page): " + npm.log();
  }

  static void SetUpTestSuite() {
    place_ = std::make_unique<test::Folder>();
    why_not_ = installed(*place_);
  }
  static void TearDownTestSuite() { place_.reset(); }

  void SetUp() override {
    if (!why_not_.empty()) GTEST_SKIP() << why_not_;
    if (std::filesystem::exists(place_->file("raw.mcap"))) return;
    replay::RecordingWriter recording(place_->file("raw.mcap"));
    addAll(recording);
    recording.finish();
  }

  Read readByNode(const std::string& name) {
    test::Child node({"node", place_->file("read.mjs"), place_->file(name)},
                     place_->file("node.log"));
    EXPECT_EQ(node.wait(60s), 0) << node.log();
    Read read;
    std::istringstream lines(node.log());
    for (std::string line; std::getline(lines, line);) {
      const auto value = json::parse(line);
      if (!value.contains("topic")) {
        read.file = value;
        continue;
      }
      if (value.contains("error")) ++read.errors[value["topic"].get<std::string>()];
      read.messages.push_back(value);
    }
    return read;
  }

  static inline std::unique_ptr<test::Folder> place_;
  static inline std::string why_not_;
};

double number(const json& text) { return std::stod(text.get<std::string>()); }

void expectSame(const json& read, const Objects& written) {
  EXPECT_EQ(read["stamp"]["seq"], std::to_string(written.stamp.sequence));
  ASSERT_EQ(read["items"].size(), written.objects.size());
  for (std::size_t i = 0; i < written.objects.size(); ++i) {
    const ObjectBelief& object = written.objects[i];
    const json& item = read["items"][i];
    EXPECT_EQ(item["object_id"], std::to_string(object.id));
    EXPECT_EQ(item["existence"].get<double>(), object.existence);
    ASSERT_EQ(item["classes"].size(), object.classes.size());
    for (std::size_t k = 0; k < object.classes.size(); ++k) {
      EXPECT_EQ(item["classes"][k]["name"], object.classes[k].name);
      EXPECT_EQ(number(item["classes"][k]["mean"][3]), object.classes[k].mean[3]);
      EXPECT_EQ(number(item["classes"][k]["covariance"][27]), object.classes[k].covariance(6, 6));
    }
    EXPECT_EQ(item["why_classes"].size(), object.why.classes.size());
  }
}

TEST_F(NpmReader, ReadsARecordingByItsIndexAndItsFinalTypesAsTheyAre) {
  const Read read = readByNode("raw.mcap");
  EXPECT_EQ(read.messages.size(), kTopics * kOfEach);
  EXPECT_EQ(read.file["messages"], std::to_string(kTopics * kOfEach));
  EXPECT_EQ(read.file["chunks"], kTopics);
  EXPECT_EQ(read.file["schemas"], json(std::vector<std::string>(kTopics, "omgidl")));
  for (const char* topic : {"frame/cam0", "imu", "speed", "odometry", "landmarks"}) {
    EXPECT_FALSE(read.errors.contains(std::string("perdure/ego/") + topic)) << topic;
  }
}

TEST_F(NpmReader, ReadsEveryMessageOfAnExportedRecording) {
  EXPECT_TRUE(exportPlain(place_->file("raw.mcap"), place_->file("plain.mcap")).all().empty());
  const Read read = readByNode("plain.mcap");
  EXPECT_EQ(read.messages.size(), kTopics * kOfEach);
  for (const auto& [topic, n] : read.errors) ADD_FAILURE() << topic << ": " << n;
  int objects = 0;
  for (const json& message : read.messages) {
    if (message["topic"] != "perdure/ego/objects") continue;
    Objects written;
    wire::Examples(static_cast<unsigned>(std::stoul(message["log"].get<std::string>())) - 1000)
        .fill(written);
    expectSame(message["value"], written);
    ++objects;
  }
  EXPECT_EQ(objects, kOfEach);
}

TEST_F(NpmReader, ReadsAFileThatWasCutAndRepaired) {
  const auto cut = place_->file("cut.mcap");
  std::filesystem::copy_file(place_->file("raw.mcap"), cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);
  {
    auto reader = replay::mcap::Reader::open(cut);
    ASSERT_TRUE(reader->finish());
  }
  const Read read = readByNode("cut.mcap");
  EXPECT_GT(read.messages.size(), 6u);
  EXPECT_EQ(read.file["messages"], std::to_string(read.messages.size()));
}

}  // namespace
}  // namespace perdure::tools
