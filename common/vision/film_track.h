// Tracks of data inside of a film, such as the telemetry of action cameras.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/time.h"

namespace perdure::vision {

struct FilmPacket {
  Duration start;  ///< since the first frame of the film
  std::string bytes;
};

/// Whether the film has a track of data with this four-character code.
bool hasFilmTrack(const std::filesystem::path& file, const std::string& code);
/// Reads the packets of that track, in the order of the file. Reasons: film_unreadable (no film, or
/// not finished), film_no_track.
Result<std::vector<FilmPacket>> readFilmTrack(const std::filesystem::path& file,
                                              const std::string& code);

}  // namespace perdure::vision
