// Bags of ROS 1, and the messages of both ROS.
#include <bzlib.h>

#include <algorithm>

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

/// A header of ROS 1, and a grey image of 4 × 2.
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

bool takeBag(View bytes) {
  const auto file = asFile("drive.bag", bytes);
  std::uint64_t messages = 0;
  const bool read = unlessRefused([&] {
    replay::RosMessages recorded(file);
    std::set<std::string> all;
    for (const auto& [name, topic] : recorded.topics()) all.insert(name);
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
    const auto again = ros::messageOf<M>(ros::cdrOf(*cdr), ros::Encoding::kCdr, nullptr);
    require(again && ros::cdrOf(*again) == ros::cdrOf(*cdr), "what is read is written the same");
  }
  return ros::messageOf<M>(bytes, ros::Encoding::kRos1, nullptr) || cdr;
}

/// The first byte says which message.
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
           takeBag},
          {"ros_messages", 18000, messages, takeMessage}};
}

}  // namespace perdure::fuzz
