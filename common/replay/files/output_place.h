// Checks of output locations, so that results never overwrite input data.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::replay {

/// Throws StartupError(kUsage) if `out` is the folder `data`, or lies in mav0 or another sensor
/// folder in it. Links are resolved. A separate folder beside the sensor folders is accepted. The
/// message begins with `option` ("--out").
void refuseInside(const std::filesystem::path& out, const std::filesystem::path& data,
                  const std::string& option);

/// Throws StartupError(kUsage) if the output file `written` is the input recording `data`.
void refuseOverwriting(const std::filesystem::path& written, const std::filesystem::path& data,
                       const std::string& option);

}  // namespace perdure::replay
