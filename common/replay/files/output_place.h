// Where results may be written: never into what they are made of.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::replay {

/// Throws StartupError(kUsage) where `out` is the folder `data`, or lies in mav0 or another folder
/// of sensors in it, by links too. A folder of its own beside them may be. `option` begins the
/// sentence ("--out").
void refuseInside(const std::filesystem::path& out, const std::filesystem::path& data,
                  const std::string& option);

/// Throws StartupError(kUsage) where the file that is written is the recording that is read.
void refuseOverwriting(const std::filesystem::path& written, const std::filesystem::path& data,
                       const std::string& option);

}  // namespace perdure::replay
