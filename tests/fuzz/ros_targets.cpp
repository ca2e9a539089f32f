// Targets: bags of ROS 1, SQLite recordings of ROS 2, and the messages of both.
#include <bzlib.h>
#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "common/base/errors.h"
#include "common/replay/dataset.h"
#include "common/replay/recordings/ros_messages.h"
#include "common/ros/images.h"
#include "common/ros/mirror.h"
#include "common/ros/sensors.h"
#include "tests/fuzz/scratch.h"
#include "tests/fuzz/target.h"

namespace perdure::fuzz {
namespace {

void put32(Bytes& to, std::size_t number) {
  for (int shift = 0; shift < 32; shift += 8)
    to.push_back(static_cast<std::uint8_t>(number >> shift));
}

void putBytes(Bytes& to, const Bytes& bytes) {
  put32(to, bytes.size());
  to.insert(to.end(), bytes.begin(), bytes.end());
}

Bytes number(std::size_t value) {
  Bytes bytes;
  put32(bytes, value);
  return bytes;
}

Bytes fields(const std::vector<std::pair<std::string, Bytes>>& list) {
  Bytes head;
  for (const auto& [name, value] : list) {
    Bytes field = bytesOf(name + "=");
    field.insert(field.end(), value.begin(), value.end());
    putBytes(head, field);
  }
  return head;
}

void putRecord(Bytes& to, const Bytes& head, const Bytes& data) {
  putBytes(to, head);
  putBytes(to, data);
}

Bytes connection() {
  Bytes record;
  putRecord(record,
            fields({{"op", {7}}, {"conn", number(0)}, {"topic", bytesOf("/cam0/image_raw")}}),
            fields({{"type", bytesOf("sensor_msgs/Image")}, {"md5sum", bytesOf("*")}}));
  return record;
}

/// A header of ROS 1, and a grey image of 4 × 2 pixels.
Bytes image(std::uint32_t second) {
  Bytes bytes;
  put32(bytes, second), put32(bytes, second), put32(bytes, 0);
  putBytes(bytes, bytesOf("cam0")), put32(bytes, 2), put32(bytes, 4);
  putBytes(bytes, bytesOf("mono8"));
  bytes.push_back(0);
  put32(bytes, 4);
  putBytes(bytes, {1, 2, 3, 4, 5, 6, 7, 8});
  return bytes;
}

Bytes packed(Bytes records) {
  Bytes bz2(records.size() + 600);
  auto size = static_cast<unsigned int>(bz2.size());
  BZ2_bzBuffToBuffCompress(reinterpret_cast<char*>(bz2.data()), &size,
                           reinterpret_cast<char*>(records.data()),
                           static_cast<unsigned int>(records.size()), 1, 0, 0);
  bz2.resize(size);
  return bz2;
}

/// One chunk of three images, its index, and its connection.
Bytes bag(bool compressed) {
  Bytes records = connection(), entries;
  for (std::uint32_t second = 1; second <= 3; ++second) {
    Bytes time = number(second);
    put32(time, 500), put32(entries, second), put32(entries, 500), put32(entries, records.size());
    putRecord(records, fields({{"op", {2}}, {"conn", number(0)}, {"time", time}}), image(second));
  }
  Bytes file = bytesOf("#ROSBAG V2.0\n");
  const std::size_t size = records.size();
  putRecord(file,
            fields({{"op", {5}},
                    {"compression", bytesOf(compressed ? "bz2" : "none")},
                    {"size", number(size)}}),
            compressed ? packed(std::move(records)) : records);
  putRecord(file,
            fields({{"op", {4}}, {"ver", number(1)}, {"conn", number(0)}, {"count", number(3)}}),
            entries);
  const Bytes known = connection();
  file.insert(file.end(), known.begin(), known.end());
  return file;
}

/// Runs SQL statements on a database.
class Db3 {
 public:
  explicit Db3(const std::filesystem::path& file) {
    std::filesystem::remove(file);
    require(sqlite3_open(file.c_str(), &database_) == SQLITE_OK, "there is a database");
  }
  ~Db3() { sqlite3_close(database_); }
  Db3(const Db3&) = delete;
  Db3& operator=(const Db3&) = delete;

  void run(const std::string& sql, const Bytes& blob = {}) {
    sqlite3_stmt* statement = nullptr;
    require(sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement, nullptr) == SQLITE_OK, sql);
    sqlite3_bind_blob(statement, 1, blob.data(), static_cast<int>(blob.size()), SQLITE_TRANSIENT);
    while (sqlite3_step(statement) == SQLITE_ROW) {
    }
    require(sqlite3_finalize(statement) == SQLITE_OK, sql);
  }

 private:
  sqlite3* database_ = nullptr;
};

Bytes imageCdr(std::int32_t second) {
  ros::Image image;
  image.header = {{second, 0}, "cam0"};
  image.height = 2, image.width = image.step = 4;
  image.encoding = "mono8";
  image.data = std::make_shared<Bytes>(Bytes{1, 2, 3, 4, 5, 6, 7, 8});
  return ros::cdrOf(image);
}

Bytes infoCdr() {
  ros::CameraInfo info;
  info.header.frame_id = "cam0";
  info.height = 2, info.width = 4;
  info.distortion_model = "plumb_bob";
  info.d = {0, 0, 0, 0, 0};
  info.k = {3, 0, 2, 0, 3, 1, 0, 0, 1};
  return ros::cdrOf(info);
}

/// A recording of two images and their camera information. `views`: topics and messages are views
/// instead of tables.
Bytes db3(bool views) {
  const auto file = scratch() / "seed.db3";
  {
    Db3 made(file);
    made.run("PRAGMA page_size = 512");
    const std::string put = views ? "_" : "";
    made.run("CREATE TABLE topics" + put +
             "(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)");
    made.run("CREATE TABLE messages" + put +
             "(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)");
    made.run("CREATE INDEX timestamp_idx ON messages" + put + "(timestamp ASC)");
    if (views) made.run("CREATE VIEW topics AS SELECT * FROM topics_");
    if (views) made.run("CREATE VIEW messages AS SELECT * FROM messages_");
    made.run("INSERT INTO topics" + put +
             " VALUES(1, '/cam0/image_raw', 'sensor_msgs/msg/Image', 'cdr'), "
             "(2, '/cam0/camera_info', 'sensor_msgs/msg/CameraInfo', 'cdr')");
    made.run("INSERT INTO messages" + put + " VALUES(1, 2, 1000000000, ?1)", infoCdr());
    made.run("INSERT INTO messages" + put + " VALUES(2, 1, 1000000001, ?1)", imageCdr(1));
    made.run("INSERT INTO messages" + put + " VALUES(3, 1, 2000000000, ?1)", imageCdr(2));
  }
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

bool takeRecording(const char* name, View bytes) {
  const auto file = asFile(name, bytes);
  std::uint64_t messages = 0;
  const bool read = unlessRefused([&] {
    replay::RosMessages recorded(file);
    std::set<std::string> all;
    for (const auto& [topic, what] : recorded.topics()) all.insert(topic);
    recorded.rewind(all);
    std::uint64_t last = 0;
    while (const auto message = recorded.next()) {
      require(message->log_ns >= last, "log times do not go back");
      last = message->log_ns;
      const auto frame = recorded.valueOf<ros::Image>(*message);
      if (frame) messages += ros::frameOf(*frame) ? 1 : 0;
    }
  });
  (void)unlessRefused([&] {
    const auto dataset = replay::Dataset::open({.path = file});
    while (dataset->next()) {
    }
  });
  return read && messages > 0;
}

template <class M>
bool isMessage(View bytes) {
  const auto cdr = ros::messageOf<M>(bytes, ros::Encoding::kCdr, nullptr);
  if (cdr) {
    const Bytes written = ros::cdrOf(*cdr);  // holds the image data of `again`
    const auto again = ros::messageOf<M>(written, ros::Encoding::kCdr, nullptr);
    require(again && ros::cdrOf(*again) == written, "what is read is written the same");
  }
  return ros::messageOf<M>(bytes, ros::Encoding::kRos1, nullptr) || cdr;
}

/// The first byte selects the message type.
bool takeMessage(View bytes) {
  if (bytes.empty()) return false;
  const View rest = bytes.subspan(1);
  switch (bytes[0] % 6) {
    case 0:
      return isMessage<ros::Detection3DArray>(rest);
    case 1:
      return isMessage<ros::MarkerArray>(rest);
    case 2:
      return isMessage<ros::Odometry>(rest);
    case 3:
      return isMessage<ros::TFMessage>(rest);
    case 4:
      return isMessage<ros::DiagnosticArray>(rest);
    default:
      return isMessage<ros::CameraInfo>(rest);
  }
}

std::vector<Bytes> messages() {
  std::vector<Bytes> seeds;
  const auto add = [&](const auto& message) {
    Bytes seed = ros::cdrOf(message);
    seed.insert(seed.begin(), static_cast<std::uint8_t>(seeds.size()));
    seeds.push_back(std::move(seed));
  };
  ros::Detection3DArray detections{{{1, 2}, "odom"}, std::vector<ros::Detection3D>(2)};
  detections.detections[1].results.resize(2);
  add(detections);
  add(ros::MarkerArray{std::vector<ros::Marker>(2)});
  add(ros::Odometry());
  add(ros::TFMessage{std::vector<ros::TransformStamped>(2)});
  add(ros::DiagnosticArray{{}, std::vector<ros::DiagnosticStatus>(1)});
  ros::CameraInfo info;
  info.d = {1, 2, 3, 4, 5};
  add(info);
  return seeds;
}

}  // namespace

std::vector<Target> rosTargets() {
  return {{"ros_bag", 4200,
           [] {
             return std::vector<Bytes>{bag(false), bag(true)};
           },
           [](View bytes) { return takeRecording("drive.bag", bytes); }},
          {"ros_db3", 4200,
           [] {
             return std::vector<Bytes>{db3(false), db3(true)};
           },
           [](View bytes) { return takeRecording("drive.db3", bytes); }},
          {"ros_messages", 18000, messages, takeMessage}};
}

}  // namespace perdure::fuzz
