// usage: graph_file_bench [RECORDS ANCHORS EDGES]
// What the pose graph costs in the map's file (100,000 sightings, 5,000 anchors, 6,000 edges):
// writing all of it once, reading it as at a start, and the commits of a drive: the poses of all
// anchors after a loop, the same with all covariances of the odometry, sixty sightings, and nothing
// of the graph. Medians of five runs, wall time (most of a commit is the sync), and what went to
// the write-ahead log.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace {

using namespace perdure;
using namespace perdure::map_store;

constexpr int kRuns = 5;

template <class Act>
double millisecondsOf(Act act) {
  const auto start = std::chrono::steady_clock::now();
  act();
  const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
  return taken.count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

class Bench {
 public:
  explicit Bench(mapping::SavedMap map) : map_(std::move(map)) {}

  /// Milliseconds of a commit of `graph`; its log is begun anew before.
  double commit(const mapping::Unsaved* graph, double* log_kb) {
    checkpoint();
    Objects objects = test::workingSet(++sequence_, {});
    Batch batch{&objects, {}, {}};
    batch.graph = graph;
    const double taken = millisecondsOf([&] { must(database_.write(batch).has_value()); });
    *log_kb = static_cast<double>(walPages()) * 4096.0 / 1024.0;
    return taken;
  }
  void measure(const char* what, const mapping::Unsaved* graph, int runs = kRuns) {
    std::vector<double> times, logs;
    for (int run = 0; run < runs; ++run) {
      double log_kb = 0.0;
      times.push_back(commit(graph, &log_kb));
      logs.push_back(log_kb);
    }
    std::printf("%-34s %9.1f ms %10.0f kB\n", what, median(times), median(logs));
  }
  void read() {
    std::vector<double> times;
    for (int run = 0; run < kRuns; ++run) {
      times.push_back(millisecondsOf([&] {
        const Connection connection = openStoreForReading(path());
        const auto graph = MapReader(&connection).graph();
        must(graph && graph->malformed == 0 && graph->map.records.size() == map_.records.size());
      }));
    }
    std::printf("%-34s %9.1f ms\n", "read at the start", median(times));
  }
  const mapping::SavedMap& map() const { return map_; }

 private:
  static void must(bool holds) {
    if (!holds) std::exit(1);
  }
  std::string path() const { return folder_.file("map.sqlite"); }
  /// Everything into the file, so that the next commit is alone in the log.
  void checkpoint() const {
    const auto other = Connection::open(path(), Connection::Mode::kReadWriteCreate);
    must(other.has_value() && other->execute("PRAGMA wal_checkpoint(TRUNCATE)").has_value());
  }
  std::int64_t walPages() const {
    std::error_code none;
    const auto size = std::filesystem::file_size(path() + "-wal", none);
    return none ? 0 : static_cast<std::int64_t>(size) / 4096;
  }

  test::TemporaryFolder folder_;
  mapping::SavedMap map_;
  MapDatabase database_{{path()}};
  std::uint64_t sequence_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, long otherwise) {
    return static_cast<std::size_t>(argc > i ? std::max(1L, std::atol(argv[i])) : otherwise);
  };
  const test::GraphSize size{number(2, 5000), number(3, 6000), number(1, 100'000), 1};
  Bench bench(test::RandomGraph(1).map(size));
  mapping::Unsaved all{bench.map(), {}, {}}, poses, loop, drive;
  poses.changed.classes = loop.changed.classes = drive.changed.classes = bench.map().classes;
  poses.changed.anchors = loop.changed.anchors = bench.map().anchors;
  loop.changed.edges = bench.map().edges;
  for (const auto& [id, record] : bench.map().records) {
    if (drive.changed.records.size() < 60) drive.changed.records[id] = record;
  }
  std::printf("%zu sightings, %zu anchors, %zu edges\n", size.records, size.anchors, size.edges);
  bench.measure("all of it, once", &all, 1);
  bench.read();
  bench.measure("poses of all anchors", &poses);
  bench.measure("the same and all edges", &loop);
  bench.measure("sixty sightings", &drive);
  bench.measure("nothing of the graph", nullptr);
  return 0;
}
