// Reports of gpsd, one JSON object a line. Source: gpsd_json(5), protocol 3.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/result.h"
#include "services/capture/vehicle/gnss_fix.h"

namespace perdure::capture {

/// What is sent once, after which gpsd reports by itself.
inline constexpr std::string_view kGpsdWatch = "?WATCH={\"enable\":true,\"json\":true};\n";

/// A fix of a TPV report; nothing of other reports. Its height is altHAE, or (before protocol 3.14)
/// alt. Reasons: "gpsd_malformed"; "gpsd_no_fix": gpsd says that there is none in three dimensions.
Result<std::optional<GnssFix>> readGpsd(std::string_view line, std::int64_t time_ns);

}  // namespace perdure::capture
