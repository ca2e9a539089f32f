// Map files in tests of the fleet: vehicles that write them, and bit-exact access to their rows.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "services/map_store/core/map_database.h"
#include "services/map_store/fleet/replicator.h"
#include "services/map_store/node.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::map_store::test {

/// Tables that a vehicle and its server share, and tables derived from them.
inline constexpr const char* kCommonTables[] = {"graph_classes", "anchors", "anchor_poses",
                                                "edges",         "objects", "sightings",
                                                "views",         "working", "positions"};

/// All rows of a table, bit by bit and in order.
inline std::vector<std::string> rowsOf(const std::string& path, const std::string& table) {
  const auto connection = Connection::open(path, Connection::Mode::kReadOnly).value();
  const auto columns =
      connection.integer("SELECT count(*) FROM pragma_table_info('" + table + "')").value();
  auto rows = connection.prepare("SELECT * FROM " + table + " ORDER BY 1").value();
  std::vector<std::string> all;
  while (rows.step().value()) {
    ByteWriter row;
    for (int i = 0; i < columns; ++i) {
      const auto blob = rows.blob(i);
      row(rows.isNull(i));
      // The bits of a number; for other values the bytes that SQLite returns.
      row(rows.isNumber(i) ? rows.real(i) : 0.0);
      row(rows.isNumber(i) ? rows.integer(i) : std::int64_t{0});
      row(rows.isNumber(i) ? std::string() : std::string(blob.begin(), blob.end()));
    }
    const Bytes bytes = row.take();
    all.emplace_back(bytes.begin(), bytes.end());
  }
  return all;
}

inline std::vector<std::string> metaOf(const std::string& path) {
  const auto connection = Connection::open(path, Connection::Mode::kReadOnly).value();
  auto rows = connection
                  .prepare(
                      "SELECT key, typeof(value), value FROM meta WHERE key IN "
                      "('revision', 'tile_size_m', 'working') ORDER BY key")
                  .value();
  std::vector<std::string> all;
  while (rows.step().value()) {
    const auto blob = rows.blob(2);
    all.push_back(rows.text(0) + rows.text(1) + std::string(blob.begin(), blob.end()));
  }
  return all;
}

inline Config configOf(const std::string& path, const std::string& url,
                       const std::string& vehicle = "red") {
  Config config;
  config.store_path = path;
  config.graph = false;
  config.fleet.url = url;
  config.fleet.vehicle = vehicle;
  return config;
}

inline Outputs noOutputs() {
  return {[](const MapTile&) {}, [](const MapTile&) {}, [](const MapHeader&) {},
          [](const MapReply&) {}, [](const MapNear&) {}};
}

/// A vehicle's node and its replicator, connected as in main.cpp. Each step is one commit.
class Vehicle {
 public:
  Vehicle(const Config& config, const fleet::Pace& pace, InstanceId filter = 11)
      : node_(config, 5, noOutputs()),
        fleet_(config.fleet, config.store_path, pace),
        filter_(filter) {}

  /// Frame `n` of a drive past cars: the working set has twenty cars, and the oldest leaves.
  void step(std::uint64_t n) {
    std::vector<ObjectBelief> cars;
    for (ObjectId id = n > 20 ? n - 19 : 1; id <= n; ++id) {
      if (id % 10 == 5 && n >= id + 5) continue;  // this car is gone
      cars.push_back(carAt(id, {3.0 * static_cast<double>(id), 0.1 * static_cast<double>(n), 0}));
    }
    Objects objects = workingSet(n, cars, filter_);
    if (n % 10 == 0) objects.ended = {{n - 5, 0, objects.stamp.time}};
    node_.onObjects(objects);
    node_.tick(std::chrono::milliseconds(600 * n));
    fleet_.wake();
    node_.onAcknowledged(fleet_.progress().sent);
  }
  Node& node() { return node_; }
  fleet::Replicator& fleet() { return fleet_; }

 private:
  Node node_;
  fleet::Replicator fleet_;
  InstanceId filter_;
};

/// Short waits, so that tests are short.
inline fleet::Pace quick() {
  using std::chrono::milliseconds;
  fleet::Pace pace;
  pace.connect = milliseconds(20'000);
  pace.answer = milliseconds(20'000);
  pace.first_retry = milliseconds(20);
  pace.longest_retry = milliseconds(200);
  return pace;
}

constexpr std::chrono::milliseconds kLong{180'000};  // time limit of a test

/// Returns false if the condition does not become true within that time.
template <class So>
bool eventually(So so) {
  for (int tries = 0; tries < 6000; ++tries) {
    if (so()) return true;
    usleep(10'000);
  }
  return false;
}

}  // namespace perdure::map_store::test

/// Gets the server for a test, or skips the test with a message.
#define PERDURE_SERVER_OR_SKIP()                                            \
  test::PostgresServer::get();                                              \
  if (test::PostgresServer::get() == nullptr) {                             \
    GTEST_SKIP() << "PostgreSQL is not installed (deploy/install --fleet)"; \
  }
