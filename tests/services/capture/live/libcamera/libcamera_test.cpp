// Tests the use of libcamera as far as possible without a camera.
#include <gmock/gmock.h>
#include <libcamera/libcamera.h>
#include <libcamera/version.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "services/capture/live/libcamera/controls.h"
#include "services/capture/live/libcamera/log.h"
#include "services/capture/live/libcamera/session.h"
#include "services/capture/live/libcamera/shared_manager.h"

namespace perdure::capture {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
namespace controls = libcamera::controls;

/// The controls of a UVC camera, which has no frame rate control.
libcamera::ControlInfoMap webcam(bool with_gain = true) {
  libcamera::ControlInfoMap::Map map = {
      {&controls::AeEnable, libcamera::ControlInfo(false, true, true)},
      {&controls::ExposureTime, libcamera::ControlInfo(100, 500'000, 15'600)}};
  if (with_gain) map.emplace(&controls::AnalogueGain, libcamera::ControlInfo(0.5F, 4.0F, 1.0F));
  return {std::move(map), controls::controls};
}

CameraSettings manual() {
  CameraSettings settings;
  settings.exposure_ms = 10.0;
  settings.gain = 2.0;
  return settings;
}

TEST(LibcameraControls, AskForTheExposureAndTheGainThatAreConfigured) {
  const auto offered = webcam();
  const AskedControls asked = controlsFor(manual(), offered);
  EXPECT_EQ(asked.list.get(controls::AeEnable), false);
  EXPECT_EQ(asked.list.get(controls::ExposureTime), 10'000);
  EXPECT_EQ(asked.list.get(controls::AnalogueGain), 2.0F);
  EXPECT_EQ(asked.missing, "");
  EXPECT_TRUE(controlsFor({}, offered).list.empty()) << "automatic";
}

TEST(LibcameraControls, SayWhichOfThemTheCameraDoesNotOffer) {
  const auto offered = webcam(false);
  const AskedControls asked = controlsFor(manual(), offered);
  EXPECT_EQ(asked.missing, "The camera offers no AnalogueGain (camera.gain), and keeps its own.");
  EXPECT_EQ(asked.list.get(controls::ExposureTime), 10'000);
  const libcamera::ControlInfoMap none({}, controls::controls);
  EXPECT_THAT(controlsFor(manual(), none).missing, HasSubstr("ExposureTime (camera.exposure_ms)"));
  EXPECT_EQ(controlsFor({}, none).missing, "");
}

TEST(LibcameraControls, AskForTheRateWhereThereIsAControlOfIt) {
  const libcamera::ControlInfoMap offered(
      {{&controls::FrameDurationLimits,
        libcamera::ControlInfo(std::int64_t{10'000}, std::int64_t{1'000'000})}},
      controls::controls);
  CameraSettings settings;
  settings.rate_hz = 25.0;
  const auto asked = controlsFor(settings, offered);
  const auto limits = asked.list.get(controls::FrameDurationLimits);
  ASSERT_TRUE(limits);
  EXPECT_THAT(std::vector<std::int64_t>(limits->begin(), limits->end()),
              ElementsAre(40'000, 40'000));
}

libcamera::ControlInfoMap withFocus() {
  return {{{&controls::AfMode, libcamera::ControlInfo(controls::AfModeValues)},
           {&controls::LensPosition, libcamera::ControlInfo(0.0F, 10.0F, 1.0F)}},
          controls::controls};
}

CameraSettings focused(const std::string& focus, double dioptres = 0.0) {
  CameraSettings settings;
  settings.focus = focus;
  settings.lens_dioptres = dioptres;
  return settings;
}

TEST(LibcameraControls, FocusIsAskedForAsConfigured) {
  const auto offered = withFocus();
  EXPECT_TRUE(controlsFor({}, offered).list.empty()) << "as it is";
  const auto automatic = controlsFor(focused("auto"), offered);
  EXPECT_EQ(automatic.list.get(controls::AfMode), controls::AfModeContinuous);
  EXPECT_FALSE(automatic.list.contains(controls::LENS_POSITION));
  const auto fixed = controlsFor(focused("manual", 2.5), offered);
  EXPECT_EQ(fixed.list.get(controls::AfMode), controls::AfModeManual);
  EXPECT_EQ(fixed.list.get(controls::LensPosition), 2.5F);
  EXPECT_EQ(fixed.refused, "");
}

TEST(LibcameraControls, ACameraThatCannotFocusAsConfiguredIsRefused) {
  const auto fixed = webcam();
  EXPECT_EQ(controlsFor({}, fixed).refused, "");
  for (const char* focus : {"auto", "manual"}) {
    EXPECT_THAT(controlsFor(focused(focus), fixed).refused, HasSubstr("set camera.focus to as_is"));
  }
  EXPECT_THAT(controlsFor(focused("manual", 12.0), withFocus()).refused,
              HasSubstr("from 0 to 10 dioptres; set camera.lens_dioptres"));
}

TEST(LibcameraControls, ARegionOfInterestIsAskedForOrMissed) {
  const libcamera::ControlId& id = controls::ScalerCrop;
  const libcamera::ControlInfoMap offered(
      libcamera::ControlInfoMap::Map{
          {&id, libcamera::ControlInfo(libcamera::Rectangle(0, 0, 64, 64),
                                       libcamera::Rectangle(0, 0, 3280, 2464))}},
      controls::controls);
  CameraSettings settings;
  settings.crop = {100, 50, 1280, 960};
  EXPECT_EQ(controlsFor(settings, offered).list.get(controls::ScalerCrop),
            libcamera::Rectangle(100, 50, 1280, 960));
  const libcamera::ControlInfoMap none(libcamera::ControlInfoMap::Map{}, controls::controls);
  EXPECT_THAT(controlsFor(settings, none).missing, HasSubstr("ScalerCrop (camera.crop)"));
}

#if LIBCAMERA_VERSION_MAJOR > 0 || LIBCAMERA_VERSION_MINOR >= 5
TEST(LibcameraControls, ExposureAndGainAreMadeManualEachWhereTheCameraHasThatApart) {
  const auto mode = [] { return libcamera::ControlInfo(0, 1, 0); };
  libcamera::ControlInfoMap::Map map = {
      {&controls::ExposureTimeMode, mode()},
      {&controls::ExposureTime, libcamera::ControlInfo(100, 500'000, 15'600)},
      {&controls::AnalogueGainMode, mode()},
      {&controls::AnalogueGain, libcamera::ControlInfo(0.5F, 4.0F, 1.0F)}};
  const libcamera::ControlInfoMap offered{std::move(map), controls::controls};
  const AskedControls asked = controlsFor(manual(), offered);
  EXPECT_EQ(asked.list.get(controls::ExposureTimeMode), controls::ExposureTimeModeManual);
  EXPECT_EQ(asked.list.get(controls::AnalogueGainMode), controls::AnalogueGainModeManual);
  EXPECT_EQ(asked.missing, "");
}
#endif

/// A camera that cannot flip its images.
class Fixed : public libcamera::CameraConfiguration {
 public:
  Status validate() override {
    const bool as_it_was = flips(*this, "none");
    if (!as_it_was) askFlip(*this, "none");
    return as_it_was ? Valid : Adjusted;
  }
};

TEST(LibcameraControls, AFlipIsAskedForAndItIsSeenWhereTheCameraTakesItBack) {
  for (const char* flip : {"horizontal", "vertical", "both"}) {
    Fixed configuration;
    EXPECT_TRUE(flips(configuration, "none")) << "as it comes";
    askFlip(configuration, flip);
    EXPECT_TRUE(flips(configuration, flip));
    EXPECT_FALSE(flips(configuration, "none"));
    configuration.validate();
    EXPECT_FALSE(flips(configuration, flip));
  }
}

/// A camera mounted at 90°. No flip makes its images upright, and libcamera reports that.
class Rolled : public libcamera::CameraConfiguration {
 public:
  Status validate() override {
#if __has_include(<libcamera/orientation.h>)
    orientation = libcamera::Orientation::Rotate90;
#else
    transform = libcamera::Transform::Rot90;
#endif
    return Adjusted;
  }
};

TEST(LibcameraControls, ImagesOfACameraThatIsMountedRolledAreTakenAsTheyCome) {
  Rolled configuration;
  askFlip(configuration, "none");
  configuration.validate();
  EXPECT_FALSE(flips(configuration, "none"));
  EXPECT_EQ(flipRefused(configuration, "none"), "");
  EXPECT_THAT(flipRefused(configuration, "both"), HasSubstr("set camera.flip to none"));
}

#if __has_include(<libcamera/orientation.h>)
TEST(LibcameraControls, AFlipIsAnOrientationOfTheUprightImage) {
  Fixed configuration;
  askFlip(configuration, "horizontal");
  EXPECT_EQ(configuration.orientation, libcamera::Orientation::Rotate0Mirror);
  askFlip(configuration, "vertical");
  EXPECT_EQ(configuration.orientation, libcamera::Orientation::Rotate180Mirror);
  askFlip(configuration, "both");
  EXPECT_EQ(configuration.orientation, libcamera::Orientation::Rotate180);
}
#else
TEST(LibcameraControls, AFlipIsATransformOfTheUprightImage) {
  Fixed configuration;
  askFlip(configuration, "horizontal");
  EXPECT_EQ(configuration.transform, libcamera::Transform::HFlip);
  askFlip(configuration, "vertical");
  EXPECT_EQ(configuration.transform, libcamera::Transform::VFlip);
  askFlip(configuration, "both");
  EXPECT_EQ(configuration.transform, libcamera::Transform::HVFlip);
}
#endif

TEST(LibcameraLog, KeepsTheWordsOfWarningsAndWhatIsWorse) {
  EXPECT_EQ(worthLogging("[0:01:02.34] [77] ERROR V4L2 v4l2_videodevice.cpp:1697 /dev/video0: "
                         "Failed to queue buffer 0\n"),
            "ERROR V4L2 v4l2_videodevice.cpp:1697 /dev/video0: Failed to queue buffer 0");
  EXPECT_EQ(worthLogging("[0:01:02.34] [77]  WARN UVC uvc.cpp:1 dim\n"), "WARN UVC uvc.cpp:1 dim");
  EXPECT_EQ(worthLogging("[0:01:02.34] [77]  INFO Camera camera.cpp:1026 configuring\n"),
            std::nullopt);
  EXPECT_EQ(worthLogging("[0:01:02.34] [77] DEBUG Camera camera.cpp:1 stop\n"), std::nullopt);
  EXPECT_EQ(worthLogging("Backtrace:\n"), "Backtrace:");
  EXPECT_EQ(worthLogging("  \n"), std::nullopt);
}

TEST(LibcameraLog, GetsLibcamerasLinesWithoutColours) {
  std::vector<std::string> lines;
  ::testing::internal::CaptureStderr();
  {
    const LibcameraLog log([&](const std::string& line) { lines.push_back(line); });
    const libcamera::ControlList empty(controls::controls);
    (void)empty.get(controls::AeEnable.id());  // libcamera logs an error for a control that is not
                                               // in the list
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  ASSERT_FALSE(lines.empty());
  EXPECT_THAT(lines.front(), HasSubstr("ERROR Controls"));
  EXPECT_THAT(lines.front(), Not(HasSubstr("\033")));
}

TEST(LibcameraSession, SaysThatThereIsNoCameraEachTimeItIsAsked) {
  CameraSettings settings;
  settings.id = "that nobody has";
  const OpenCamera open = libcameraOpeners({settings}, [](const std::string&) {}).front();
  for (int i = 0; i < 3; ++i) {
    const auto session = open();
    ASSERT_FALSE(session);
    EXPECT_EQ(session.error().code, "camera_absent");
    EXPECT_THAT(session.error().detail, HasSubstr("that nobody has in its id"));
  }
}

TEST(SharedManager, IsAnotherOneAsSoonAsNobodyUsesIt) {
  SharedManager shared([](const std::string&) {});
  auto user = *shared.manager();
  const std::weak_ptr<libcamera::CameraManager> first = user;
  shared.unplugged();
  EXPECT_EQ(*shared.manager(), user) << "another camera uses it";
  user.reset();
  user = *shared.manager();
  EXPECT_TRUE(first.expired());
  const std::weak_ptr<libcamera::CameraManager> second = user;
  user.reset();
  EXPECT_EQ(*shared.manager(), second.lock()) << "nothing was unplugged";
}

TEST(SharedManager, AsksTheCamerasThatRunAsideForOneThatCameAndIsNotFound) {
  const std::filesystem::path folder =
      ::testing::TempDir() + "/perdure_manager_" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  SharedManager shared([](const std::string&) {}, folder);
  auto running = *shared.manager();
  const auto miss = [&] {
    const auto looking = *shared.manager();
    shared.missing();
  };
  for (int i = 0; i < 10; ++i) miss();
  EXPECT_EQ(shared.restarts(), 0U) << "it is not there";
  std::ofstream(folder / "video0") << "x";
  for (int i = 0; i < 10; ++i) miss();
  EXPECT_EQ(shared.restarts(), 1U);
  running.reset();
  std::ofstream(folder / "video1") << "x";
  for (int i = 0; i < 10; ++i) miss();
  EXPECT_EQ(shared.restarts(), 1U) << "nobody is to be disturbed";
  std::filesystem::remove_all(folder);
}

/// A camera whose shutdown is complete at the attempt `over_at`, or never.
class Lingering : public Unended {
 public:
  struct Story {
    int tries = 0;
    bool destroyed = false;
  };
  Lingering(Story& story, int over_at, std::shared_ptr<libcamera::CameraManager> manager)
      : story_(story), over_at_(over_at), manager_(std::move(manager)) {}
  ~Lingering() override { story_.destroyed = true; }
  bool over() override { return ++story_.tries == over_at_; }

 private:
  Story& story_;
  const int over_at_;
  const std::shared_ptr<libcamera::CameraManager> manager_;
};

TEST(SharedManager, KeepsACameraUntilUdevToldOfItAndIsThenAnotherOne) {
  SharedManager shared([](const std::string&) {});
  Lingering::Story story;
  const std::weak_ptr<libcamera::CameraManager> first = *shared.manager();
  shared.keepUntilOver(std::make_unique<Lingering>(story, 2, first.lock()));
  shared.unplugged();
  EXPECT_EQ(*shared.manager(), first.lock()) << "the camera still uses it";
  EXPECT_TRUE(shared.keeps());
  EXPECT_FALSE(story.destroyed);
  EXPECT_NE(*shared.manager(), nullptr);
  EXPECT_TRUE(first.expired());
  EXPECT_FALSE(shared.keeps());
  EXPECT_TRUE(story.destroyed);
}

TEST(SharedManager, LeavesACameraAloneThatIsNotOverInTime) {
  Lingering::Story never, late;
  auto camera = std::make_unique<Lingering>(never, 0, nullptr);
  const Unended* left = camera.get();
  const auto begin = std::chrono::steady_clock::now();
  {
    SharedManager shared([](const std::string&) {});
    shared.keepUntilOver(std::move(camera));
    shared.keepUntilOver(std::make_unique<Lingering>(late, 3, nullptr));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_FALSE(never.destroyed) << "libcamera's thread knows it";
  EXPECT_GT(never.tries, 10);
  EXPECT_TRUE(late.destroyed);
  delete left;
}

}  // namespace
}  // namespace perdure::capture
