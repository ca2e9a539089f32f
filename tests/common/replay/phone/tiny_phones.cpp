#include "tests/common/replay/phone/tiny_phones.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {

namespace fs = std::filesystem;

namespace {

constexpr double kG = 9.80665;

std::string seconds(std::int64_t ns) {
  return fmt::format("{}.{:09}", ns / 1'000'000'000, ns % 1'000'000'000);
}

std::vector<std::int64_t> stampsEach(std::int64_t step_ns) {
  std::vector<std::int64_t> stamps;
  for (std::int64_t ns = 900'000'000; ns <= 3'100'000'000; ns += step_ns) stamps.push_back(ns);
  return stamps;
}

constexpr std::size_t kBits = 6, kStripe = 10;

/// Stripes that are white for the bits of a number, on dark grey.
cv::Mat pictureOf(int number) {
  cv::Mat grey(48, 64, CV_8UC1, cv::Scalar(40));
  for (int bit = 0; bit < static_cast<int>(kBits); ++bit) {
    constexpr int kWide = kStripe;
    if ((number >> bit & 1) != 0) grey.colRange(kWide * bit, kWide * (bit + 1)) = cv::Scalar(220);
  }
  return grey;
}

/// A line of x, y, z in a format of three numbers.
std::string text(const char* format, const Eigen::Vector3d& v) {
  return fmt::format(fmt::runtime(format), v.x(), v.y(), v.z());
}

}  // namespace

void writeFilm(const fs::path& file, int frames, const std::string& codec) {
  fs::create_directories(file.parent_path());
  const cv::Size size(64, 48);
  cv::VideoWriter writer(
      file.string(), cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), 20.0, size);
  for (int i = 0; i < frames; ++i) {
    cv::Mat colour;
    cv::merge(std::vector<cv::Mat>(3, pictureOf(i)), colour);
    writer.write(colour);
  }
}

void writePicture(const fs::path& file, int number) {
  fs::create_directories(file.parent_path());
  cv::imwrite(file.string(), pictureOf(number));
}

int numberOf(const Frame& frame) {
  const std::size_t channels = channelsOf(frame.encoding);
  int number = 0;
  for (std::size_t bit = 0; bit < kBits; ++bit) {
    const std::size_t middle = (frame.height / 2 * frame.width + kStripe * bit + kStripe / 2);
    if ((*frame.data)[channels * middle] > 128) number |= 1 << bit;
  }
  return number;
}

void turnFilm(const fs::path& file) {
  std::string bytes = readText(file);
  const std::size_t matrix = bytes.find("tkhd") + 44;  // of ISO 14496-12, version 0
  const unsigned char quarter[36] = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 255, 255, 0, 0, 0,
                                     0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,   0,   0, 64};
  bytes.replace(matrix, sizeof quarter, reinterpret_cast<const char*>(quarter), sizeof quarter);
  writeText(file, bytes);
}

std::int64_t frameStamp(int frame) { return 1'000'000'000 + 50'000'000 * std::int64_t{frame}; }
std::vector<std::int64_t> gyroStamps() { return stampsEach(5'000'000); }
std::vector<std::int64_t> accelStamps() { return stampsEach(10'000'000); }
Eigen::Vector3d forceAt(std::int64_t ns) {
  return {0.5, 9.7, -0.5 + 1e-9 * static_cast<double>(ns)};
}

fs::path tinyMars(const std::string& name, int frames) {
  const fs::path folder = freshFolder(name);
  writeFilm(folder / "movie.mp4", frames);
  std::string imu =
      "Timestamp[nanosec], gx[rad/s], gy[rad/s], gz[rad/s], ax[m/s^2], ay[m/s^2], az[m/s^2], Unix "
      "time[nanosec]\n";
  for (const auto ns : gyroStamps()) {
    imu += fmt::format("{},{},{},{}000000\n", ns, text("{}, {}, {}", kTurn),
                       text("{}, {}, {}", forceAt(ns)), 1'700'000'000'000 + ns / 1'000'000);
  }
  writeText(folder / "gyro_accel.csv", imu);
  std::string list = "Frame timestamp[nanosec],Unix time[nanosec]\n",
              metadata = "Timestamp[nanosec],fx[px],fy[px],Frame No.,Exposure time[nanosec]\n";
  for (int i = 0; i < kFilmFrames; ++i) {
    list += fmt::format("{},1\n", frameStamp(i));
    if (i % 4 != 0) metadata += fmt::format("{},{},51,{},10000000\n", frameStamp(i), 50 + i % 2, i);
  }
  writeText(folder / "frame_timestamps.txt", list);
  writeText(folder / "movie_metadata.csv", metadata);
  return folder;
}

fs::path tinySpectacular(const std::string& name) {
  const fs::path folder = freshFolder(name);
  writeFilm(folder / "data.avi", kFilmFrames, "MJPG");
  std::string lines = "{\"groundTruth\":{\"position\":{\"x\":0,\"y\":0,\"z\":0}},\"time\":1.0}\n";
  const auto sensor = [&](const char* type, std::int64_t ns, const Eigen::Vector3d& value) {
    lines += fmt::format("{{\"sensor\":{{\"type\":\"{}\",\"values\":[{}]}},\"time\":{}}}\n", type,
                         text("{},{},{}", value), seconds(ns));
  };
  for (const auto ns : gyroStamps()) sensor("gyroscope", ns, kTurn);
  for (const auto ns : accelStamps()) sensor("accelerometer", ns, forceAt(ns));
  for (int i = 0; i < kFilmFrames; ++i) {
    lines += fmt::format("{{\"frames\":[{{\"cameraInd\":0}}],\"number\":{},\"time\":{}}}\n", i,
                         seconds(frameStamp(i)));
  }
  writeText(folder / "data.jsonl", lines);
  writeText(folder / "calibration.json",
            R"({"cameras": [{"focalLengthX": 100.0, "focalLengthY": 102.0,
 "principalPointX": 63.5, "principalPointY": 47.5, "model": "kannala-brandt4",
 "distortionCoefficients": [0.01, 0.02, 0.03, 0.04], "imageWidth": 128, "imageHeight": 96,
 "imuToCamera": [[0, -1, 0, 0.1], [-1, 0, 0, 0.2], [0, 0, -1, 0.3], [0, 0, 0, 1]]}]})");
  return folder;
}

fs::path tinyRecords(const std::string& name) {
  const fs::path folder = freshFolder(name);
  std::string frames, samples;
  for (int i = 0; i < kFilmFrames; ++i) {
    const std::string image = fmt::format("frame_{:06}.png", i + 1);
    writePicture(folder / "images" / image, i);
    frames += fmt::format(
        "{{\n  \"fileName\": \"{}\",\n  \"frameNumber\": {},\n  \"timestamp\": {}\n}}\n", image,
        i + 1, frameStamp(i));
  }
  const auto sensor = [&](int type, std::int64_t ns, const Eigen::Vector3d& value) {
    samples += fmt::format(
        "{{\n  \"accuracy\": 3,\n  \"sensorType\": {},\n  \"timestamp\": {},\n  \"values\": [\n    "
        "{}\n  ]\n}}\n",
        type, ns, text("{},\n    {},\n    {}", value));
  };
  for (const auto ns : gyroStamps()) sensor(4, ns, kTurn);
  for (const auto ns : accelStamps()) sensor(1, ns, forceAt(ns));
  writeText(folder / "camera_frames.jsonl", frames);
  writeText(folder / "imu_data.jsonl", samples);
  writeText(folder / "session_metadata.json", "{\"sessionId\": \"a\", \"totalFrames\": 40}\n");
  return folder;
}

fs::path tinyOpenCamera(const std::string& name) {
  const fs::path folder = freshFolder(name);
  writeFilm(folder / "VID_1.mp4");
  std::string gyro, accel, list;
  for (const auto ns : gyroStamps()) gyro += fmt::format("{},{}\n", text("{},{},{}", kTurn), ns);
  for (const auto ns : accelStamps()) {
    accel += fmt::format("{},{}\n", text("{},{},{}", forceAt(ns)), ns);
  }
  for (int i = 0; i < kFilmFrames; ++i) list += fmt::format("{}\n", frameStamp(i));
  writeText(folder / "VID_1_gyro.csv", gyro);
  writeText(folder / "VID_1_accel.csv", accel);
  writeText(folder / "VID_1_timestamps.csv", list);
  return folder;
}

fs::path tinySensorLogger(const std::string& name) {
  const fs::path folder = freshFolder(name);
  writeFilm(folder / "Camera/1000.mp4");
  const std::string head = "time,seconds_elapsed,z,y,x\n";
  std::string gyro = head, motion = head, gravity = head;
  const auto line = [](std::int64_t ns, const Eigen::Vector3d& v) {
    return fmt::format("{},{},{},{},{}\n", ns, seconds(ns), v.z(), v.y(), v.x());
  };
  const Eigen::Vector3d up(0.0, kG, 0.0);
  for (const auto ns : gyroStamps()) gyro += line(ns, kTurn);
  for (const auto ns : accelStamps())
    motion += line(ns, up - forceAt(ns)), gravity += line(ns, -up);
  writeText(folder / "Gyroscope.csv", gyro);
  writeText(folder / "Accelerometer.csv", motion);
  writeText(folder / "Gravity.csv", gravity);
  writeText(folder / "Metadata.csv",
            "version,device name,platform,sampleRateMs,standardisation\n3,a phone,ios,10,false\n");
  return folder;
}

fs::path tinyIosLogger(const std::string& name) {
  const fs::path folder = freshFolder(name);
  writeFilm(folder / "Frames.m4v.mp4");
  fs::rename(folder / "Frames.m4v.mp4", folder / "Frames.m4v");
  std::string gyro, accel, list;
  for (const auto ns : gyroStamps()) {
    gyro += fmt::format("{},{}\n", seconds(ns), text("{},{},{}", kTurn));
  }
  for (const auto ns : accelStamps()) {
    accel +=
        fmt::format("{},{}\n", seconds(ns), text("{:.12f},{:.12f},{:.12f}", -forceAt(ns) / kG));
  }
  for (int i = 0; i < kFilmFrames; ++i) {
    list += fmt::format("{},{},50.5,50.5,31.5,23.5\n", seconds(frameStamp(i)), i);
  }
  writeText(folder / "Gyro.txt", gyro);
  writeText(folder / "Accel.txt", accel);
  writeText(folder / "Frames.txt", list);
  return folder;
}

fs::path phoneRig(const std::string& name) {
  const fs::path file = freshFolder(name) / "rig.yaml";
  writeText(file,
            "cam0:\n  T_BS: [1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1]\n"
            "  resolution: [64, 48]\n  intrinsics: [50, 50, 31.5, 23.5]\n"
            "  distortion_model: none\n");
  return file;
}

}  // namespace perdure::replay
