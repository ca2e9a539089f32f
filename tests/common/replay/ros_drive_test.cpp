// Recordings of ROS as datasets: the choice of topics, and the messages about missing parts. The
// recordings are rosbag2's SQLite, written here. tests/interop/ros tests files of foreign programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "common/replay/dataset.h"
#include "common/replay/recordings/ros_messages.h"
#include "common/replay/recordings/ros_topics.h"
#include "tests/common/replay/ros_twin.h"
#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;
using test::PlanOptions;
using test::Twin;
using test::twinOf;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

void expectSame(const Dataset& a, const Dataset& b) {
  const CameraCalibration &one = a.calibration().cameras[0], &other = b.calibration().cameras[0];
  EXPECT_EQ(one.width, other.width);
  EXPECT_EQ(one.fy, other.fy);
  EXPECT_EQ(one.distortion, other.distortion);
  EXPECT_EQ(one.distortion_coefficients, other.distortion_coefficients);
  EXPECT_LT((one.T_BC.matrix() - other.T_BC.matrix()).norm(), 1e-12);
  EXPECT_EQ(a.calibration().imu->gyro_noise, b.calibration().imu->gyro_noise);
}

class Images : public testing::TestWithParam<PlanOptions::Images> {};

TEST_P(Images, OfASqliteRecordingAreThoseOfTheFolder) {
  const Twin twin = twinOf("ros_same", {.images = GetParam()}, true);
  const auto folder = Dataset::open({.path = twin.folder});
  for (const fs::path& path : {twin.file, twin.file.parent_path()}) {
    const auto recorded = Dataset::open({.path = path, .rig = twin.rig});
    EXPECT_EQ(recorded->kind(), DatasetKind::kRosRecording);
    EXPECT_EQ(recorded->frameCount(), 5u);
    expectSame(*folder, *recorded);
    const auto again = Dataset::open({.path = twin.folder});
    const test::Given a = test::allOf(*again), b = test::allOf(*recorded);
    EXPECT_EQ(a.order, b.order);
    EXPECT_EQ(a.pixels.size(), 10u);
    EXPECT_EQ(a.pixels, b.pixels);
    EXPECT_TRUE(recorded->reasons().all().empty());
  }
}

// The number of used bits is determined from all images. The first three alone would give eight
// bits, and the others would be white.
TEST_P(Images, Of16BitsThatBeginInTheDarkAreScaledByTheBrightest) {
  const Twin twin = twinOf("ros_dark", {.images = GetParam(), .dark = 3});
  const auto bright = test::allOf(*Dataset::open({.path = twin.folder})).pixels;
  const auto pixels = test::allOf(*Dataset::open({.path = twin.file, .rig = twin.rig})).pixels;
  ASSERT_EQ(pixels.size(), bright.size());
  ASSERT_EQ(pixels.size(), 5u);
  int brightest = 0;
  for (std::size_t i = 3; i < 5; ++i) {
    brightest = std::max<int>(brightest, *std::max_element(bright[i].begin(), bright[i].end()));
  }
  int shift = 2;  // at least ten bits, more than the dark images use
  while (brightest * 16 >= 256 << shift) shift += 2;
  EXPECT_GE(brightest * 16, 256) << "eight bits must not do";
  for (std::size_t i = 0; i < 5; ++i) {
    ASSERT_EQ(pixels[i].size(), bright[i].size());
    std::size_t wrong = 0;
    for (std::size_t k = 0; k < bright[i].size(); ++k) {
      const int value = i < 3 ? bright[i][k] / 16 : bright[i][k] * 16;
      const int off = (pixels[i][k] << shift) - value;  // rounded down, or to nearest
      wrong += std::abs(off) < 1 << shift ? 0 : 1;
    }
    EXPECT_EQ(wrong, 0u) << "image " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Ros, Images,
                         testing::Values(PlanOptions::Images::kRaw, PlanOptions::Images::kPng));

TEST(RosDrive, GivesAnyImageOutOfTurn) {
  const Twin twin = twinOf("ros_turns");
  const auto dataset = Dataset::open({.path = twin.file, .rig = twin.rig});
  const auto all = test::allOf(*Dataset::open({.path = twin.folder})).pixels;
  for (const std::uint64_t index : {3u, 0u, 4u, 4u, 1u}) {
    const auto frame = dataset->frameAt(index);
    ASSERT_TRUE(frame) << index;
    EXPECT_TRUE(std::equal(frame->data->begin(), frame->data->end(), all[index].begin()));
  }
}

TEST(RosDrive, ImagesThatWereRecordedAtOneMomentAreReadInOrderAndOutOfTurn) {
  const Twin twin = twinOf("ros_moment", {.one_log_time = true}, true);
  const auto all = test::allOf(*Dataset::open({.path = twin.folder}));
  const auto dataset = Dataset::open({.path = twin.file, .rig = twin.rig});
  const test::Given read = test::allOf(*dataset);
  EXPECT_EQ(read.order, all.order);
  EXPECT_EQ(read.pixels, all.pixels);
  for (const std::uint64_t index : {3u, 0u, 4u, 4u, 1u}) {
    const auto frame = dataset->frameAt(index);
    ASSERT_TRUE(frame) << index;
    EXPECT_TRUE(std::equal(frame->data->begin(), frame->data->end(), all.pixels[2 * index].begin()))
        << index;
  }
}

/// A drive of 40 images, without its pixels.
fs::path longerDrive(const std::string& name) {
  const auto mav0 = tinyEuroc(name) / "mav0";
  std::string images, samples;
  for (std::int64_t i = 0; i < 40; ++i) {
    const std::string stamp = std::to_string(1'000'000'000 + 50'000'000 * i);
    if (i > 4)
      fs::copy_file(mav0 / "cam0/data/1000000000.png", mav0 / "cam0/data" / (stamp + ".png"));
    images += stamp + "," + stamp + ".png\n";
  }
  for (std::int64_t i = 0; i < 420; ++i) {
    samples += std::to_string(950'000'000 + 5'000'000 * i) + "," + std::to_string(i) +
               ",.2,.3,9.7,.5,-.5\n";
  }
  writeText(mav0 / "cam0/data.csv", images);
  writeText(mav0 / "imu0/data.csv", samples);
  return mav0.parent_path();
}

TEST(RosDrive, OfAClockThatWasSetBackTheOrderOfTheFileCounts) {
  const auto folder = Dataset::open({.path = longerDrive("ros_set_source")});
  const auto file = freshFolder("ros_set") / "run_0.db3",
             rig = freshFolder("ros_set_rig") / "r.yaml";
  test::writeDb3(*folder, file, {.set_ns = 2'000'000'000, .set_back_ns = 700'000'000});
  test::writeImuRig(*folder, rig);
  const auto drive = Dataset::open({.path = file, .rig = rig});
  folder->seek(0);
  const auto whole = test::allOf(*folder), read = test::allOf(*drive);
  EXPECT_EQ(read.order, whole.order);
  EXPECT_EQ(read.pixels, whole.pixels);
  EXPECT_EQ(drive->recording().clock_changes.size(), 2u);
}

TEST(RosDrive, MessagesWithoutStampsGetTheTimeOfTheirRecordingAndThatIsSaid) {
  const Twin twin = twinOf("ros_unstamped", {.stamps = false});
  const auto dataset = Dataset::open({.path = twin.file, .rig = twin.rig});
  EXPECT_EQ(dataset->frameTime(0), fromNanoseconds(1'001'000'000));
  EXPECT_THAT(dataset->recording().notes, Contains(HasSubstr("have no stamp")));
}

TEST(RosDrive, WhereTheCameraIsMustBeKnown) {
  const Twin twin = twinOf("ros_placeless", {.transforms = false});
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = twin.file, .rig = twin.rig}); }),
              AllOf(HasSubstr("has no /tf_static"), HasSubstr("T_cam_imu"), HasSubstr("--rig")));
}

TEST(RosDrive, ATransformThatIsNoneIsNamed) {
  const Twin twin = twinOf("ros_no_rotation", {.broken_transforms = true});
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = twin.file, .rig = twin.rig}); }),
              AllOf(HasSubstr("from `imu_link` to `cam0_optical` is none"), HasSubstr("0, 0, 0, 2"),
                    Not(HasSubstr("has no /tf_static"))));
}

/// Overwrites pages of the file with zeros, from share `begin` to share `end`; the head stays.
void zeroPages(const fs::path& file, double begin, double end) {
  constexpr std::streamoff kPage = 4096;
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  const double pages = static_cast<double>(fs::file_size(file)) / kPage;
  for (auto page = std::max(1.0, std::floor(begin * pages)); page < end * pages; ++page) {
    stream.seekp(static_cast<std::streamoff>(page) * kPage);
    const std::string zeros(kPage, '\0');
    stream.write(zeros.data(), kPage);
  }
}

TEST(RosDrive, OfADatabaseWithAHoleWhatComesBeforeIsReadAndTheHoleIsCounted) {
  for (const bool index : {true, false}) {
    const Twin twin = twinOf("ros_hole", {.index = index});
    const auto all = RosMessages(twin.file).topics();
    zeroPages(twin.file, 0.6, 0.9);
    RosMessages holed(twin.file);
    EXPECT_GE(holed.reasons().of("database_damaged"), 1U);
    EXPECT_THAT(holed.lastProblem(), HasSubstr("malformed"));
    EXPECT_GT(holed.topics().at("/imu0").messages, 0U);
    EXPECT_LT(holed.topics().at("/imu0").messages, all.at("/imu0").messages);
    holed.rewind({"/imu0"});
    std::uint64_t read = 0;
    while (holed.next()) ++read;
    EXPECT_GT(read, 0U) << "index " << index;
  }
}

TEST(RosDrive, OfADatabaseThatIsAllHolesTheDamageIsTold) {
  const Twin twin = twinOf("ros_holes");
  zeroPages(twin.file, 0.0, 1.0);
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = twin.file, .rig = twin.rig}); }),
              HasSubstr("malformed"));
}

TEST(RosDrive, TheNoiseOfTheInertialUnitMustBeKnown) {
  const Twin twin = twinOf("ros_noise");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = twin.file}); }),
              AllOf(HasSubstr("/imu0 is not known"), HasSubstr("gyroscope_noise_density")));
}

TEST(RosDrive, ARigFileGoesBeforeWhatTheRecordingSays) {
  const Twin twin = twinOf("ros_rig", {.transforms = false});
  auto rig = readText(twin.folder / "mav0" / "cam0" / "sensor.yaml");
  rig = rig.substr(rig.find("T_BS"));
  std::string text = "cam0:\n  rostopic: /cam0/image_raw\n  ";
  for (const char c : rig) text += c == '\n' ? "\n  " : std::string(1, c);
  text.replace(text.find("20.0, 21.0"), 10, "25.0, 26.0");
  writeText(twin.rig, text + "\n" + readText(twin.rig));
  const auto dataset = Dataset::open({.path = twin.file, .rig = twin.rig});
  EXPECT_EQ(dataset->calibration().cameras[0].fx, 25.0);
}

TEST(RosDrive, AnyBytesAreReadOrRefused) {
  const Twin twin = twinOf("ros_fuzz");
  const std::string whole = readText(twin.file);
  std::mt19937_64 random(4);
  int read = 0, refused = 0;
  for (int i = 0; i < 60; ++i) {
    std::string bytes = whole;
    for (std::uint64_t n = 1 + random() % 20; n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    if (random() % 4 == 0) bytes.resize(random() % bytes.size());
    writeText(twin.file, bytes);
    const std::string refusal = startupErrorOf([&] {
      read +=
          test::allOf(*Dataset::open({.path = twin.file, .rig = twin.rig})).order.empty() ? 0 : 1;
    });
    refused += refusal.empty() ? 0 : 1;
  }
  EXPECT_GT(read, 5);
  EXPECT_GT(refused, 5);
}

// SQLite's columns accept any type. Text sorts after all numbers, and is read as 0.
TEST(RosDrive, AMessageWhoseTimeIsNoNumberIsLeftOutAndCounted) {
  const Twin twin = twinOf("ros_text_stamps");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(twin.file.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, "UPDATE messages SET timestamp = 'noon' WHERE id IN (3, 7)",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(database);
  RosMessages recorded(twin.file);
  std::set<std::string> all;
  std::uint64_t stated = 0, read = 0, last = 0;
  for (const auto& [name, topic] : recorded.topics()) all.insert(name), stated += topic.messages;
  recorded.rewind(all);
  for (; const auto message = recorded.next(); ++read) {
    EXPECT_GE(message->log_ns, last);
    last = message->log_ns;
  }
  EXPECT_EQ(read + 2, stated);
  EXPECT_EQ(recorded.reasons().of("stamp_malformed"), 2U);
}

TEST(RosDrive, WhatIsNoRecordingIsRefusedWithTheFix) {
  const fs::path folder = freshFolder("ros_none");
  writeText(folder / "a.bag", "#ROSBAG V1.2\n");
  writeText(folder / "b.bag", "something else");
  writeText(folder / "d.bag", "");
  writeText(folder / "d.db3", "");
  writeText(folder / "c.db3", "nothing of the kind, and long enough for a head of SQLite's files");
  const auto errorOf = [&](const char* name) {
    return startupErrorOf([&] { Dataset::open({.path = folder / name}); });
  };
  EXPECT_THAT(errorOf("a.bag"), HasSubstr("rosbag fix"));
  EXPECT_THAT(errorOf("b.bag"), HasSubstr("is no bag of ROS 1"));
  EXPECT_THAT(errorOf("c.db3"), HasSubstr("ros2 bag record"));
  EXPECT_THAT(errorOf("d.bag"), HasSubstr("is empty"));
  EXPECT_THAT(errorOf("d.db3"), HasSubstr("is empty"));
}

TEST(RosDrive, MessagesInAnotherFormatAreNamed) {
  const Twin twin = twinOf("ros_json");
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(twin.file.c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "UPDATE topics SET serialization_format = 'json'", nullptr, nullptr,
               nullptr);
  sqlite3_close(database);
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = twin.file, .rig = twin.rig}); }),
              HasSubstr("Image in json, which is not read"));
}

TEST(RosDrive, JsonInPlaceOfBinaryMessagesIsNamed) {
  const auto changed = [](const char* change) {
    const Twin twin = twinOf("ros_json_inside");
    sqlite3* database = nullptr;
    EXPECT_EQ(sqlite3_open(twin.file.c_str(), &database), SQLITE_OK);
    sqlite3_exec(database, change, nullptr, nullptr, nullptr);
    sqlite3_close(database);
    return twin;
  };
  const Twin all = changed("UPDATE messages SET data = '{\"header\": {}}'");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = all.file, .rig = all.rig}); }),
              HasSubstr("holds JSON text, although"));
  const Twin imu = changed(
      "UPDATE messages SET data = '{\"header\": {}}' WHERE topic_id IN (SELECT id FROM topics "
      "WHERE type = 'sensor_msgs/msg/Imu')");
  EXPECT_THAT(startupErrorOf([&] { Dataset::open({.path = imu.file, .rig = imu.rig}); }),
              HasSubstr("imu0 holds JSON text"));
}

RosTopics topicsOfTypes(std::vector<std::pair<const char*, const char*>> list) {
  RosTopics topics;
  for (const auto& [name, type] : list)
    topics[name] = {std::string("sensor_msgs/") + type, ros::Encoding::kCdr, 3};
  return topics;
}

TEST(RosTopics, AreChosenByTypeWhereThereIsOne) {
  const auto chosen =
      chooseTopics(topicsOfTypes({{"/camera/image_raw", "Image"},
                                  {"/camera/image_raw/compressed", "CompressedImage"},
                                  {"/camera/image_rect", "Image"},
                                  {"/camera/depth/image", "Image"},
                                  {"/camera/camera_info", "CameraInfo"},
                                  {"/imu/data", "Imu"}}),
                   {}, "f");
  ASSERT_EQ(chosen.cameras.size(), 1u);
  EXPECT_EQ(chosen.cameras[0].image, "/camera/image_raw");
  EXPECT_EQ(chosen.cameras[0].info, "/camera/camera_info");
  EXPECT_FALSE(chosen.cameras[0].compressed);
  EXPECT_EQ(chosen.imu, "/imu/data");
}

TEST(RosTopics, OfTwoThatAreAPairTheLeftOneIsFirst) {
  const auto chosen =
      chooseTopics(topicsOfTypes({{"/right/image_raw/compressed", "CompressedImage"},
                                  {"/left/image_raw/compressed", "CompressedImage"},
                                  {"/left/camera_info", "CameraInfo"}}),
                   {}, "f");
  ASSERT_EQ(chosen.cameras.size(), 2u);
  EXPECT_EQ(chosen.cameras[0].image, "/left/image_raw/compressed");
  EXPECT_TRUE(chosen.cameras[0].compressed);
  EXPECT_EQ(chosen.cameras[0].info, "/left/camera_info");
  EXPECT_EQ(chosen.cameras[1].info, "");
  EXPECT_EQ(chosen.imu, "");
}

TEST(RosTopics, HalvesOfAnInertialUnitAreNoneAndTheFixIsSaid) {
  auto topics = topicsOfTypes({{"/camera/color/image_raw", "Image"},
                               {"/camera/accel/sample", "Imu"},
                               {"/camera/gyro/sample", "Imu"}});
  const auto errorOf = [&](const std::vector<std::string>& wanted) {
    return startupErrorOf([&] { chooseTopics(topics, topicsOf(wanted), "f"); });
  };
  for (const auto& wanted :
       {std::vector<std::string>(), std::vector<std::string>{"imu=/camera/gyro/sample"}}) {
    EXPECT_THAT(errorOf(wanted),
                AllOf(HasSubstr("/camera/accel/sample"), HasSubstr("/camera/gyro/sample"),
                      HasSubstr("unite_imu_method")));
  }
  topics["/camera/imu"] = topics["/camera/gyro/sample"];
  EXPECT_EQ(chooseTopics(topics, {}, "f").imu, "/camera/imu");
}

TEST(RosTopics, ImagesOfOtherTypesAreNamed) {
  RosTopics topics;
  topics["/cam"] = {"foxglove_msgs/CompressedImage", ros::Encoding::kCdr, 3};
  EXPECT_THAT(startupErrorOf([&] { chooseTopics(topics, {}, "f"); }),
              HasSubstr("those on /cam are foxglove_msgs/CompressedImage, which is not read"));
}

TEST(RosTopics, WhereSeveralMayBeMeantOneMustBeNamed) {
  const auto topics = topicsOfTypes({{"/front/image_raw", "Image"},
                                     {"/rear/image_rect_color", "Image"},
                                     {"/a/imu", "Imu"},
                                     {"/b/imu", "Imu"}});
  const auto errorOf = [&](const std::vector<std::string>& wanted) {
    return startupErrorOf([&] { chooseTopics(topics, topicsOf(wanted), "f"); });
  };
  EXPECT_THAT(errorOf({}), AllOf(HasSubstr("/front/image_raw, /rear/image_rect_color"),
                                 HasSubstr("cam0=TOPIC")));
  EXPECT_THAT(errorOf({"cam0=/front/image_raw"}), HasSubstr("/a/imu, /b/imu"));
  EXPECT_THAT(errorOf({"cam0=/side"}), AllOf(HasSubstr("on /side"), HasSubstr("/front/image_raw")));
  EXPECT_THAT(errorOf({"front"}), HasSubstr("cam0=TOPIC"));
  const auto chosen =
      chooseTopics(topics, topicsOf({"cam0=/rear/image_rect_color", "imu=/b/imu"}), "f");
  EXPECT_TRUE(chosen.cameras[0].rectified);
  EXPECT_EQ(chosen.imu, "/b/imu");
}

}  // namespace
}  // namespace perdure::replay
