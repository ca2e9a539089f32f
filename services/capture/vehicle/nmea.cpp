#include "services/capture/vehicle/nmea.h"

#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>

#include "services/capture/vehicle/whole_number.h"

namespace perdure::capture {
namespace {

constexpr double kKnot = 1852.0 / 3600.0;
constexpr double kUnstatedHdop = 10.0;
constexpr std::int64_t kRmcLasts_ns = 2'000'000'000;
constexpr std::size_t kLongest = 256;  // the standard allows 82, which many receivers exceed

/// Field i of a sentence; field 0 is its name. Empty if the field is missing.
std::string_view field(std::string_view sentence, std::size_t i) {
  for (; i > 0; --i) {
    const auto comma = sentence.find(',');
    if (comma == std::string_view::npos) return {};
    sentence.remove_prefix(comma + 1);
  }
  return sentence.substr(0, sentence.find(','));
}

/// Converts ddmm.mmmm or dddmm.mmmm and its hemisphere to degrees.
std::optional<double> angle(std::string_view text, std::string_view hemisphere, double most) {
  const auto value = wholeNumber(text);
  if (!value || *value < 0.0 || hemisphere.size() != 1) return std::nullopt;
  const double whole = std::floor(*value / 100.0), minutes = *value - 100.0 * whole;
  const double degrees = whole + minutes / 60.0;
  const bool negative = hemisphere == "S" || hemisphere == "W";
  if (minutes >= 60.0 || degrees > most || !(negative || hemisphere == "N" || hemisphere == "E")) {
    return std::nullopt;
  }
  return negative ? -degrees : degrees;
}

/// Whether the text has minutes: a latitude then has four digits before the point, a longitude
/// five.
bool hasMinutes(std::string_view text, std::size_t digits) {
  return text.substr(0, text.find('.')).size() == digits;
}

/// Text between $ and *, if the checksum is correct.
Result<std::string_view> sentenceOf(std::string_view line) {
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) {
    line.remove_suffix(1);
  }
  const auto star = line.rfind('*');
  if (line.size() < 9 || line.size() > kLongest || line.front() != '$' ||
      star == std::string_view::npos || star + 3 != line.size()) {
    return fail("nmea_malformed", "a line is not $…*SUM, as NMEA 0183 has them");
  }
  unsigned stated = 0, sum = 0;
  const auto [end, error] = std::from_chars(&line[star + 1], &line[star + 1] + 2, stated, 16);
  for (const char c : line.substr(1, star - 1)) sum ^= static_cast<unsigned char>(c);
  if (error != std::errc() || end != &line[star + 1] + 2 || stated != sum) {
    return fail("nmea_checksum", "a sentence of NMEA does not have the sum that stands behind it");
  }
  return line.substr(1, star - 1);
}

/// Standard deviation of a range, by GGA's quality. Multiplied by HDOP, it is that of a horizontal
/// position.
double rangeSigma(double quality) {
  if (quality == 4) return 0.02;    // RTK, fixed
  if (quality == 5) return 0.3;     // RTK, float
  return quality == 2 ? 1.0 : 3.0;  // differential; autonomous
}

/// Modes of GGA and RMC without measurement: estimated, entered manually, simulated.
constexpr double kLastMeasured = 5;
constexpr std::string_view kNotMeasured = "NSM";

tl::unexpected<Reason> noFix() {
  return fail("nmea_no_fix",
              "the receiver has no fix of satellites (one that is simulated, entered or estimated "
              "is none)");
}

}  // namespace

double courseOf(double degrees_from_north) {
  const double from_east = 90.0 - degrees_from_north;
  const double turns = std::ceil(from_east / 360.0 - 0.5);
  return (from_east - 360.0 * turns) * std::numbers::pi / 180.0;
}

Result<NmeaReader::Said> NmeaReader::read(std::string_view line, std::int64_t time_ns) {
  const auto sentence = sentenceOf(line);
  if (!sentence) return tl::unexpected(sentence.error());
  const std::string_view name = field(*sentence, 0);
  if (name.size() != 5) return Said{};
  const std::string_view kind = name.substr(2);
  if (kind == "RMC") return readRmc(*sentence, time_ns);
  if (kind == "VTG") return readVtg(*sentence, time_ns);
  if (kind == "GGA") return readGga(*sentence, time_ns);
  if (kind == "GST") readGst(*sentence);
  return Said{};
}

Result<NmeaReader::Said> NmeaReader::readRmc(std::string_view sentence, std::int64_t time_ns) {
  rmc_utc_.clear();
  rmc_ns_ = time_ns;
  const std::string_view mode = field(sentence, 12);
  const bool measured = mode.empty() || kNotMeasured.find(mode.front()) == std::string_view::npos;
  if (field(sentence, 2) != "A" || !measured) return noFix();
  const auto knots = wholeNumber(field(sentence, 7));
  speed_ = knots ? std::optional(*knots * kKnot) : std::nullopt;
  const auto course = wholeNumber(field(sentence, 8));
  course_ = course && isCourse(*course) ? std::optional(courseOf(*course)) : std::nullopt;
  rmc_utc_ = field(sentence, 1);
  Said said = whole(time_ns);
  said.speed = speed_;
  return said;
}

/// VTG is ignored after an RMC of the same time, because it adds nothing.
Result<NmeaReader::Said> NmeaReader::readVtg(std::string_view sentence, std::int64_t time_ns) {
  if (time_ns - rmc_ns_ < kRmcLasts_ns) return Said{};
  if (field(sentence, 9) == "N") return noFix();
  Said said;
  if (const auto kmh = wholeNumber(field(sentence, 7))) {
    said.speed = *kmh / 3.6;
  } else if (const auto knots = wholeNumber(field(sentence, 5))) {
    said.speed = *knots * kKnot;
  }
  return said;
}

Result<NmeaReader::Said> NmeaReader::readGga(std::string_view sentence, std::int64_t time_ns) {
  gga_utc_.clear();
  const double quality = wholeNumber(field(sentence, 6)).value_or(0.0);
  const auto satellites = wholeNumber(field(sentence, 7));
  if (quality < 1.0 || quality > kLastMeasured || satellites == 0.0) return noFix();
  if (!hasMinutes(field(sentence, 2), 4) || !hasMinutes(field(sentence, 4), 5)) {
    return fail(
        "nmea_malformed",
        "GGA's place is not ddmm.mmmm and dddmm.mmmm; degrees are to be followed by minutes");
  }
  const std::string_view unit = field(sentence, 10);
  if (!unit.empty() && unit != "M") {
    return fail("nmea_malformed", "GGA's height is not in metres (M)");
  }
  const auto latitude = angle(field(sentence, 2), field(sentence, 3), 90.0);
  const auto longitude = angle(field(sentence, 4), field(sentence, 5), 180.0);
  const auto above_sea = wholeNumber(field(sentence, 9));
  if (!latitude || !longitude || !above_sea) {
    return fail("nmea_malformed", "GGA says that there is a fix, and has no place or height");
  }
  // Some receivers report zeros without a fix.
  if (*latitude == 0.0 && *longitude == 0.0) return noFix();
  const double height = *above_sea + wholeNumber(field(sentence, 11)).value_or(0.0);
  if (!isHeight(height)) return fail("nmea_malformed", "GGA says a height that is not on Earth");
  place_.latitude_deg = *latitude;
  place_.longitude_deg = *longitude;
  place_.height_m = height;
  const double hdop = wholeNumber(field(sentence, 8)).value_or(0.0);
  place_.sigma_m = stated_sigma_m_.value_or((hdop > 0.0 ? hdop : kUnstatedHdop) *
                                            rangeSigma(quality) / std::numbers::sqrt2);
  gga_utc_ = field(sentence, 1);
  return whole(time_ns);
}

/// Standard deviations of latitude and longitude, as computed by the receiver.
void NmeaReader::readGst(std::string_view sentence) {
  const auto north = wholeNumber(field(sentence, 6)), east = wholeNumber(field(sentence, 7));
  const double sigma_m = north && east ? std::hypot(*north, *east) / std::numbers::sqrt2 : 0.0;
  stated_sigma_m_ = sigma_m > 0.0 ? std::optional(sigma_m) : std::nullopt;
}

NmeaReader::Said NmeaReader::whole(std::int64_t time_ns) {
  if (rmc_utc_.empty() || rmc_utc_ != gga_utc_) return {};
  GnssFix fix = place_;
  fix.time_ns = time_ns;
  fix.speed = speed_;
  fix.course = course_;
  rmc_utc_.clear();
  gga_utc_.clear();
  return {{}, fix};
}

}  // namespace perdure::capture
