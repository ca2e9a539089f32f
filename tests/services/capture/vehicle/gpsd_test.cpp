#include "services/capture/vehicle/gpsd.h"

#include <gmock/gmock.h>

#include <numbers>
#include <string>

namespace perdure::capture {
namespace {

TEST(Gpsd, ReadsATpvReport) {
  // The example of gpsd_json(5), with the ellipsoidal height of later versions.
  const auto fix = readGpsd(
      R"({"class":"TPV","device":"/dev/pts/1","time":"2005-06-08T10:34:48.283Z","ept":0.005,)"
      R"("lat":46.498293369,"lon":7.567411672,"alt":1343.127,"altHAE":1392.5,"eph":36.0,)"
      R"("track":10.3788,"speed":0.091,"climb":-0.085,"mode":3})",
      77);
  ASSERT_TRUE(fix) << fix.error().detail;
  ASSERT_TRUE(*fix);
  EXPECT_EQ((*fix)->time_ns, 77);
  EXPECT_DOUBLE_EQ((*fix)->latitude_deg, 46.498293369);
  EXPECT_DOUBLE_EQ((*fix)->longitude_deg, 7.567411672);
  EXPECT_DOUBLE_EQ((*fix)->height_m, 1392.5);
  EXPECT_NEAR((*fix)->sigma_m, 14.71, 0.01) << "eph holds 95 %";
  EXPECT_DOUBLE_EQ((*fix)->speed.value(), 0.091);
  EXPECT_NEAR((*fix)->course.value(), 1.389652, 1e-6);
}

TEST(Gpsd, SaysNothingOfOtherReports) {
  for (const char* line : {R"({"class":"VERSION","release":"3.22"})", R"({"class":"SKY"})"}) {
    const auto fix = readGpsd(line, 1);
    ASSERT_TRUE(fix) << line;
    EXPECT_FALSE(*fix) << line;
  }
}

TEST(Gpsd, SaysWhatIsNone) {
  const auto code = [](const char* line) {
    const auto fix = readGpsd(line, 1);
    return fix ? std::string("read") : fix.error().code;
  };
  EXPECT_EQ(code("no"), "gpsd_malformed");
  EXPECT_EQ(code("[1]"), "gpsd_malformed");
  EXPECT_EQ(code(R"({"class":7})"), "gpsd_malformed");
  EXPECT_EQ(code(R"({"class":"TPV","mode":1})"), "gpsd_no_fix");
  EXPECT_EQ(code(R"({"class":"TPV","mode":2,"lat":1,"lon":2,"alt":3})"), "gpsd_no_fix");
  EXPECT_EQ(code(R"({"class":"TPV","mode":3,"lat":"1","lon":2,"alt":3})"), "gpsd_no_fix");
  for (const char* status : {"5", "7", "8"}) {
    const auto line = std::string(R"({"class":"TPV","mode":3,"lat":1,"lon":2,"alt":3,"status":)");
    EXPECT_EQ(code((line + status + "}").c_str()), "gpsd_no_fix") << status;
  }
  EXPECT_EQ(code(R"({"class":"TPV","mode":3,"lat":1,"lon":2,"alt":3,"status":4})"), "read");
  EXPECT_EQ(code(R"({"class":"TPV","mode":3,"lat":0,"lon":0,"alt":3})"), "gpsd_no_fix");
  EXPECT_EQ(code(R"({"class":"TPV","mode":3,"lat":91,"lon":2,"alt":3})"), "gpsd_malformed");
  EXPECT_EQ(code(R"({"class":"TPV","mode":3,"lat":1,"lon":2,"alt":1e300})"), "gpsd_malformed");
}

TEST(Gpsd, CoursesAreFromEastCounterClockwise) {
  const auto course = [](const std::string& track) {
    const auto fix =
        readGpsd(R"({"class":"TPV","mode":3,"lat":1,"lon":2,"alt":3,"track":)" + track + "}", 1);
    return (*fix)->course.value() * 180.0 / std::numbers::pi;
  };
  EXPECT_NEAR(course("0"), 90.0, 1e-9);
  EXPECT_NEAR(course("90"), 0.0, 1e-9);
  EXPECT_NEAR(course("180"), -90.0, 1e-9);
  EXPECT_NEAR(course("270"), 180.0, 1e-9);
  EXPECT_NEAR(course("359"), 91.0, 1e-9);
}

TEST(Gpsd, ATrackThatIsNoneIsLeftOut) {
  const auto fix = readGpsd(R"({"class":"TPV","mode":3,"lat":1,"lon":2,"alt":3,"track":1e300})", 1);
  ASSERT_TRUE(fix && *fix);
  EXPECT_FALSE((*fix)->course);
}

}  // namespace
}  // namespace perdure::capture
