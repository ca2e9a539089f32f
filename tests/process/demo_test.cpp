// Tests the demo over the real drive: outputs, invalid arguments, end, and kill -9 of each service.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"
#include "tests/process/support.h"
#include "tools/demo/plan.h"

namespace perdure::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Json = nlohmann::json;

/// Collects the bus messages while the demo runs.
class Listener {
 public:
  Listener() {
    loop_.on(health_reader_, [this](const Health& h) { health_[h.process] = h; });
    loop_.on(objects_reader_, [this](const Objects& o) {
      if (o.instance != objects_.instance) first_of_filter_ = o;
      objects_ = o;
    });
    loop_.on(odometry_reader_, [this](const Odometry& o) { frame_ = o.stamp.sequence; });
  }
  bool until(std::chrono::milliseconds longest, const std::function<bool()>& so) {
    return eventually(longest, [&] {
      loop_.runOnce(20ms);
      return so();
    });
  }
  void listen(std::chrono::milliseconds time) {
    (void)until(time, [] { return false; });
  }
  const Health& health(const std::string& process) { return health_[process]; }
  const Objects& objects() const { return objects_; }
  /// Returns the first working set of the current filter process.
  const Objects& firstOfFilter() const { return first_of_filter_; }
  std::uint64_t frame() const { return frame_; }
  std::map<std::string, InstanceId> instances() const {
    std::map<std::string, InstanceId> all;
    for (const auto& [process, health] : health_) all[process] = health.instance;
    return all;
  }

 private:
  bus::Domain domain_{ownNetwork()};
  bus::Participant participant_{domain_, "test"};
  bus::Reader<Health> health_reader_{participant_, bus::kTopic<Health>};
  bus::Reader<Objects> objects_reader_{participant_, bus::kTopic<Objects>};
  bus::Reader<Odometry> odometry_reader_{participant_, bus::kTopic<Odometry>};
  bus::WaitLoop loop_{participant_};
  std::map<std::string, Health> health_;
  Objects objects_, first_of_filter_;
  std::uint64_t frame_ = 0;
};

class Demo : public ::testing::Test {
 protected:
  void SetUp() override {
    drive_ = data("kitti_raw/2011_09_26/2011_09_26_drive_0005_sync");
    model_ = data("weights/yolox_nano_416.onnx");
    if (drive_.empty() || model_.empty()) {
      GTEST_SKIP() << "the drive and the network are not beside the sources (../shared/data)";
    }
    (void)ownNetwork();
  }

  std::unique_ptr<Child> start(std::vector<std::string> more) {
    std::vector<std::string> command = {(programs() / "perdure").string(),
                                        "demo",
                                        "--data",
                                        drive_.string(),
                                        "--model",
                                        model_.string(),
                                        "--out",
                                        folder_.file("out"),
                                        "--root",
                                        sources().string()};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<Child>(command, folder_.file("demo.log"));
  }

  Json report() const { return Json::parse(std::ifstream(folder_.file("out/report.json"))); }
  std::string logOf(const std::string& service) const {
    return contentsOf(folder_.file("out/run/" + service + ".log"));
  }

  std::filesystem::path drive_, model_;
  Folder folder_;
};

TEST_F(Demo, WritesEveryOutputWellFormedAndEndsInOrder) {
  const auto demo = start({"--seconds", "5"});
  ASSERT_EQ(demo->wait(90s), 0) << demo->log();
  const Json result = report();
  for (const char* service : tools::kServices) {
    EXPECT_EQ(result["services"][service]["restarts"], 0) << service << logOf(service);
    EXPECT_THAT(logOf(service), HasSubstr("ends"));
  }
  EXPECT_GT(result["messages"]["odometry"], 30);
  EXPECT_GT(result["services"]["vio"]["frames_in"], 30);
  EXPECT_GT(result["latency_ms"]["median"], 0.0);
  EXPECT_GE(result["latency_ms"]["p99"], result["latency_ms"]["median"]);
  EXPECT_LT(result["latency_beyond_network_ms"]["median"], result["latency_ms"]["median"]);
  EXPECT_GT(result["latency_beyond_network_ms"]["median"], 0.0);
  for (const char* json : {"objects.json", "map.geojson", "timing.json"}) {
    EXPECT_TRUE(Json::accept(contentsOf(folder_.file(std::string("out/") + json)))) << json;
  }
  for (const char* table : {"objects_inst.csv", "objects_final.csv"}) {
    EXPECT_THAT(contentsOf(folder_.file(std::string("out/") + table)),
                HasSubstr("sequence,frame,timestamp_ns,object_id,class"));
  }
  std::ifstream events(folder_.file("out/events.jsonl"));
  for (std::string line; std::getline(events, line);) EXPECT_TRUE(Json::accept(line)) << line;
  EXPECT_GT(contentsOf(folder_.file("out/trajectory.tum")).size(), 1000u);
}

TEST_F(Demo, EndsInOrderWithAReportWhenItIsInterrupted) {
  const auto demo = start({});
  Listener listener;
  ASSERT_TRUE(listener.until(60s, [&] { return listener.frame() > 5; })) << demo->log();
  demo->signal(SIGINT);
  EXPECT_EQ(demo->wait(20s), 130) << demo->log();
  EXPECT_EQ(report()["complete"], false);
  EXPECT_THAT(logOf("map_store"), HasSubstr("ends"));
}

TEST_F(Demo, SaysWhatIsMissing) {
  model_ = folder_.file("text.onnx");
  std::ofstream(model_) << "this is no network";
  const auto demo = start({});
  EXPECT_THAT(demo->wait(60s), ::testing::AnyOf(69, 78)) << demo->log();
  EXPECT_THAT(demo->log(), HasSubstr("inference does not start"));
  Child without({(programs() / "perdure").string(), "demo", "--data", drive_.string()},
                folder_.file("without"));
  EXPECT_EQ(without.wait(10s), 64);
  EXPECT_THAT(without.log(), HasSubstr("--model FILE.onnx"));
}

/// Counts the confirmed objects of `before`, and those still in `after`; gives the median motion of
/// those estimated as standing. A cyclist and a van drive ahead.
struct Kept {
  std::size_t before = 0, after = 0;
  double moved_m = 0.0;
};

Kept compare(const Objects& before, const Objects& after) {
  Kept kept;
  std::vector<double> moved;
  for (const ObjectBelief& old : before.objects) {
    if (!old.confirmed) continue;
    ++kept.before;
    for (const ObjectBelief& now : after.objects) {
      if (now.id != old.id) continue;
      ++kept.after;
      if (old.moving > 0.5 || now.moving > 0.5) continue;
      moved.push_back((now.best().mean.head<3>() - old.best().mean.head<3>()).norm());
    }
  }
  std::sort(moved.begin(), moved.end());
  if (!moved.empty()) kept.moved_m = moved[moved.size() / 2];
  return kept;
}

class DemoFaults : public Demo {};

TEST_F(DemoFaults, SurvivesTheDeathOfEachServiceAndKeepsTheIds) {
  const auto demo = start({"--rate", "0.5"});
  Listener listener;
  ASSERT_TRUE(listener.until(60s, [&] { return listener.frame() >= 25; })) << demo->log();
  for (const std::string service :
       {"map_store", "inference", "semantic_filter", "vio", "capture"}) {
    SCOPED_TRACE(service);
    auto before = listener.instances();
    const Objects known = listener.objects();
    const std::uint64_t frame = listener.frame();
    kill(static_cast<pid_t>(listener.health(service).pid), SIGKILL);
    ASSERT_TRUE(listener.until(5s, [&] {
      const Health& now = listener.health(service);
      return now.instance != before[service] && now.state != HealthState::kStarting;
    })) << logOf(service);
    before[service] = listener.health(service).instance;
    listener.listen(1500ms);
    EXPECT_EQ(listener.instances(), before) << "something else was restarted too";
    EXPECT_GT(listener.frame(), frame);
    EXPECT_GE(listener.objects().next_id, known.next_id) << "ids could be given twice";
    EXPECT_EQ(listener.objects().world, known.world) << "the frame of reference was lost";
    const bool filter = service == "semantic_filter";
    const Kept kept = compare(known, filter ? listener.firstOfFilter() : listener.objects());
    EXPECT_GE(2 * kept.after, kept.before) << "ids did not survive";
    if (filter) {
      EXPECT_GE(10 * kept.after, 8 * kept.before) << "of the working set";
      EXPECT_LT(kept.moved_m, 1.0) << "ids are of other objects now";
    }
  }
  ASSERT_EQ(demo->wait(90s), 0) << demo->log();
  const Json result = report();
  for (const char* service : tools::kServices) {
    EXPECT_EQ(result["services"][service]["restarts"], 1) << service;
  }
  EXPECT_EQ(result["frames"], 154);
}

}  // namespace
}  // namespace perdure::test
