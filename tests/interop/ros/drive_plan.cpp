#include "tests/interop/ros/drive_plan.h"

#include <sqlite3.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "common/replay/files/rig_file.h"
#include "common/ros/bytes.h"
#include "common/ros/definition.h"
#include "common/vision/image.h"

namespace perdure::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char kImuFrame[] = "imu_link";
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kLogDelay = 1'000'000;

std::string frameOf(const std::string& camera) { return camera + "_optical"; }
std::string spaceOf(const std::string& camera, const PlanOptions& options) {
  return "/" + camera + (camera == "cam0" ? options.suffix : "");
}
std::string imageTopic(const std::string& camera, const PlanOptions& options) {
  const bool packed = options.images == PlanOptions::Images::kPng;
  return spaceOf(camera, options) + "/image_raw" + (packed ? "/compressed" : "");
}

std::string modelOf(DistortionModel model) {
  if (model == DistortionModel::kEquidistant) return "equidistant";
  return model == DistortionModel::kRational ? "rational_polynomial" : "plumb_bob";
}

std::vector<std::uint8_t> pngOf(const Frame& frame) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", *vision::viewOf(frame), png);
  return png;
}

json planOf(const CameraCalibration& camera, const PlanOptions& options) {
  const auto& T = camera.T_BC;
  auto d = camera.distortion_coefficients;
  if (camera.distortion == DistortionModel::kRadialTangential) d.push_back(0.0);  // k3
  return {{"name", camera.name},
          {"frame", frameOf(camera.name)},
          {"info_topic", spaceOf(camera.name, options) + "/camera_info"},
          {"width", camera.width},
          {"height", camera.height},
          {"model", modelOf(camera.distortion)},
          {"d", d},
          {"k", {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0}},
          {"p", {T.p.x(), T.p.y(), T.p.z()}},
          {"q", {T.q.x(), T.q.y(), T.q.z(), T.q.w()}}};
}

ros::Time timeOf(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond)};
}

/// A database that is written row by row.
class Db3 {
 public:
  Db3(const fs::path& file, bool index) {
    sqlite3_open(file.c_str(), &database_);
    run("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)");
    run("INSERT INTO schema VALUES(3, 'humble')");
    run("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
        "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)");
    run("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp "
        "INTEGER NOT NULL, data BLOB NOT NULL)");
    if (index) run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
    run("BEGIN");
  }
  ~Db3() {
    run("COMMIT");
    sqlite3_close(database_);
  }

  template <class M>
  void add(const std::string& topic, std::int64_t log_ns, const M& message) {
    if (!ids_.contains(topic)) {
      ids_.emplace(topic, static_cast<int>(ids_.size()) + 1);
      run("INSERT INTO topics VALUES(" + std::to_string(ids_[topic]) + ", '" + topic + "', '" +
          ros::ros2Name(M::kType) + "', 'cdr', '')");
    }
    const auto bytes = ros::cdrOf(message);
    sqlite3_stmt* row = nullptr;
    sqlite3_prepare_v2(database_, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)",
                       -1, &row, nullptr);
    sqlite3_bind_int(row, 1, ids_[topic]);
    sqlite3_bind_int64(row, 2, log_ns);
    sqlite3_bind_blob(row, 3, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
    sqlite3_step(row);
    sqlite3_finalize(row);
  }

 private:
  void run(const std::string& statement) {
    sqlite3_exec(database_, statement.c_str(), nullptr, nullptr, nullptr);
  }
  sqlite3* database_ = nullptr;
  std::map<std::string, int> ids_;
};

ros::TFMessage transformsOf(const Calibration& calibration, const PlanOptions& options) {
  ros::TFMessage message;
  for (const auto& camera : calibration.cameras) {
    ros::TransformStamped one;
    one.header.frame_id = kImuFrame;
    one.child_frame_id = frameOf(camera.name);
    const auto& T = camera.T_BC;
    one.transform.translation = {T.p.x(), T.p.y(), T.p.z()};
    one.transform.rotation = {T.q.x(), T.q.y(), T.q.z(), T.q.w()};
    if (options.broken_transforms) one.transform.rotation = {0, 0, 0, 2};
    message.transforms.push_back(one);
  }
  return message;
}

ros::Imu imuOf(const ImuSample& sample, const ros::Header& header) {
  ros::Imu imu;
  imu.header = header;
  imu.angular_velocity = {sample.gyro.x(), sample.gyro.y(), sample.gyro.z()};
  imu.linear_acceleration = {sample.accel.x(), sample.accel.y(), sample.accel.z()};
  return imu;
}

ros::CameraInfo infoOf(const CameraCalibration& camera, const ros::Header& header) {
  ros::CameraInfo info;
  info.header = header;
  info.width = camera.width, info.height = camera.height;
  info.distortion_model = modelOf(camera.distortion);
  info.d = camera.distortion_coefficients;
  info.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  return info;
}

ros::Image imageOf(const Frame& frame, const ros::Header& header) {
  ros::Image image;
  image.header = header;
  image.width = frame.width, image.height = frame.height;
  image.encoding = frame.encoding == ImageEncoding::kMono8 ? "mono8" : "bgr8";
  image.step = frame.width * channelsOf(frame.encoding);
  image.data = frame.data;
  return image;
}

/// Returns grey values times 16, or divided by 16 for a dark image.
ros::Image twelveBitsOf(const Frame& frame, const ros::Header& header, bool dark) {
  ros::Image image = imageOf(frame, header);
  auto bytes = std::make_shared<std::vector<std::uint8_t>>();
  for (const std::uint8_t grey : *frame.data) {
    const int value = dark ? grey / 16 : grey * 16;
    bytes->push_back(static_cast<std::uint8_t>(value & 0xFF));
    bytes->push_back(static_cast<std::uint8_t>(value >> 8));
  }
  image.encoding = "mono16";
  image.step = 2 * frame.width;
  image.data = std::move(bytes);
  return image;
}

ros::CompressedImage packedOf(const ros::Image& image) {
  auto* pixels = const_cast<std::uint8_t*>(image.data->data());
  auto png = std::make_shared<std::vector<std::uint8_t>>();
  cv::imencode(
      ".png",
      cv::Mat(static_cast<int>(image.height), static_cast<int>(image.width), CV_16UC1, pixels),
      *png);
  return {image.header, "mono16; png compressed ", png};
}

ros::CompressedImage packedOf(const Frame& frame, const ros::Header& header) {
  auto png = std::make_shared<const std::vector<std::uint8_t>>(pngOf(frame));
  return {header, "png", png};
}

}  // namespace

fs::path writePlan(replay::Dataset& dataset, const fs::path& folder, const PlanOptions& options) {
  fs::create_directories(folder);
  json plan = {{"imu_topic", "/imu0"},     {"imu_frame", kImuFrame},
               {"imu", json::array()},     {"images", json::array()},
               {"cameras", json::array()}, {"transforms", options.transforms}};
  for (const auto& camera : dataset.calibration().cameras)
    plan["cameras"].push_back(planOf(camera, options));
  while (const auto message = dataset.next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) {
      plan["imu"].push_back({std::to_string(toNanoseconds(imu->time)), imu->gyro.x(), imu->gyro.y(),
                             imu->gyro.z(), imu->accel.x(), imu->accel.y(), imu->accel.z()});
    } else if (const auto* frame = std::get_if<Frame>(&*message)) {
      const std::string file = frame->camera + "_" + std::to_string(plan["images"].size());
      json image = {{"camera", frame->camera},
                    {"topic", imageTopic(frame->camera, options)},
                    {"ns", std::to_string(toNanoseconds(frame->stamp.time))},
                    {"file", file}};
      std::vector<std::uint8_t> bytes((*frame->data).begin(), (*frame->data).end());
      if (options.images == PlanOptions::Images::kPng) {
        image["format"] = "png";
        bytes = pngOf(*frame);
      } else {
        image["encoding"] = frame->encoding == ImageEncoding::kMono8 ? "mono8" : "bgr8";
        image["step"] = frame->width * channelsOf(frame->encoding);
      }
      std::ofstream(folder / file, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
      plan["images"].push_back(image);
    }
  }
  std::ofstream(folder / "plan.json") << plan;
  return folder / "plan.json";
}

void writeDb3(replay::Dataset& dataset, const fs::path& file, const PlanOptions& options) {
  Db3 database(file, options.index);
  bool begun = false;
  std::size_t images = 0;
  while (const auto message = dataset.next()) {
    const auto* imu = std::get_if<ImuSample>(&*message);
    const auto* frame = std::get_if<Frame>(&*message);
    if (imu == nullptr && frame == nullptr) continue;
    std::int64_t ns = toNanoseconds(imu ? imu->time : frame->stamp.time);
    if (ns >= options.set_ns) ns -= options.set_back_ns;
    const std::int64_t log_ns = (options.one_log_time ? 0 : ns) + kLogDelay;
    if (!begun && options.transforms)
      database.add("/tf_static", log_ns, transformsOf(dataset.calibration(), options));
    begun = true;
    ros::Header header{options.stamps ? timeOf(ns) : ros::Time(), kImuFrame};
    if (imu) {
      database.add("/imu0", log_ns, imuOf(*imu, header));
      continue;
    }
    header.frame_id = frameOf(frame->camera);
    const auto* camera = dataset.calibration().camera(frame->camera);
    database.add(spaceOf(frame->camera, options) + "/camera_info", log_ns, infoOf(*camera, header));
    const std::string topic = imageTopic(frame->camera, options);
    if (options.dark) {
      const ros::Image image = twelveBitsOf(*frame, header, images++ < *options.dark);
      if (options.images == PlanOptions::Images::kPng) {
        database.add(topic, log_ns, packedOf(image));
      } else {
        database.add(topic, log_ns, image);
      }
    } else if (options.images == PlanOptions::Images::kPng) {
      database.add(topic, log_ns, packedOf(*frame, header));
    } else {
      database.add(topic, log_ns, imageOf(*frame, header));
    }
  }
}

fs::path writeImuRig(const replay::Dataset& dataset, const fs::path& file) {
  Calibration imu;
  imu.imu = dataset.calibration().imu;
  std::ofstream(file) << replay::rigText(imu, "the inertial unit alone");
  return file;
}

Given allOf(replay::Dataset& dataset) {
  Given given;
  while (const auto message = dataset.next()) {
    if (const auto* imu = std::get_if<ImuSample>(&*message)) {
      given.order.push_back("imu " + std::to_string(toNanoseconds(imu->time)) + " " +
                            std::to_string(imu->gyro.x()) + " " + std::to_string(imu->accel.z()));
    } else if (const auto* frame = std::get_if<Frame>(&*message)) {
      given.order.push_back(frame->camera + " " + std::to_string(toNanoseconds(frame->stamp.time)) +
                            " " + std::to_string(frame->stamp.sequence));
      given.pixels.emplace_back((*frame->data).begin(), (*frame->data).end());
    }
  }
  return given;
}

}  // namespace perdure::test
