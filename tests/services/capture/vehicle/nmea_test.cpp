#include "services/capture/vehicle/nmea.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

namespace perdure::capture {
namespace {

/// Appends the checksum.
std::string sentence(const std::string& text) {
  unsigned sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  char end[8];
  std::snprintf(end, sizeof end, "*%02X\r\n", sum);
  return "$" + text + end;
}

TEST(Nmea, RmcAndGgaOfOneTimeAreAFix) {
  NmeaReader reader;
  // Examples from the description of u-blox's receivers, with their checksums.
  auto said =
      reader.read("$GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A*57", 1000);
  ASSERT_TRUE(said) << said.error().detail;
  EXPECT_NEAR(said->speed.value(), 0.004 * 1852.0 / 3600.0, 1e-12);
  EXPECT_FALSE(said->fix);
  EXPECT_TRUE(NmeaReader().read(
      "$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5B\r\n", 1));
  said = reader.read(
      sentence("GPGGA,083559.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,"), 2000);
  ASSERT_TRUE(said) << said.error().detail;
  ASSERT_TRUE(said->fix);
  EXPECT_EQ(said->fix->time_ns, 2000);
  EXPECT_NEAR(said->fix->latitude_deg, 47.0 + 17.11399 / 60.0, 1e-12);
  EXPECT_NEAR(said->fix->longitude_deg, 8.0 + 33.91590 / 60.0, 1e-12);
  EXPECT_NEAR(said->fix->height_m, 547.6, 1e-9);
  EXPECT_NEAR(said->fix->sigma_m, 3.03 / std::numbers::sqrt2, 1e-9);
  EXPECT_NEAR(said->fix->course.value(), (90.0 - 77.52) * std::numbers::pi / 180.0, 1e-12);
  // A fix needs both sentences, each once and of the same time.
  EXPECT_FALSE(
      reader.read(sentence("GNGGA,083600.00,4717.1,S,00833.9,W,4,12,0.6,1.0,M,2.0,M,,"), 3)->fix);
  EXPECT_FALSE(
      reader.read(sentence("GNRMC,083600.10,A,4717.1,S,00833.9,W,1,90,091202,,,A"), 4)->fix);
  const auto south =
      reader.read(sentence("GNGGA,083600.10,4717.1,S,00833.9,W,4,12,0.6,1.0,M,2.0,M,,"), 5);
  ASSERT_TRUE(south->fix);
  EXPECT_LT(south->fix->latitude_deg, 0.0);
  EXPECT_LT(south->fix->longitude_deg, 0.0);
  EXPECT_NEAR(south->fix->sigma_m, 0.012 / std::numbers::sqrt2, 1e-9) << "RTK";
}

TEST(Nmea, TheReceiversOwnDeviationGoesFirst) {
  NmeaReader reader;
  ASSERT_TRUE(reader.read(sentence("GPGST,082356.00,1.8,,,,1.7,1.3,2.2"), 1));
  ASSERT_TRUE(reader.read(sentence("GPRMC,082356.00,A,4717.1,N,00833.9,E,1,90,091202,,,A"), 2));
  const auto said =
      reader.read(sentence("GPGGA,082356.00,4717.1,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,"), 3);
  ASSERT_TRUE(said->fix);
  EXPECT_NEAR(said->fix->sigma_m, std::hypot(1.7, 1.3) / std::numbers::sqrt2, 1e-12);
}

TEST(Nmea, VtgHasASpeed) {
  NmeaReader reader;
  EXPECT_NEAR(reader.read(sentence("GPVTG,77.52,T,,M,0.004,N,36.0,K,A"), 1)->speed.value(), 10.0,
              1e-12);
  EXPECT_NEAR(reader.read(sentence("GPVTG,77.52,T,,M,36.0,N,,K,A"), 1)->speed.value(),
              36.0 * 1852.0 / 3600.0, 1e-12);
  EXPECT_FALSE(reader.read(sentence("GPVTG,,T,,M,,N,,K,A"), 1)->speed);
  // A VTG of the same time as an RMC gives no further speed.
  ASSERT_TRUE(reader.read(sentence("GPRMC,083559.00,A,4717.1,N,00833.9,E,1,90,091202,,,A"), 2));
  const std::string vtg = sentence("GPVTG,77.52,T,,M,0.004,N,36.0,K,A");
  EXPECT_FALSE(reader.read(vtg, 1'000'000'000)->speed);
  EXPECT_TRUE(reader.read(vtg, 3'000'000'000)->speed) << "there is no RMC any more";
}

TEST(Nmea, SaysWhatIsNone) {
  NmeaReader reader;
  const auto code = [&](const std::string& line) {
    const auto said = reader.read(line, 1);
    return said ? std::string("read") : said.error().code;
  };
  EXPECT_EQ(code("hello"), "nmea_malformed");
  EXPECT_EQ(code(""), "nmea_malformed");
  EXPECT_EQ(code("$GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A*58"),
            "nmea_checksum");
  EXPECT_EQ(code("$GPRMC,083559.00,A*G7"), "nmea_checksum");
  EXPECT_EQ(code(sentence("GPRMC,083559.00,V,,,,,,,091202,,,N")), "nmea_no_fix");
  EXPECT_EQ(code(sentence("GPGGA,083559.00,,,,,0,00,99.99,,,,,,")), "nmea_no_fix");
  EXPECT_EQ(NmeaReader().read(sentence("GPVTG,,,,,,,,,N"), 1).error().code, "nmea_no_fix");
  EXPECT_EQ(code(sentence("GPGGA,083559.00,9917.1,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,")),
            "nmea_malformed");
  EXPECT_EQ(code(sentence("GPGGA,083559.00,4760.0,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,")),
            "nmea_malformed");
  EXPECT_EQ(code(sentence("GPGSV,3,1,11,03,03,111,00")), "read") << "of no use, and no fault";
  EXPECT_EQ(code("$" + std::string(400, 'x') + "*00"), "nmea_malformed");
}

TEST(Nmea, AHeightThatIsNotOnEarthIsNoFix) {
  const auto code = [](const std::string& heights) {
    NmeaReader reader;
    const auto said =
        reader.read(sentence("GPGGA,083559.00,4717.1,N,00833.9,E,1,08,1.0," + heights + ",M,,"), 1);
    return said ? std::string("read") : said.error().code;
  };
  EXPECT_EQ(code("99000,M,48"), "read");
  EXPECT_EQ(code("1e6,M,48"), "nmea_malformed");
  EXPECT_EQ(code("1.7e308,M,1.7e308"), "nmea_malformed") << "their sum is infinite";
}

TEST(Nmea, ACourseThatIsNoneIsLeftOut) {
  const auto courseIn = [](const std::string& course) {
    NmeaReader reader;
    (void)reader.read(sentence("GPRMC,1,A,4717.1,N,00833.9,E,1," + course + ",091202,,,A"), 1);
    const auto said =
        reader.read(sentence("GPGGA,1,4717.1,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,"), 2);
    return said.value().fix.value().course;
  };
  EXPECT_TRUE(courseIn("360"));
  EXPECT_FALSE(courseIn("361"));
  EXPECT_FALSE(courseIn("-1"));
  EXPECT_FALSE(courseIn("1e300"));
}

TEST(Nmea, ADeviationOfZeroIsNotKnown) {
  NmeaReader reader;
  ASSERT_TRUE(reader.read(sentence("GPGST,1,0,,,,0.0,0.0,0"), 1));
  ASSERT_TRUE(reader.read(sentence("GPRMC,1,A,4717.1,N,00833.9,E,1,90,091202,,,A"), 2));
  const auto said =
      reader.read(sentence("GPGGA,1,4717.1,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,"), 3);
  EXPECT_NEAR(said.value().fix.value().sigma_m, 3.0 / std::numbers::sqrt2, 1e-9) << "by HDOP";
}

TEST(Nmea, CoursesAreFromEastCounterClockwise) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_NEAR(courseOf(0.0), kPi / 2, 1e-12);
  EXPECT_NEAR(courseOf(90.0), 0.0, 1e-12);
  EXPECT_NEAR(courseOf(180.0), -kPi / 2, 1e-12);
  EXPECT_NEAR(courseOf(270.0), kPi, 1e-12);
  EXPECT_NEAR(courseOf(359.0), 91.0 * kPi / 180.0, 1e-12);
}

TEST(Nmea, APlaceThatSatellitesDidNotGiveIsNoFix) {
  const auto codeOf = [](const std::string& gga, const char* mode = "A") {
    NmeaReader reader;
    const auto rmc = reader.read(
        sentence(std::string("GPRMC,083559.00,A,4717.1,N,00833.9,E,9,77,091202,,,") + mode), 1);
    if (!rmc) return rmc.error().code;
    const auto said = reader.read(sentence("GPGGA,083559.00," + gga), 2);
    return said ? std::string(said->fix ? "fix" : "") : said.error().code;
  };
  EXPECT_EQ(codeOf("4717.1,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,"), "fix");
  EXPECT_EQ(codeOf("4717.1,N,00833.9,E,1,,1.0,499.6,,48.0,M,,"), "fix") << "as short ones write";
  for (const char* quality : {"6", "7", "8"}) {
    EXPECT_EQ(codeOf(std::string("4717.1,N,00833.9,E,") + quality + ",08,1.0,499.6,M,48.0,M,,"),
              "nmea_no_fix");
  }
  for (const char* mode : {"N", "S", "M"}) {
    EXPECT_EQ(codeOf("4717.1,N,00833.9,E,1,08,1.0,499.6,M,48.0,M,,", mode), "nmea_no_fix");
  }
  EXPECT_EQ(codeOf("4717.1,N,00833.9,E,1,00,1.0,499.6,M,48.0,M,,"), "nmea_no_fix");
  EXPECT_EQ(codeOf("0000.000,N,00000.000,E,1,08,1.0,0.0,M,0.0,M,,"), "nmea_no_fix");
  EXPECT_EQ(codeOf("48.1,N,11.5,E,1,08,1.0,499.6,M,48.0,M,,"), "nmea_malformed") << "degrees";
  EXPECT_EQ(codeOf("4717.1,N,00833.9,E,1,08,1.0,1640.4,F,48.0,M,,"), "nmea_malformed") << "feet";
}

}  // namespace
}  // namespace perdure::capture
