// Measures the cost of the pose graph in the map file. It times writing the whole graph once and
// reading it at a start, and four kinds of commits of a drive:
// - the poses of all anchors after a loop;
// - the same with all covariances of the odometry;
// - sixty sightings;
// - sixty objects without any change of the graph.
// With "outbox", the file's triggers collect the changes for a fleet server, and the server has
// received all of them before each commit. Prints medians of five runs: wall time (mostly the
// sync), CPU time, and the size of the write-ahead log.
// usage: graph_file_bench [RECORDS ANCHORS EDGES [outbox]] (default: 100,000 sightings, 5,000
// anchors, 6,000 edges)
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>

#include "services/map_store/core/map_database.h"
#include "services/map_store/core/outbox.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace {

using namespace perdure;
using namespace perdure::map_store;

constexpr int kRuns = 5;

/// Times in milliseconds.
struct Times {
  double wall = 0.0, cpu = 0.0;
};

double msOf(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

template <class Act>
Times timesOf(Act act) {
  const Times start{msOf(CLOCK_MONOTONIC), msOf(CLOCK_THREAD_CPUTIME_ID)};
  act();
  return {msOf(CLOCK_MONOTONIC) - start.wall, msOf(CLOCK_THREAD_CPUTIME_ID) - start.cpu};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

class Bench {
 public:
  Bench(mapping::SavedMap map, bool outbox)
      : map_(std::move(map)), database_({.path = path(), .outbox = outbox}), outbox_(outbox) {}

  /// Measures commits; the log holds one commit at a time.
  void commit(const char* what, const mapping::Unsaved* graph, int runs = kRuns, int cars = 0) {
    std::vector<double> logs;
    report(what, runs, [&](std::vector<Times>& times) {
      checkpoint();
      ++sequence_;
      const Objects objects = test::workingSet(sequence_, carsAt(sequence_, cars));
      Batch batch{&objects, {}, {}};
      batch.graph = graph;
      batch.acknowledged = outbox_ ? lastEntry() : 0;
      times.push_back(timesOf([&] { must(database_.write(batch).has_value()); }));
      logs.push_back(logKb());
    });
    std::printf("%10.0f kB\n", median(logs));
  }
  void read() {
    report("read at the start", kRuns, [&](std::vector<Times>& times) {
      times.push_back(timesOf([&] {
        const Connection connection = openStoreForReading(path());
        const auto graph = MapReader(&connection).graph();
        must(graph && graph->malformed == 0 && graph->map.records.size() == map_.records.size());
      }));
    });
    std::printf("\n");
  }
  const mapping::SavedMap& map() const { return map_; }

 private:
  static void must(bool holds) {
    if (!holds) std::exit(1);
  }
  template <class Run>
  static void report(const char* what, int runs, Run run) {
    std::vector<Times> times;
    while (runs-- > 0) run(times);
    std::vector<double> wall, cpu;
    for (const Times& each : times) wall.push_back(each.wall), cpu.push_back(each.cpu);
    std::printf("%-26s %9.2f ms, CPU %8.2f ms", what, median(wall), median(cpu));
  }
  /// Returns the cars; all of them have moved since the last frame.
  static std::vector<ObjectBelief> carsAt(std::uint64_t sequence, int cars) {
    std::vector<ObjectBelief> all;
    for (int i = 1; i <= cars; ++i) {
      const double x = 2.0 * i + 0.01 * static_cast<double>(sequence);
      all.push_back(test::carAt(static_cast<ObjectId>(i), {x, 0, 0}));
    }
    return all;
  }
  std::int64_t lastEntry() const {
    return outboxMark(Connection::open(path(), Connection::Mode::kReadOnly).value()).value().last;
  }
  std::string path() const { return folder_.file("map.sqlite"); }
  /// Moves the log into the file, so that the log holds only the next commit.
  void checkpoint() const {
    const auto other = Connection::open(path(), Connection::Mode::kReadWriteCreate);
    must(other.has_value() && other->execute("PRAGMA wal_checkpoint(TRUNCATE)").has_value());
  }
  double logKb() const {
    std::error_code none;
    const auto size = std::filesystem::file_size(path() + "-wal", none);
    return none ? 0.0 : static_cast<double>(size) / 1024.0;
  }

  test::TemporaryFolder folder_;
  mapping::SavedMap map_;
  MapDatabase database_;
  bool outbox_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, long otherwise) {
    return static_cast<std::size_t>(argc > i ? std::max(1L, std::atol(argv[i])) : otherwise);
  };
  const test::GraphSize size{number(2, 5000), number(3, 6000), number(1, 100'000), 1};
  Bench bench(test::RandomGraph(1).map(size), argc > 4 && std::string_view(argv[4]) == "outbox");
  mapping::Unsaved all{bench.map(), {}, {}}, poses, loop, drive;
  poses.changed.classes = loop.changed.classes = drive.changed.classes = bench.map().classes;
  poses.changed.anchors = loop.changed.anchors = bench.map().anchors;
  loop.changed.edges = bench.map().edges;
  for (const auto& [id, record] : bench.map().records) {
    if (drive.changed.records.size() < 60) drive.changed.records[id] = record;
  }
  std::printf("%zu sightings, %zu anchors, %zu edges\n", size.records, size.anchors, size.edges);
  bench.commit("all of it, once", &all, 1);
  bench.read();
  bench.commit("poses of all anchors", &poses);
  bench.commit("the same and all edges", &loop);
  bench.commit("sixty sightings", &drive);
  bench.commit("nothing of the graph", nullptr);
  bench.commit("sixty objects", nullptr, 4 * kRuns, 60);
  bench.commit("sixty of each", &drive, 4 * kRuns, 60);
  return 0;
}
