#include "services/capture/config.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/errors.h"

namespace perdure::capture {
namespace {

void describeDataset(Config& c, config::Fields& fields) {
  fields.text("dataset.path", c.dataset.path,
              {"folder in EuRoC, KITTI raw or KITTI tracking layout, or a recording with images "
               "(.mcap; from ROS also .db3 and .bag)"});
  fields.texts("dataset.topics", c.dataset.topics,
               {"topics of a ROS recording with several candidates: [cam0=TOPIC, cam1=TOPIC, "
                "imu=TOPIC]"});
  fields.text("dataset.sequence", c.dataset.sequence,
              {"sequence of KITTI tracking, for example \"0001\""});
  fields.choice("dataset.cameras", c.dataset.cameras, {"mono", "stereo"},
                {"mono: cam0 only; stereo: also cam1, if the drive has it"});
}

void describeLive(Config& c, config::Fields& fields) {
  fields.text("camera.id", c.camera.id,
              {"live: libcamera's id of the camera, or a part of it; empty: the first camera"});
  fields.text("camera.second", c.camera.second,
              {"live: id of a second camera for stereo, cam1 of the rig; the other keys of "
               "`camera` apply to both; empty: one camera"});
  fields.number("camera.rate_hz", c.camera.rate_hz, config::between(1, 240),
                {"live: requested frame rate; a camera without this control keeps its own", "Hz"});
  fields.number("camera.exposure_ms", c.camera.exposure_ms, config::between(0, 1000),
                {"live: exposure time of an image; 0: automatic", "ms"});
  fields.number("imu.rate_hz", c.imu.rate_hz, config::between(10, 8000),
                {"live: sample rate that is requested from the device and the trigger; the log "
                 "reports the result",
                 "Hz"});
}

void describeVehicle(Config& c, config::Fields& fields) {
  fields.choice("speed.source", c.speed.source, {"none", "can", "udp", "gnss"},
                {"live: source of the vehicle's speed: its CAN bus, UDP datagrams, or the receiver "
                 "of gnss.source"});
  fields.text("speed.can.interface", c.speed.can_interface,
              {"live: network interface of the CAN bus (SocketCAN)"});
  fields.texts(
      "speed.can.signals", c.speed.can_signals,
      {"live: one signal for each wheel, or one of the speed, in the form of the vehicle's "
       "DBC file: ID START|LENGTH@ORDER SIGN (FACTOR,OFFSET) [LOW|HIGH] \"UNIT\""});
  fields.text("speed.can.reverse", c.speed.can_reverse,
              {"live: signal of the reverse gear, followed by == VALUE; empty: the speed is "
               "signed"});
  fields.text("speed.address", c.speed.address,
              {"live: HOST:PORT that receives the UDP datagrams: a speed in m/s, with or without "
               "its standard deviation"});
  fields.choice("gnss.source", c.gnss.source, {"none", "gpsd"},
                {"live: position of the map on Earth: gpsd, which reads NMEA over UDP too "
                 "(`gpsd udp://0.0.0.0:10110`)"});
  fields.text("gnss.address", c.gnss.address, {"live: HOST:PORT of gpsd"});
  fields.numbers(
      "gnss.antenna", c.gnss.antenna, config::between(-100, 100),
      {"live: position of the antenna in the body frame [x, y, z]; empty: the origin", "m"});
}

void describeRun(Config& c, config::Fields& fields) {
  fields.choice("image.compress", c.image.compress, {"none", "jpeg"},
                {"compression of published images; jpeg: for networks without the bandwidth for "
                 "raw images"});
  fields.choice("pace.mode", c.pace.mode, {"clock", "follow"},
                {"clock: publish at the times of the drive; follow: at the speed of the readers' "
                 "answers"});
  fields.number("pace.rate", c.pace.rate, config::between(0.01, 100),
                {"clock: speed of the drive; 2: twice as fast as recorded"});
  fields.texts("start.readers", c.start.readers,
               {"processes that must be ready before the drive starts: vio, inference, "
                "semantic_filter"});
  fields.choice("run.on_end", c.run.on_end, {"exit", "repeat", "stay"},
                {"at the end of the drive: exit with status 0; stay for late readers; or repeat a "
                 "drive that ends at its start"});
}

void describeExpertDataset(Config& c, config::Fields& fields) {
  fields.number("dataset.lead_s", c.dataset.lead_s, config::atLeast(0),
                {"inertial samples begin this long before the first frame", "s"});
  fields.number("dataset.trail_s", c.dataset.trail_s, config::atLeast(0),
                {"the drive ends this long after its last frame", "s"});
  const std::vector<std::string> encodings = {"as_is", "mono8", "bgr8"};
  fields.choice("image.cam0", c.image.cam0, encodings,
                {"encoding of cam0; inference needs colour, if available"});
  fields.choice("image.cam1", c.image.cam1, encodings, {"encoding of cam1, which only vio reads"});
  fields.integer("image.quality", c.image.quality, config::between(1, 100), {"quality of JPEG"});
}

void describeExpertCamera(Config& c, config::Fields& fields) {
  fields.text("camera.format", c.camera.format,
              {"live: libcamera's name of a pixel format, for example YUYV or MJPEG; auto: the "
               "format with the least conversion"});
  fields.number("camera.gain", c.camera.gain, config::between(0, 100),
                {"live: analogue gain; 0: automatic"});
  fields.choice("camera.focus", c.camera.focus, {"as_is", "auto", "manual"},
                {"live: as_is: the camera's own setting; auto: autofocus, which changes the lens "
                 "of the rig; manual: fixed at camera.lens_dioptres. An unsupported setting is an "
                 "error"});
  fields.number("camera.lens_dioptres", c.camera.lens_dioptres, config::between(0, 50),
                {"live: lens position for camera.focus manual, 1 / distance; 0: infinity", "1/m"});
  fields.choice("camera.flip", c.camera.flip, {"none", "horizontal", "vertical", "both"},
                {"live: the camera mirrors its images. The rig must match the mirrored images; an "
                 "unsupported setting is an error"});
  fields.numbers("camera.crop", c.camera.crop, config::between(0, 65535),
                 {"live: region of interest [x, y, width, height] in pixels of the sensor; empty: "
                  "the whole sensor. The rig must match the cropped images"});
}

void describeExpertImu(Config& c, config::Fields& fields) {
  fields.text("imu.uri", c.imu.uri,
              {"live: libiio context of the IMU: local:, or ip:HOST of an iiod"});
  fields.text("imu.gyro", c.imu.gyro,
              {"live: name or id of the gyroscope's device; empty: the first gyroscope"});
  fields.text("imu.accel", c.imu.accel,
              {"live: name or id of the accelerometer's device; empty: the same device"});
  fields.text("imu.trigger", c.imu.trigger,
              {"live: name or id of the trigger of the buffer; empty: the current trigger"});
  fields.numbers("imu.mount", c.imu.mount, config::between(-1, 1),
                 {"live: 9 numbers, rows of the rotation from the device's axes to the body's; "
                  "empty: the device's own mount matrix"});
}

void describeExpertVehicle(Config& c, config::Fields& fields) {
  fields.number("speed.sigma", c.speed.sigma, config::positive(),
                {"live: standard deviation of the speed (of one wheel) in addition to its "
                 "resolution",
                 "m/s"});
  fields.number("speed.latency_s", c.speed.latency_s, config::between(0, 2),
                {"live: age of a speed sample when it is received", "s"});
  fields.number("gnss.most_sigma", c.gnss.most_sigma, config::positive(),
                {"live: largest standard deviation of a fix that is used", "m"});
  fields.number("gnss.latency_s", c.gnss.latency_s, config::between(0, 5),
                {"live: age of a fix when it is received", "s"});
}

void describeExpertRun(Config& c, config::Fields& fields) {
  fields.integer("pace.window", c.pace.window, config::between(1, 3),
                 {"follow: largest number of frames without an answer; the topic keeps 4"});
  fields.number("pace.timeout_s", c.pace.timeout_s, config::positive(),
                {"follow: longest wait for an answer; then the drive continues, and the frame is "
                 "counted",
                 "s"});
  fields.number("start.timeout_s", c.start.timeout_s, config::atLeast(0),
                {"longest wait for start.readers; then the drive starts, and missing readers are "
                 "counted",
                 "s"});
  fields.text("run.state", c.run.state,
              {"file with the progress of the run, from which a restarted capture continues; "
               "empty: none"});
}

}  // namespace

void describe(Config& c, config::Fields& fields) {
  fields.choice("source", c.source, {"dataset", "libcamera"},
                {"source of images and samples: a drive in files, or a camera of libcamera and an "
                 "IMU of IIO"});
  fields.text("rig", c.rig,
              {"file with the vehicle's cameras and IMU, written by `perdure calibrate`: required "
               "for live sensors, which deliver images of its size; replaces the calibration of a "
               "drive"});
  describeDataset(c, fields);
  describeLive(c, fields);
  describeVehicle(c, fields);
  describeRun(c, fields);
  fields.expert(true);
  describeExpertDataset(c, fields);
  describeExpertCamera(c, fields);
  describeExpertImu(c, fields);
  describeExpertVehicle(c, fields);
  describeExpertRun(c, fields);
  fields.expert(false);
}

namespace {

void refuseIf(bool wrong, const std::string& sentence) {
  if (wrong) throw StartupError(ExitCode::kConfiguration, sentence);
}

bool isRotation(const std::vector<double>& rows) {
  const Eigen::Matrix3d R =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
  constexpr double kOff = 1e-2;
  return (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kOff &&
         R.determinant() > 0.0;
}

void requireSensors(const Config& config) {
  refuseIf(config.rig.empty(),
           "source: libcamera needs rig: a file with the lens of the camera, its place "
           "on the IMU and the IMU's noise; `perdure calibrate` writes it.");
  // Each camera needs its own id, so that left and right are not exchanged.
  const std::string &id = config.camera.id, &second = config.camera.second;
  refuseIf(!second.empty() && id.empty(),
           "camera.second is given and camera.id is empty; with two cameras name both, "
           "as `perdure-capture --list` does.");
  refuseIf(!second.empty() && id == second,
           "camera.id and camera.second are the same; name two cameras, as "
           "`perdure-capture --list` does, or leave camera.second empty.");
  const auto& crop = config.camera.crop;
  const bool whole =
      std::ranges::all_of(crop, [](double c) { return c >= 0 && c == std::floor(c); });
  refuseIf(!crop.empty() && (crop.size() != 4 || crop[2] < 1 || crop[3] < 1 || !whole),
           "camera.crop is not [x, y, width, height] in whole pixels with a width and height "
           "above 0; give these four, or none.");
  const auto& mount = config.imu.mount;
  refuseIf(!mount.empty() && mount.size() != 9,
           "imu.mount has " + std::to_string(mount.size()) +
               " numbers; give the 9 of a rotation, row by row, or none.");
  refuseIf(!mount.empty() && !isRotation(mount),
           "imu.mount is no rotation: rows of length 1 at right angles, and no mirror "
           "image; give the 9 numbers of a rotation, row by row, or none.");
  refuseIf(!config.gnss.antenna.empty() && config.gnss.antenna.size() != 3,
           "gnss.antenna is not [x, y, z]; give these three in metres, or none.");
  refuseIf(config.speed.source == "gnss" && config.gnss.source == "none",
           "speed.source: gnss needs a receiver: set gnss.source to gpsd.");
}

}  // namespace

void requireSource(const Config& config) {
  if (config.source == "libcamera") return requireSensors(config);
  refuseIf(config.dataset.path.empty(),
           "No drive is configured; set dataset.path to a folder in EuRoC, KITTI raw "
           "or KITTI tracking layout, or to a recording (.mcap).");
}

}  // namespace perdure::capture
