// Tests perdure-gateway with foreign programs: Foxglove's client, and a browser with the page.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <thread>

#include "common/bus/endpoint.h"
#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tests/services/gateway/objects.h"

namespace perdure::gateway::test {
namespace {

using namespace std::chrono_literals;
using namespace perdure::test;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A drive at 10 Hz with all displayed topics: three cars, one of which the vehicle passes.
class Drive {
 public:
  explicit Drive(const bus::Participant& participant)
      : calibration_(participant, bus::kTopic<Calibration>),
        odometry_(participant, bus::kTopic<Odometry>),
        landmarks_(participant, bus::kTopic<Landmarks>),
        detections_(participant, bus::kTopic<Detections>),
        model_(participant, bus::kTopic<ModelInfo>),
        objects_(participant, bus::kTopic<Objects>),
        events_(participant, bus::kTopic<Event>),
        tiles_(participant, bus::kTopic<MapTile>),
        map_frame_(participant, bus::kTopic<MapFrame>),
        replies_(participant, bus::kTopic<MapReply>),
        queries_(participant, bus::kTopic<MapQuery>),
        imu_(participant, bus::kTopic<ImuSample>),
        speed_(participant, bus::kTopic<SpeedSample>),
        frames_(participant, bus::frameTopic("cam0")) {
    Calibration calibration = forwardCamera();
    calibration.source = 42;
    (void)calibration_.write(calibration);
    ModelInfo model;
    model.hash = 9;
    model.name = "net";
    model.classes = {"car"};
    (void)model_.write(model);
    (void)events_.write(eventOf(EventKind::kBorn, 1));
    (void)events_.write(eventOf(EventKind::kConfirmed, 1));
    thread_ = std::thread([this] {
      for (std::uint64_t i = 1; !over_; ++i) {
        step(i);
        std::this_thread::sleep_for(100ms);
      }
    });
  }
  ~Drive() {
    over_ = true;
    thread_.join();
  }
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;

 private:
  void step(std::uint64_t i) {
    std::vector<ObjectBelief> cars;
    for (ObjectId id = 1; id <= 3; ++id)
      cars.push_back(
          objectAt(id, {4.0 + 6.0 * static_cast<double>(id), id % 2 == 0 ? 3.0 : -3.0, 0}));
    cars[2].visibility = Visibility::kOccluded;
    cars[2].blocked_by = 1;
    const Objects objects = frameOf(i, cars);
    Odometry odometry;
    odometry.stamp = objects.stamp;
    odometry.world = objects.world;
    odometry.state = OdometryState::kTracking;
    odometry.T_WB.p.x() = 0.01 * static_cast<double>(i);
    odometry.covariance.setIdentity();
    (void)odometry_.write(odometry);
    (void)imu_.write(ImuSample{42, i, objects.stamp.time, {0, 0, 0.1}, {0, 0, 9.8}});
    (void)speed_.write(SpeedSample{42, i, objects.stamp.time, 1.0, 0.1});
    Landmarks landmarks;
    landmarks.stamp = objects.stamp;
    landmarks.world = objects.world;
    landmarks.camera = "cam0";
    landmarks.landmarks.resize(5);
    for (Landmark& one : landmarks.landmarks) one.p_W.x() = 5, one.covariance.setIdentity();
    (void)landmarks_.write(landmarks);
    Detections detections;
    detections.stamp = objects.stamp;
    detections.camera = "cam0";
    detections.model_hash = 9;
    detections.detections = {test::detectionOf({100, 100, 200, 200}, {0.F, 2.F}),
                             test::detectionOf({364, 202, 539, 278}, {0.F, 2.F})};  // box of the
                                                                                    // first car
    (void)detections_.write(detections);
    Frame frame;
    frame.stamp = objects.stamp;
    frame.camera = "cam0";
    frame.width = 640, frame.height = 480;
    frame.data = std::make_shared<const std::vector<std::uint8_t>>(640 * 480, std::uint8_t{70});
    (void)frames_.write(frame);
    (void)objects_.write(objects);
    if (i % 10 == 1) tellMap(i, objects);
    queries_.drain([&](const MapQuery& query) {
      if (query.kind != MapQueryKind::kGraph) return;
      (void)replies_.write(test::graphFor(query, {70, 1}));
      if (!std::exchange(told_loop_, true)) tellLoop(objects);  // a client displays the graph
    });
  }

  /// A bicycle 12 m ahead in W, from an earlier session; W is 100 m to the left in M.
  void tellMap(std::uint64_t i, const Objects& objects) {
    MapFrame frame;
    frame.stamp = objects.stamp;
    frame.world = objects.world;
    frame.map = {70, 1};
    frame.T_MW.p.y() = 100;
    frame.sessions = 2;
    frame.loops = 1;
    frame.anchors = 3;  // the uncertainty of the body's position on the map is unknown
    (void)map_frame_.write(frame);
    MapTile tile;
    tile.revision = i;
    tile.objects.resize(1);
    tile.objects[0].id = 77;
    tile.objects[0].class_name = "bicycle";
    tile.objects[0].class_probability = tile.objects[0].existence = 0.9;
    tile.objects[0].mean << 12, 100, 0, 0, 0.5, -0.5, 0;
    tile.objects[0].world = frame.map;
    tile.objects[0].provisional = true;
    (void)tiles_.write(tile);
  }

  void tellLoop(const Objects& objects) {
    Event loop = eventOf(EventKind::kLoopClosed, 0);
    loop.stamp = objects.stamp;
    loop.world = objects.world;
    loop.detail = "loop 1, by 4 objects";
    (void)events_.write(loop);
  }

  bus::Writer<Calibration> calibration_;
  bus::Writer<Odometry> odometry_;
  bus::Writer<Landmarks> landmarks_;
  bus::Writer<Detections> detections_;
  bus::Writer<ModelInfo> model_;
  bus::Writer<Objects> objects_;
  bus::Writer<Event> events_;
  bus::Writer<MapTile> tiles_;
  bus::Writer<MapFrame> map_frame_;
  bus::Writer<MapReply> replies_;
  bus::Reader<MapQuery> queries_;
  bus::Writer<ImuSample> imu_;
  bus::Writer<SpeedSample> speed_;
  bus::Writer<Frame> frames_;
  bool told_loop_ = false;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

/// Answers queries by id, class, place and for all objects about the first two cars of the drive.
/// Takes corrections of them.
class MapStore {
 public:
  explicit MapStore(const bus::Participant& participant)
      : replies_(participant, bus::kTopic<MapReply>),
        queries_(participant, bus::kTopic<MapQuery>),
        corrections_(participant, bus::kTopic<MapCorrection>),
        loop_(participant) {
    loop_.on(corrections_, [this](const MapCorrection& request) { correct(request); });
    loop_.on(queries_, [this](const MapQuery& query) { answer(query); });
    thread_ = std::thread([this] { loop_.run(); });
  }
  ~MapStore() {
    loop_.stop();
    thread_.join();
  }
  MapStore(const MapStore&) = delete;
  MapStore& operator=(const MapStore&) = delete;

 private:
  void answer(const MapQuery& query) {
    if (query.kind == MapQueryKind::kGraph) return;  // the drive answers
    MapReply reply;
    reply.client = query.client;
    reply.request = query.request;
    for (ObjectId id = 1; id <= 2; ++id) {
      if (query.kind == MapQueryKind::kById && query.object_id != id) continue;
      ObjectBelief car = objectAt(id, {10.0 * static_cast<double>(id), 3.0, 0});
      car.seen_from[8] = 20.0F;
      perdure::correct(standing_, car);
      reply.objects.push_back(test::rowOf(car));
      if (query.kind == MapQueryKind::kById) reply.beliefs.push_back(car);
    }
    (void)replies_.write(reply);
  }

  void correct(const MapCorrection& request) {
    MapReply reply;
    reply.client = request.client;
    reply.request = request.request;
    Correction made = request.correction;
    if (made.withdrawn) {
      made.object = standing_.begin()->first;
      standing_.clear();
    } else {
      made.id = 4;
      standing_ = {{made.object, {made}}};
    }
    reply.corrections = {made};
    (void)replies_.write(reply);
  }

  CorrectionsOf standing_;
  bus::Writer<MapReply> replies_;
  bus::Reader<MapQuery> queries_;
  bus::Reader<MapCorrection> corrections_;
  bus::WaitLoop loop_;
  std::thread thread_;
};

/// The truth of the drive in a frame with x to the left and the origin 5 m to the right of W's, as
/// the demo writes it: the first car is (0.3, −0.4) m from its estimate, and the body drives at
/// 1 cm/s.
constexpr char kTruth[] = R"({
  "path": [[0, 5, 0, 0, 0, 0, 0.70710678, 0.70710678], [1000, 5, 10, 0, 0, 0, 0.70710678, 0.70710678]],
  "objects": [
    {"id": 4, "class": "car", "size": [4, 1.8, 1.5], "from": 0, "until": 1e9, "moves": false,
     "keys": [[0, 8.4, 10.3, 0, 2.0708]]},
    {"id": 5, "class": "car", "size": [4, 1.8, 1.5], "from": 0, "until": 1, "moves": false,
     "keys": [[0, 8, 10, 0, 2.0708]]}]})";

class Strangers : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* modules = std::getenv("PERDURE_STRANGERS");
    if (modules == nullptr || !std::filesystem::exists(std::filesystem::path(modules) / "ws") ||
        !findProgram("node")) {
      GTEST_SKIP() << "npm is not here, or got nothing: clients of other people are not tried";
    }
    modules_ = modules;
    std::ofstream(folder_.file("truth.json")) << kTruth;
    start({"page.truth=" + folder_.file("truth.json")});
  }
  void start(const std::vector<std::string>& settings) {
    std::vector<std::string> command{(programs() / "perdure-gateway").string(), "--port", "0"};
    for (const std::string& setting : settings) command.insert(command.end(), {"--set", setting});
    gateway_.reset();
    gateway_ = std::make_unique<Child>(command, folder_.file("log"));
    const std::regex pattern("http://[^:]*:([0-9]+)/");
    std::smatch found;
    ASSERT_TRUE(eventually(20s, [&] {
      const std::string log = gateway_->log();
      if (!std::regex_search(log, found, pattern)) return false;
      port_ = found[1];
      return true;
    })) << gateway_->log();
  }
  json answer(const std::string& script, std::vector<std::string> more) {
    more.insert(more.begin(), port_);
    return answerOf(script, more);
  }
  json answerOf(const std::string& script, const std::vector<std::string>& more) {
    std::vector<std::string> command{
        "node", (sources() / "tests/services/gateway/strangers" / script).string(), modules_};
    command.insert(command.end(), more.begin(), more.end());
    Child node(command, folder_.file(script));
    status_ = node.wait(260s);
    return json::parse(node.log(), nullptr, false);
  }

  bus::Domain domain_{ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  Folder folder_;
  std::unique_ptr<Child> gateway_;
  std::string modules_, port_;
  int status_ = -1;
};

TEST_F(Strangers, FoxglovesClientSubscribesEveryChannelInBothSubprotocols) {
  const Drive drive(participant_);
  for (const char* protocol : {"foxglove.sdk.v1", "foxglove.websocket.v1"}) {
    const json said = answer("foxglove.mjs", {protocol});
    ASSERT_TRUE(said.is_object()) << contentsOf(folder_.file("foxglove.mjs"));
    EXPECT_THAT(said["problems"], IsEmpty()) << said.dump(1);
    EXPECT_EQ(said["channels"], 25);
    EXPECT_EQ(status_, 0);
  }
}

TEST_F(Strangers, TheSdkOfTheModelContextProtocolAsksTheMap) {
  const Drive drive(participant_);
  const MapStore store(participant_);
  const std::string url = "http://127.0.0.1:" + port_ + "/mcp";
  const std::string perdure = (programs() / "perdure").string();
  for (const std::string revision : {"2024-11-05", "2025-03-26", "2025-06-18", ""}) {
    for (const auto& transport : {std::vector<std::string>{"http", url, "none", revision},
                                  {"stdio", revision, perdure, "mcp"}}) {
      const json said = answerOf("mcp.mjs", transport);
      ASSERT_TRUE(said.is_object()) << contentsOf(folder_.file("mcp.mjs")) << gateway_->log();
      EXPECT_THAT(said["problems"], IsEmpty()) << said.dump(1);
      EXPECT_EQ(said["server"], "perdure");
      EXPECT_EQ(said["agreed"], revision.empty() ? "2025-06-18" : revision) << transport[0];
      EXPECT_EQ(said["tools"].size(), 5u);
      EXPECT_EQ(said["results"]["find_objects"]["items"], 2);
      EXPECT_EQ(status_, 0);
    }
  }
}

TEST_F(Strangers, TheSdkOfTheModelContextProtocolCorrectsTheMapWhereThatIsAllowed) {
  start({"http.token=s3cret"});
  const Drive drive(participant_);
  const MapStore store(participant_);
  const std::string url = "http://127.0.0.1:" + port_ + "/mcp";
  const std::string perdure = (programs() / "perdure").string();
  for (const auto& transport : {std::vector<std::string>{"http", url, "s3cret", ""},
                                {"stdio", "", perdure, "mcp", "--allow-corrections"}}) {
    const json said = answerOf("mcp.mjs", transport);
    ASSERT_TRUE(said.is_object()) << contentsOf(folder_.file("mcp.mjs")) << gateway_->log();
    EXPECT_THAT(said["problems"], IsEmpty()) << said.dump(1);
    EXPECT_EQ(said["tools"].size(), 6u);
    EXPECT_EQ(said["results"]["correct"]["correction"]["withdrawn"], true);
  }
}

TEST_F(Strangers, TheConformanceClientOfTheModelContextProtocolFindsNoFault) {
  const std::string client = modules_ + "/@modelcontextprotocol/conformance/dist/index.js";
  for (const char* scenario : {"server-initialize", "ping", "tools-list"}) {
    Child node({"node", client, "server", "--url", "http://127.0.0.1:" + port_ + "/mcp",
                "--scenario", scenario},
               folder_.file(scenario));
    EXPECT_EQ(node.wait(60s), 0) << scenario << "\n" << node.log();
    EXPECT_THAT(node.log(), HasSubstr("1/1, 0 failed, 0 warnings")) << scenario;
  }
}

TEST_F(Strangers, ABrowserShowsThePage) {
  if (!findProgram("chromium")) GTEST_SKIP() << "chromium is not here: the page is not looked at";
  if (!std::filesystem::exists(programs().parent_path() / "share/perdure/viewer/index.html")) {
    GTEST_SKIP() << "the page was not built, for want of npm";
  }
  const Drive drive(participant_);
  const json said = answer("page.mjs", {folder_.file("pictures")});
  ASSERT_TRUE(said.is_object()) << contentsOf(folder_.file("page.mjs"));
  EXPECT_THAT(said["problems"], IsEmpty()) << said.dump(1);
  EXPECT_EQ(said["page"]["things"], 3);
  EXPECT_EQ(said["page"]["hidden"], 1);
  EXPECT_EQ(said["page"]["remembered"], json({12, 0, 0})) << "the map lies over the working set";
  EXPECT_EQ(said["page"]["provisional"], 1);
  EXPECT_EQ(said["page"]["marks"], 1);
  EXPECT_EQ(said["graph"]["anchors"], json({{0, 0, 0}, {10, 0, 0}, {20, 1, 0}}))
      << "the graph lies over the working set";
  EXPECT_EQ(said["graph"]["loops"],
            json({{"1", "confirmed"}, {"2", "tentative"}, {"3", "withdrawn"}, {"4", "tie"}}));
  EXPECT_GT(said["page"]["images"], 0);
  EXPECT_EQ(status_, 0);
}

}  // namespace
}  // namespace perdure::gateway::test
