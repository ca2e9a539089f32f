// Reads reports of gpsd, one JSON object a line. Source: gpsd_json(5), protocol 3.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/result.h"
#include "services/capture/vehicle/gnss_fix.h"

namespace perdure::capture {

/// Request that is sent once; gpsd then sends reports without further requests.
inline constexpr std::string_view kGpsdWatch = "?WATCH={\"enable\":true,\"json\":true};\n";

/// Fix of a TPV report; empty for other reports. The height is altHAE, or alt before protocol 3.14.
/// Fails with "gpsd_malformed", or with "gpsd_no_fix" if gpsd reports no three-dimensional fix.
Result<std::optional<GnssFix>> readGpsd(std::string_view line, std::int64_t time_ns);

}  // namespace perdure::capture
