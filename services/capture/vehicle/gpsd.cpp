#include "services/capture/vehicle/gpsd.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace perdure::capture {
namespace {

using Json = nlohmann::json;

constexpr double kSigmasOfEph = 2.4477;  // √(χ²₂): radius of a 95 % circle in σ
constexpr double kUnstated_m = 10.0;     // standard deviation if gpsd reports none

std::optional<double> number(const Json& json, const char* key) {
  const auto it = json.find(key);
  if (it == json.end() || !it->is_number()) return std::nullopt;
  const double value = it->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// Returns whether a height is plausible, including heights in the air and below sea level.
bool isHeight(double metres) { return std::abs(metres) <= 1e5; }

/// Converts degrees clockwise from north to radians counter-clockwise from east, (−π, π].
double courseOf(double degrees_from_north) {
  const double from_east = 90.0 - degrees_from_north;
  const double turns = std::ceil(from_east / 360.0 - 0.5);
  return (from_east - 360.0 * turns) * std::numbers::pi / 180.0;
}

/// Returns false for gpsd's statuses of dead reckoning, of a fixed position and of a simulator.
bool isMeasured(const Json& json) {
  const double status = number(json, "status").value_or(0.0);
  return status != 5.0 && status != 7.0 && status != 8.0;
}

}  // namespace

Result<std::optional<GnssFix>> readGpsd(std::string_view line, std::int64_t time_ns) {
  const Json json = Json::parse(line, nullptr, false);
  if (!json.is_object()) return fail("gpsd_malformed", "gpsd said a line that is no JSON object");
  const auto kind = json.find("class");
  if (kind == json.end() || !kind->is_string()) {
    return fail("gpsd_malformed", "gpsd said an object without its class");
  }
  if (kind->get<std::string>() != "TPV") return std::nullopt;
  const auto latitude = number(json, "lat"), longitude = number(json, "lon");
  auto height = number(json, "altHAE");
  if (!height) height = number(json, "alt");
  if (number(json, "mode").value_or(0) < 3 || !latitude || !longitude || !height) {
    return fail("gpsd_no_fix", "gpsd has no fix in three dimensions");
  }
  if (!isMeasured(json) || (*latitude == 0.0 && *longitude == 0.0)) {
    return fail("gpsd_no_fix", "gpsd says a place that satellites did not give");
  }
  if (std::abs(*latitude) > 90.0 || std::abs(*longitude) > 180.0 || !isHeight(*height)) {
    return fail("gpsd_malformed", "gpsd said a place that is not on Earth");
  }
  GnssFix fix;
  fix.time_ns = time_ns;
  fix.latitude_deg = *latitude;
  fix.longitude_deg = *longitude;
  fix.height_m = *height;
  const double eph = number(json, "eph").value_or(0.0);
  fix.sigma_m = eph > 0.0 ? eph / kSigmasOfEph : kUnstated_m;
  fix.speed = number(json, "speed");
  const auto track = number(json, "track");
  if (track && *track >= 0.0 && *track <= 360.0) fix.course = courseOf(*track);
  return fix;
}

}  // namespace perdure::capture
