#include "services/capture/config.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/errors.h"

namespace perdure::capture {
namespace {

void describeDataset(Config& c, config::Fields& fields) {
  fields.text("dataset.path", c.dataset.path,
              {"folder of the drive: EuRoC, KITTI raw or KITTI tracking; or a recording of images "
               "(.mcap; of ROS also .db3 and .bag)"});
  fields.texts("dataset.topics", c.dataset.topics,
               {"of a recording of ROS that has several: [cam0=TOPIC, cam1=TOPIC, imu=TOPIC]"});
  fields.text("dataset.sequence", c.dataset.sequence, {"of KITTI tracking: \"0001\""});
  fields.choice("dataset.cameras", c.dataset.cameras, {"mono", "stereo"},
                {"mono: cam0 only; stereo: cam1 too, where the drive has one"});
  fields.number("dataset.lead_s", c.dataset.lead_s, config::atLeast(0),
                {"inertial samples from so long before the first frame on", "s"});
  fields.number("dataset.trail_s", c.dataset.trail_s, config::atLeast(0),
                {"the drive ends so long after its last frame", "s"});
  const std::vector<std::string> encodings = {"as_is", "mono8", "bgr8"};
  fields.choice("image.cam0", c.image.cam0, encodings,
                {"encoding of cam0; inference wants colour where there is any"});
  fields.choice("image.cam1", c.image.cam1, encodings, {"encoding of cam1; only vio looks at it"});
  fields.choice("image.compress", c.image.compress, {"none", "jpeg"},
                {"how images travel; jpeg for networks that raw ones are too wide for"});
  fields.integer("image.quality", c.image.quality, config::between(1, 100), {"of jpeg"});
}

void describeLive(Config& c, config::Fields& fields) {
  fields.text("camera.id", c.camera.id,
              {"live: libcamera's id of the camera, or a part of it; empty: the first there is"});
  fields.text("camera.second", c.camera.second,
              {"live: the same of a second camera, cam1 of the rig, for stereo; what else is said "
               "of the camera is of both; empty: one camera"});
  fields.text(
      "camera.format", c.camera.format,
      {"live: libcamera's name of a pixel format, as YUYV or MJPEG; auto: the best it has"});
  fields.number(
      "camera.rate_hz", c.camera.rate_hz, config::between(1, 240),
      {"live: images a second that are asked for; a camera without a control of it keeps its "
       "own",
       "Hz"});
  fields.number("camera.exposure_ms", c.camera.exposure_ms, config::between(0, 1000),
                {"live: of an image; 0: automatic", "ms"});
  fields.number("camera.gain", c.camera.gain, config::between(0, 100),
                {"live: analogue gain; 0: automatic"});
  fields.choice("camera.focus", c.camera.focus, {"as_is", "auto", "manual"},
                {"live: as_is: the camera's own; auto: it follows the scene, and the lens of the "
                 "rig changes with it; manual: at camera.lens_dioptres. A camera that has not got "
                 "it is refused"});
  fields.number(
      "camera.lens_dioptres", c.camera.lens_dioptres, config::between(0, 50),
      {"live: place of the lens where camera.focus is manual, 1 / distance; 0: far away", "1/m"});
  fields.choice("camera.flip", c.camera.flip, {"none", "horizontal", "vertical", "both"},
                {"live: images are mirrored by the camera, where it can; the rig is of the images "
                 "as they come"});
  fields.numbers("camera.crop", c.camera.crop, config::between(0, 65535),
                 {"live: region of interest [x, y, width, height] in pixels of the sensor; empty: "
                  "all of it. The rig must be of images that were cropped so"});
  fields.text("imu.uri", c.imu.uri,
              {"live: libiio's context of the IMU: local:, or ip:HOST of an iiod"});
  fields.text("imu.gyro", c.imu.gyro,
              {"live: name or id of the gyroscope's device; empty: the first there is"});
  fields.text("imu.accel", c.imu.accel, {"live: of the accelerometer's; empty: the same device"});
  fields.number(
      "imu.rate_hz", c.imu.rate_hz, config::between(10, 8000),
      {"live: samples a second, asked of the device and of the trigger; they say what they "
       "give",
       "Hz"});
  fields.text("imu.trigger", c.imu.trigger,
              {"live: name or id of the trigger of its buffer; empty: the one that is set"});
  fields.numbers("imu.mount", c.imu.mount, config::between(-1, 1),
                 {"live: rows of the rotation from the device's axes to the body's; empty: the "
                  "device's own mount matrix"});
}

void describeVehicle(Config& c, config::Fields& fields) {
  fields.choice("speed.source", c.speed.source, {"none", "can", "udp", "gnss"},
                {"live: where the vehicle's speed comes from: its CAN bus, lines of UDP, or the "
                 "receiver of gnss.source"});
  fields.text("speed.can.interface", c.speed.can_interface,
              {"live: network interface of the CAN bus (SocketCAN)"});
  fields.texts("speed.can.signals", c.speed.can_signals,
               {"live: a signal for each wheel, or the one of the speed, as the vehicle's DBC file "
                "has it: ID START|LENGTH@ORDER SIGN (FACTOR,OFFSET) [LOW|HIGH] \"UNIT\""});
  fields.text("speed.can.reverse", c.speed.can_reverse,
              {"live: the signal by which the vehicle says that it goes backwards, and == VALUE; "
               "empty: the speed has its sign itself"});
  fields.text(
      "speed.address", c.speed.address,
      {"live: HOST:PORT that lines of UDP come to: a speed in m/s, also with its deviation; "
       "or RMC or VTG of NMEA 0183"});
  fields.number("speed.sigma", c.speed.sigma, config::positive(),
                {"live: deviation of the speed (of one wheel) beside its resolution", "m/s"});
  fields.number("speed.latency_s", c.speed.latency_s, config::between(0, 2),
                {"live: how old a speed is when it comes", "s"});
  fields.choice("gnss.source", c.gnss.source, {"none", "gpsd", "nmea"},
                {"live: receiver of satellites that says where on Earth the map is: of gpsd, or "
                 "sentences of NMEA 0183 by UDP"});
  fields.text("gnss.address", c.gnss.address,
              {"live: HOST:PORT of gpsd, or that NMEA comes to; empty: 127.0.0.1:2947, "
               "127.0.0.1:10110"});
  fields.number("gnss.most_sigma", c.gnss.most_sigma, config::positive(),
                {"live: a fix that states more is not used", "m"});
  fields.number("gnss.latency_s", c.gnss.latency_s, config::between(0, 5),
                {"live: how old a fix is when it comes", "s"});
  fields.numbers("gnss.antenna", c.gnss.antenna, config::between(-100, 100),
                 {"live: place of the antenna in the body [x, y, z]; empty: its origin", "m"});
}

}  // namespace

std::string addressOf(const GnssConfig& config) {
  if (!config.address.empty()) return config.address;
  return config.source == "gpsd" ? "127.0.0.1:2947" : "127.0.0.1:10110";
}

void describe(Config& c, config::Fields& fields) {
  fields.choice("source", c.source, {"dataset", "libcamera"},
                {"where images and samples come from: a drive in files, or a camera of libcamera "
                 "and an IMU of IIO"});
  fields.text(
      "rig", c.rig,
      {"file with cameras and IMU of the vehicle, as `perdure calibrate` writes it: of live "
       "sensors (the camera is asked for images of its size), and instead of a drive's own"});
  describeDataset(c, fields);
  describeLive(c, fields);
  describeVehicle(c, fields);
  fields.choice("pace.mode", c.pace.mode, {"clock", "follow"},
                {"clock: the drive's own times; follow: as fast as the readers answer"});
  fields.number("pace.rate", c.pace.rate, config::between(0.01, 100),
                {"clock: seconds of the drive in one second"});
  fields.integer("pace.window", c.pace.window, config::between(1, 3),
                 {"follow: frames on the way without an answer; the topic keeps 4"});
  fields.number("pace.timeout_s", c.pace.timeout_s, config::positive(),
                {"follow: go on without an answer after so long, and count it", "s"});
  fields.texts("start.readers", c.start.readers,
               {"processes to wait for before the drive starts: vio, inference, semantic_filter"});
  fields.number("start.timeout_s", c.start.timeout_s, config::atLeast(0),
                {"start without them after so long, and count it", "s"});
  fields.text("run.state", c.run.state,
              {"file that says where the run is, so that a restarted capture carries on; "
               "empty: none"});
  fields.choice("run.on_end", c.run.on_end, {"exit", "repeat", "stay"},
                {"at the end of the drive: exit with status 0, stay for late readers, or repeat it "
                 "without end, as one that ends how it began"});
}

/// Each camera needs its own id, so that left and right are not exchanged.
void requireTwoIds(const CameraConfig& camera) {
  if (camera.second.empty()) return;
  if (camera.id.empty()) {
    throw StartupError(ExitCode::kConfiguration,
                       "camera.second is given and camera.id is empty; with two cameras name both, "
                       "as `perdure-capture --list` does.");
  }
  if (camera.id == camera.second) {
    throw StartupError(ExitCode::kConfiguration,
                       "camera.id and camera.second are the same; name two cameras, as "
                       "`perdure-capture --list` does, or leave camera.second empty.");
  }
}

bool isRotation(const std::vector<double>& rows) {
  const Eigen::Matrix3d R =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
  constexpr double kOff = 1e-2;
  return (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kOff &&
         R.determinant() > 0.0;
}

void requireSource(const Config& config) {
  const bool live = config.source == "libcamera";
  if (live && config.rig.empty()) {
    throw StartupError(ExitCode::kConfiguration,
                       "source: libcamera needs rig: a file with the lens of the camera, its place "
                       "on the IMU and the IMU's noise; `perdure calibrate` writes it.");
  }
  if (live) requireTwoIds(config.camera);
  const auto& crop = config.camera.crop;
  const bool whole =
      std::all_of(crop.begin(), crop.end(), [](double c) { return c >= 0 && c == std::floor(c); });
  if (live && !crop.empty() && (crop.size() != 4 || crop[2] < 1 || crop[3] < 1 || !whole)) {
    throw StartupError(
        ExitCode::kConfiguration,
        "camera.crop is not [x, y, width, height] in whole pixels with a width and height "
        "above 0; give these four, or none.");
  }
  if (live && !config.imu.mount.empty() && config.imu.mount.size() != 9) {
    throw StartupError(ExitCode::kConfiguration,
                       "imu.mount has " + std::to_string(config.imu.mount.size()) +
                           " numbers; give the 9 of a rotation, row by row, or none.");
  }
  if (live && config.imu.mount.size() == 9 && !isRotation(config.imu.mount)) {
    throw StartupError(ExitCode::kConfiguration,
                       "imu.mount is no rotation: rows of length 1 at right angles, and no mirror "
                       "image; give the 9 numbers of a rotation, row by row, or none.");
  }
  if (live && !config.gnss.antenna.empty() && config.gnss.antenna.size() != 3) {
    throw StartupError(ExitCode::kConfiguration,
                       "gnss.antenna is not [x, y, z]; give these three in metres, or none.");
  }
  if (live && config.speed.source == "gnss" && config.gnss.source == "none") {
    throw StartupError(ExitCode::kConfiguration,
                       "speed.source: gnss needs a receiver: set gnss.source to gpsd or nmea.");
  }
  if (live && config.speed.source == "udp" && config.gnss.source == "nmea" &&
      config.speed.address == addressOf(config.gnss)) {
    throw StartupError(ExitCode::kConfiguration,
                       "speed.address and gnss.address are the same, and one of them would hear "
                       "nothing; set speed.source: gnss, which takes both from one receiver.");
  }
  if (!live && config.dataset.path.empty()) {
    throw StartupError(ExitCode::kConfiguration,
                       "No drive is configured; set dataset.path to a folder in EuRoC, KITTI raw "
                       "or KITTI tracking layout, or to a recording (.mcap).");
  }
}

}  // namespace perdure::capture
