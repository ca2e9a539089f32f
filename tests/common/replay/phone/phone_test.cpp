#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/videoio.hpp>

#include "common/replay/data_check.h"
#include "common/replay/dataset.h"
#include "common/replay/files/rig_file.h"
#include "tests/common/replay/phone/tiny_phones.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

std::unique_ptr<Dataset> openPhone(const fs::path& folder) {
  return Dataset::open({.path = folder, .uncalibrated = true});
}
std::string errorOfPhone(const fs::path& folder) {
  return startupErrorOf([&] { openPhone(folder); });
}

void replaceAll(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = readText(file);
  for (auto at = text.find(from); at != text.npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  writeText(file, text);
}

/// Keeps the first `count` lines of a file.
void keepLines(const fs::path& file, std::size_t count) {
  std::ifstream lines(file);
  std::string text, line;
  for (std::size_t i = 0; i < count && std::getline(lines, line); ++i) text += line + "\n";
  lines.close();
  writeText(file, text);
}

/// Checks all samples and frames of a tiny phone; `clock_ns` is the largest error of the stamps.
void expectTiny(const fs::path& folder, std::int64_t clock_ns = 0) {
  const auto dataset = openPhone(folder);
  EXPECT_EQ(dataset->kind(), DatasetKind::kPhone);
  EXPECT_EQ(dataset->frameCount(), std::size_t{kFilmFrames});
  std::vector<ImuSample> samples;
  int frames = 0;
  while (auto message = dataset->next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*message)) {
      samples.push_back(*sample);
      continue;
    }
    const auto& frame = std::get<Frame>(*message);
    EXPECT_NEAR(static_cast<double>(toNanoseconds(frame.stamp.time)),
                static_cast<double>(frameStamp(frames)), static_cast<double>(clock_ns));
    EXPECT_EQ(frame.stamp.sequence, static_cast<std::uint64_t>(frames));
    ASSERT_TRUE(frame.data);
    EXPECT_EQ(numberOf(frame), frames++);
  }
  EXPECT_EQ(frames, kFilmFrames);
  const auto stamps = gyroStamps();
  ASSERT_EQ(samples.size(), stamps.size());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    EXPECT_EQ(toNanoseconds(samples[i].time), stamps[i]);
    EXPECT_TRUE(samples[i].gyro.isApprox(kTurn, 1e-9));
    EXPECT_TRUE(samples[i].accel.isApprox(forceAt(stamps[i]), 1e-6))
        << samples[i].accel.transpose();
  }
  EXPECT_TRUE(dataset->reasons().all().empty());
  EXPECT_TRUE(dataset->calibration().imu);
  EXPECT_NEAR(dataset->calibration().imu->rate_hz, 200.0, 0.1);
  EXPECT_EQ(dataset->calibration().cameras.at(0).width, 64U);
  EXPECT_NEAR(dataset->calibration().cameras[0].rate_hz, 20.0, 0.1);
}

TEST(Phone, AMarsRecordingIsRead) { expectTiny(tinyMars("mars")); }
TEST(Phone, ASpectacularRecordingIsRead) { expectTiny(tinySpectacular("spectacular")); }
TEST(Phone, RecordsOfSensorEventsAreRead) { expectTiny(tinyRecords("records")); }
TEST(Phone, AnOpenCameraRecordingIsRead) { expectTiny(tinyOpenCamera("open_camera")); }
TEST(Phone, ASensorLoggerRecordingIsRead) {
  expectTiny(tinySensorLogger("sensor_logger"), 1'000'000);
}
TEST(Phone, AnIosLoggerRecordingIsRead) { expectTiny(tinyIosLogger("ios_logger")); }

TEST(Phone, SeekAndFrameAtGiveTheFrameOfTheirNumber) {
  for (const auto& folder : {tinyMars("seek"), tinySpectacular("seek_avi")}) {
    const auto dataset = openPhone(folder);
    for (const int index : {0, 35, 3, 3, 4, 39, 12, 11, 13, 38, 0}) {
      const auto frame = dataset->frameAt(static_cast<std::uint64_t>(index));
      ASSERT_TRUE(frame);
      EXPECT_EQ(numberOf(*frame), index);
    }
    dataset->seek(30);
    dataset->frameAt(7);
    int next = 30;
    while (auto message = dataset->next()) {
      const auto* frame = std::get_if<Frame>(&*message);
      if (frame == nullptr) continue;
      EXPECT_EQ(numberOf(*frame), next++);
    }
    EXPECT_EQ(next, kFilmFrames);
  }
}

TEST(Phone, WithoutCalibrationTheErrorStatesTheFix) {
  const auto folder = tinyMars("uncalibrated");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = folder}); }),
              AllOf(HasSubstr("the lens of cam0"), HasSubstr("--rig auto"),
                    HasSubstr("perdure calibrate from-motion --data " + folder.string())));
  EXPECT_EQ(startupCodeOf([&] { Dataset::open({.path = folder}); }), ExitCode::kUnavailable);
  const auto dataset = Dataset::open({.path = folder, .rig = phoneRig("uncalibrated_rig")});
  EXPECT_EQ(dataset->calibration().cameras[0].fx, 50.0);
  EXPECT_GT(dataset->calibration().imu->gyro_noise, 0.0);
}

TEST(Phone, ACalibrationInTheRecordingNeedsNoRig) {
  const auto dataset = Dataset::open({.path = tinySpectacular("calibrated")});
  const CameraCalibration& camera = dataset->calibration().cameras[0];
  // The lens is given for 128×96 pixels, and the film has 64×48.
  EXPECT_EQ(camera.fx, 50.0);
  EXPECT_EQ(camera.fy, 51.0);
  EXPECT_EQ(camera.cx, 31.5);
  EXPECT_EQ(camera.distortion, DistortionModel::kEquidistant);
  EXPECT_EQ(camera.distortion_coefficients, (std::vector<double>{0.01, 0.02, 0.03, 0.04}));
  // imuToCamera maps points of the IMU into the camera.
  const Eigen::Vector3d in_camera = camera.T_BC.inverse() * Eigen::Vector3d(1, 2, 3);
  EXPECT_TRUE(in_camera.isApprox(Eigen::Vector3d(-1.9, -0.8, -2.7), 1e-9));
}

TEST(Phone, TheCalibrationMayBeInTheFrames) {
  const auto folder = tinySpectacular("in_frames");
  fs::remove(folder / "calibration.json");
  replaceAll(folder / "data.jsonl", "{\"cameraInd\":0}",
             "{\"cameraInd\":0,\"cameraParameters\":{\"focalLengthX\":60,\"focalLengthY\":61,"
             "\"principalPointX\":30,\"principalPointY\":20},\"imuToCamera\":[[1,0,0,0],[0,1,0,0],"
             "[0,0,1,0],[0,0,0,1]]}");
  const auto dataset = Dataset::open({.path = folder});
  EXPECT_EQ(dataset->calibration().cameras[0].fx, 60.0);
  EXPECT_EQ(dataset->calibration().cameras[0].distortion, DistortionModel::kNone);
}

TEST(Phone, AnUnknownLensModelIsRefused) {
  const auto folder = tinySpectacular("lens_model");
  replaceAll(folder / "calibration.json", "kannala-brandt4", "orthographic");
  EXPECT_THAT(
      errorOfPhone(folder),
      AllOf(HasSubstr("calibration.json: model is orthographic with 4"), HasSubstr("--rig")));
}

TEST(Phone, ASecondCameraIsUsedIfItIsCalibrated) {
  const auto folder = tinySpectacular("stereo");
  writeFilm(folder / "data2.avi", kFilmFrames, "MJPG");
  replaceAll(folder / "data.jsonl", "{\"cameraInd\":0}", "{\"cameraInd\":0},{\"cameraInd\":1}");
  EXPECT_EQ(openPhone(folder)->calibration().cameras.size(), 1U);
  std::string calibration = readText(folder / "calibration.json");
  const auto from = calibration.find('[') + 1, to = calibration.rfind(']');
  const std::string camera = calibration.substr(from, to - from);
  writeText(folder / "calibration.json", "{\"cameras\": [" + camera + "," + camera + "]}");
  const auto dataset = openPhone(folder);
  ASSERT_EQ(dataset->calibration().cameras.size(), 2U);
  std::size_t second = 0;
  while (auto message = dataset->next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    if (!frame || frame->camera != "cam1") continue;
    EXPECT_EQ(numberOf(*frame), static_cast<int>(frame->stamp.sequence));
    ++second;
  }
  EXPECT_EQ(second, std::size_t{kFilmFrames});
}

TEST(Phone, StampsBelowZeroAreShiftedWithANote) {
  const auto folder = tinySpectacular("negative");
  replaceAll(folder / "data.jsonl", "\"time\":0.9", "\"time\":-0.9");
  replaceAll(folder / "data.jsonl", "\"time\":1.", "\"time\":-0.1");
  const auto dataset = openPhone(folder);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("1 s are added to all")));
  EXPECT_GE(dataset->recording().imu.front().time, TimePoint{});
}

TEST(Phone, AMissingFilmIsNamed) {
  const auto folder = tinyMars("no_film");
  fs::remove(folder / "movie.mp4");
  EXPECT_THAT(errorOfPhone(folder),
              AllOf(HasSubstr("the film is missing"), HasSubstr("movie.mp4")));
  EXPECT_EQ(startupCodeOf([&] { openPhone(folder); }), ExitCode::kUnavailable);
}

TEST(Phone, AnUnfinishedFilmIsRefused) {
  const auto folder = tinyMars("unfinished_film");
  truncate(folder / "movie.mp4", 0.5);
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("cannot be read as a film"));
  EXPECT_EQ(startupCodeOf([&] { openPhone(folder); }), ExitCode::kData);
}

TEST(Phone, AFilmThatIsALittleShorterThanItsListLosesStampsAtTheEnd) {
  const auto dataset = openPhone(tinyMars("short_film", kFilmFrames - 2));
  EXPECT_EQ(dataset->reasons().of("frame_not_in_film"), 2U);
  EXPECT_THAT(dataset->recording().notes,
              Contains(HasSubstr("has 38 frames, its list 40 stamps; 2 stamps at the end")));
  EXPECT_EQ(dataset->recording().frames.size(), std::size_t{kFilmFrames - 2});
  EXPECT_EQ(numberOf(*dataset->frameAt(37)), 37);
}

TEST(Phone, AFilmThatIsALittleLongerThanItsListLosesFramesAtTheEnd) {
  const auto folder = tinyMars("long_film");
  keepLines(folder / "frame_timestamps.txt", 38);  // a head and 37 stamps
  const auto dataset = openPhone(folder);
  EXPECT_EQ(dataset->reasons().of("frame_without_stamp"), 3U);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("3 frames at the end")));
  EXPECT_FALSE(dataset->frameTime(37));
}

TEST(Phone, AFilmWithOtherTimesThanItsListIsNoted) {
  const auto folder = tinyMars("converted_film");
  std::string list;
  for (int i = 0; i < kFilmFrames; ++i)
    list += std::to_string(frameStamp(0) + 57'000'000L * i) + "\n";
  writeText(folder / "frame_timestamps.txt", list);
  const auto dataset = openPhone(folder);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("the film was converted")));
  EXPECT_EQ(toNanoseconds(*dataset->frameTime(10)), 1'570'000'000);
}

TEST(Phone, AFilmOfAnotherRecordingIsRefused) {
  EXPECT_THAT(errorOfPhone(tinyMars("other_film", 20)),
              AllOf(HasSubstr("has 20 frames, its list 40"), HasSubstr("cut")));
}

TEST(Phone, ARotatedFilmIsReadAsTheSensorGaveIt) {
  const auto folder = tinyMars("portrait");
  turnFilm(folder / "movie.mp4");
  const auto dataset = openPhone(folder);
  EXPECT_EQ(dataset->frameAt(5)->width, 64U);
  EXPECT_EQ(dataset->frameAt(5)->height, 48U);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("turned by 90°")));
}

TEST(Phone, TheFocalLengthByThePhoneIsNoted) {
  EXPECT_THAT(openPhone(tinyMars("focal"))->recording().notes,
              Contains(HasSubstr("50.0 … 51.0 px")));
}

TEST(Phone, WithoutAListOfStampsTheMetadataHasThem) {
  const auto folder = tinyMars("ios_mars");
  fs::remove(folder / "frame_timestamps.txt");
  writeFilm(folder / "movie.mp4", 30);
  EXPECT_EQ(openPhone(folder)->recording().frames.size(), 30U);
}

TEST(Phone, UnitsInTheHeadAreConverted) {
  const auto folder = tinyMars("units");
  replaceAll(folder / "gyro_accel.csv", "gx[rad/s]", "gx[deg/s]");
  replaceAll(folder / "gyro_accel.csv", "ax[m/s^2]", "ax[g]");
  const ImuSample first = openPhone(folder)->recording().imu.front();
  EXPECT_TRUE(first.gyro.isApprox(kTurn * M_PI / 180.0, 1e-9));
  EXPECT_TRUE(first.accel.isApprox(9.80665 * forceAt(900'000'000), 1e-9));
}

TEST(Phone, AnUnknownUnitIsRefused) {
  const auto folder = tinyMars("unknown_unit");
  replaceAll(folder / "gyro_accel.csv", "gx[rad/s]", "gx[rpm]");
  EXPECT_THAT(errorOfPhone(folder),
              AllOf(HasSubstr("gyro_accel.csv:1: the unit of `gx[rpm]`"), HasSubstr("rad/s")));
}

TEST(Phone, ALineThatIsNoNumberIsCountedOrNamed) {
  const auto folder = tinyMars("no_number");
  const auto file = folder / "gyro_accel.csv";
  const std::string text = readText(file);
  writeText(file, text + "3105000000,0.1,0.2,x,0,0,9.8\n");
  const auto dataset = openPhone(folder);
  EXPECT_EQ(dataset->reasons().of("imu_malformed"), 1U);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("`x` is not a number")));
  writeText(file, "Timestamp[nanosec], gx[rad/s]\n1000,0.1,0.2,0.3\n2000,0.1,0.2,0.3\n");
  EXPECT_THAT(errorOfPhone(folder),
              AllOf(HasSubstr("gyro_accel.csv:2: 4 columns, but 5 are awaited")));
}

TEST(Phone, EmptyFilesAreNamed) {
  auto folder = tinyMars("empty_imu");
  writeText(folder / "gyro_accel.csv", "");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("gyro_accel.csv has no sample of the gyroscope"));
  folder = tinyMars("empty_list");
  writeText(folder / "frame_timestamps.txt", "");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("frame_timestamps.txt has no stamp"));
  folder = tinySpectacular("empty_json");
  writeText(folder / "data.jsonl", "");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("data.jsonl has no record"));
}

TEST(Phone, DamagedRecordsAreCountedWithTheFirstPlace) {
  const auto folder = tinySpectacular("damaged_records");
  const auto file = folder / "data.jsonl";
  std::string text = readText(file);
  text.insert(text.find('\n') + 1,
              "{\"sensor\":{\"type\":\"gyroscope\",\"values\":[1,\"x\",2]},\"time\":0.9}\n"
              "{\"sensor\":{\"type\":\"gyroscope\",\"values\":[1,2,3]}}\n");
  writeText(file, text + "{\"sensor\":{\"type\":\"gyro");
  const auto dataset = openPhone(folder);
  EXPECT_EQ(dataset->reasons().of("record_malformed"), 3U);
  EXPECT_THAT(dataset->recording().notes,
              Contains(AllOf(HasSubstr("data.jsonl:2: the values are not three numbers"),
                             HasSubstr("3 of "))));
  EXPECT_EQ(dataset->recording().imu.size(), gyroStamps().size());
}

TEST(Phone, StampsInSecondsAreNoNanoseconds) {
  const auto folder = tinyRecords("seconds");
  replaceAll(folder / "imu_data.jsonl", "000,", ".5,");
  EXPECT_THAT(errorOfPhone(folder), AllOf(HasSubstr("imu_data.jsonl:1: "),
                                          HasSubstr("is no stamp in whole nanoseconds")));
}

TEST(Phone, AccelerationsWithoutGravityAreRefused) {
  auto folder = tinyRecords("without_gravity");
  replaceAll(folder / "imu_data.jsonl", "\"sensorType\": 1,", "\"sensorType\": 10,");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("only accelerations without gravity"));
  folder = tinySensorLogger("without_gravity_csv");
  fs::remove(folder / "Gravity.csv");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("record Gravity too"));
  // A file that claims to have gravity is judged by its values.
  folder = tinyMars("without_gravity_values");
  replaceAll(folder / "gyro_accel.csv", ", 9.7,", ", 0.1,");
  EXPECT_THAT(checkData(openPhone(folder)->recording(), {}),
              Contains(testing::Field(&DataFinding::code, "accel_without_gravity")));
}

TEST(Phone, ThePlatformGivesTheSignOfAccelerations) {
  auto folder = tinySensorLogger("standardised");
  replaceAll(folder / "Metadata.csv", "10,false", "10,true");
  EXPECT_NEAR(openPhone(folder)->recording().imu[0].accel.y(), -9.7, 1e-9);
  fs::remove(folder / "Metadata.csv");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("Metadata.csv is missing"));
  folder = tinySensorLogger("android");
  replaceAll(folder / "Metadata.csv", "ios", "android");
  fs::rename(folder / "Gravity.csv", folder / "TotalAcceleration.csv");
  EXPECT_NEAR(openPhone(folder)->recording().imu[0].accel.y(), -9.80665, 1e-9);
}

TEST(Phone, ImagesOfSensorLoggerAreNamedByTheirTime) {
  const auto folder = tinySensorLogger("images_by_time");
  fs::remove(folder / "Camera/1000.mp4");
  for (int i = 0; i < 5; ++i) {
    writePicture(folder / "Camera" / (std::to_string(1000 + 50 * i) + ".png"), i);
  }
  const auto dataset = openPhone(folder);
  ASSERT_EQ(dataset->recording().frames.size(), 5U);
  EXPECT_EQ(numberOf(*dataset->frameAt(3)), 3);
  EXPECT_EQ(toNanoseconds(*dataset->frameTime(3)), frameStamp(3));
}

TEST(Phone, GapsOfTheAccelerometerAreNotBridged) {
  const auto folder = tinyOpenCamera("accel_gap");
  std::string accel;
  for (const auto ns : accelStamps()) {
    if (ns > 1'500'000'000 && ns < 2'000'000'000) continue;
    accel += "0,9.8,0," + std::to_string(ns) + "\n";
  }
  writeText(folder / "VID_1_accel.csv", accel);
  const auto dataset = openPhone(folder);
  EXPECT_EQ(dataset->reasons().of("imu_unpaired"), 99U);
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("99 of 441 samples")));
  while (dataset->next()) {
  }
  EXPECT_EQ(dataset->reasons().of("imu_gap"), 1U);
}

TEST(Phone, SensorsOfTwoClocksAreRefused) {
  const auto folder = tinyOpenCamera("two_clocks");
  replaceAll(folder / "VID_1_accel.csv", "0000000\n", "0000000000\n");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("have no time in common"));
}

TEST(Phone, TwoRecordingsInOneFolderAreRefused) {
  const auto folder = tinyOpenCamera("two_recordings");
  fs::copy_file(folder / "VID_1_gyro.csv", folder / "VID_2_gyro.csv");
  EXPECT_THAT(errorOfPhone(folder), HasSubstr("move each into a folder"));
}

TEST(Phone, OpenCameraWritesItsTablesBesideOrBelowTheFilm) {
  const auto folder = tinyOpenCamera("below");
  fs::create_directories(folder / "VID_1");
  for (const char* table : {"VID_1_gyro.csv", "VID_1_accel.csv", "VID_1_timestamps.csv"}) {
    fs::rename(folder / table, folder / "VID_1" / table);
  }
  EXPECT_EQ(openPhone(folder / "VID_1")->recording().frames.size(), std::size_t{kFilmFrames});
  fs::remove(folder / "VID_1/VID_1_timestamps.csv");
  EXPECT_THAT(errorOfPhone(folder / "VID_1"), HasSubstr("VID_1_timestamps.csv"));
}

TEST(Phone, OtherJsonFilesAreNoRecording) {
  const auto folder = freshFolder("other_json");
  writeText(folder / "instances.json", "{\"images\": [{\"id\": 1, \"file_name\": \"a.png\"}]}");
  EXPECT_THAT(errorOfPhone(folder), AllOf(HasSubstr("is no dataset folder that is known"),
                                          HasSubstr("of a phone's logger")));
}

/// Writes the images of a drive into a film, which changes them a little.
void writeFilmOf(Dataset& drive, const fs::path& file) {
  const CameraCalibration& camera = drive.calibration().cameras[0];
  const cv::Size size(static_cast<int>(camera.width), static_cast<int>(camera.height));
  cv::VideoWriter film(file.string(), cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 20.0, size);
  while (auto message = drive.next()) {
    const auto* frame = std::get_if<Frame>(&*message);
    if (!frame) continue;
    const cv::Mat grey(size, CV_8UC1, const_cast<std::uint8_t*>(frame->data->data()));
    cv::Mat colour;
    cv::merge(std::vector<cv::Mat>(3, grey), colour);
    film.write(colour);
  }
}

/// Writes a drive in the format of MARS Logger.
fs::path marsOf(Dataset& drive, const std::string& name) {
  const fs::path folder = freshFolder(name);
  std::string
      list = "Frame timestamp[nanosec],Unix time[nanosec]\n",
      imu =
          "Timestamp[nanosec], gx[rad/s], gy[rad/s], gz[rad/s], ax[m/s^2], ay[m/s^2], az[m/s^2]\n";
  for (const ImuSample& s : drive.recording().imu) {
    imu += std::to_string(toNanoseconds(s.time));
    for (const double v :
         {s.gyro.x(), s.gyro.y(), s.gyro.z(), s.accel.x(), s.accel.y(), s.accel.z()}) {
      imu += "," + std::to_string(v);
    }
    imu += "\n";
  }
  for (const auto& frame : drive.recording().frames) {
    list += std::to_string(toNanoseconds(frame.time)) + ",1\n";
  }
  writeText(folder / "gyro_accel.csv", imu);
  writeText(folder / "frame_timestamps.txt", list);
  writeFilmOf(drive, folder / "movie.mp4");
  return folder;
}

TEST(Phone, ADriveInMarsFormatGivesTheMessagesOfItsEurocForm) {
  const auto root = tinyEuroc("as_euroc");
  const auto euroc = Dataset::open({.path = root});
  const auto folder = marsOf(*euroc, "as_mars");
  writeText(folder / "rig.yaml", rigText(euroc->calibration(), "of the drive"));
  euroc->seek(0);
  const auto mars = Dataset::open(
      {.path = folder, .encoding = ImageEncoding::kMono8, .rig = folder / "rig.yaml"});
  EXPECT_EQ(mars->calibration().cameras[0].fx, euroc->calibration().cameras[0].fx);
  EXPECT_EQ(mars->calibration().imu->accel_noise, euroc->calibration().imu->accel_noise);
  std::size_t messages = 0;
  while (auto message = euroc->next()) {
    const auto other = mars->next();
    ASSERT_TRUE(other);
    ASSERT_EQ(other->index(), message->index());
    ++messages;
    if (const auto* sample = std::get_if<ImuSample>(&*message)) {
      const auto& same = std::get<ImuSample>(*other);
      EXPECT_EQ(same.time, sample->time);
      EXPECT_EQ(same.sequence, sample->sequence);
      EXPECT_EQ(same.gyro, sample->gyro);
      EXPECT_EQ(same.accel, sample->accel);
      continue;
    }
    const auto& frame = std::get<Frame>(*message);
    const auto& same = std::get<Frame>(*other);
    EXPECT_EQ(same.stamp.time, frame.stamp.time);
    EXPECT_EQ(same.stamp.sequence, frame.stamp.sequence);
    EXPECT_EQ(same.encoding, frame.encoding);
    ASSERT_EQ(same.data->size(), frame.data->size());
    double difference = 0.0;
    for (std::size_t i = 0; i < frame.data->size(); ++i) {
      difference += std::abs((*same.data)[i] - (*frame.data)[i]);
    }
    EXPECT_LT(difference / static_cast<double>(frame.data->size()), 6.0) << "grey levels";
  }
  EXPECT_EQ(messages, 66U);
  EXPECT_FALSE(mars->next());
}

}  // namespace
}  // namespace perdure::replay
