// Reads sentences of NMEA 0183: RMC, VTG, GGA and GST of any talker. Source: NMEA 0183 4.10 as
// described by receiver manufacturers (u-blox M8 protocol, 31).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "services/capture/vehicle/gnss_fix.h"

namespace perdure::capture {

/// Collects the content of sentences. Single-threaded.
class NmeaReader {
 public:
  struct Said {
    std::optional<double> speed;  ///< m/s over ground, from RMC; from VTG if there is no RMC
    std::optional<GnssFix> fix;   ///< set once RMC and GGA with the same time have arrived
  };
  /// Reads one line, with or without its line end. Sentences of other kinds give an empty result.
  /// Fails with "nmea_malformed" (not a sentence), "nmea_checksum", or "nmea_no_fix" (the sentence
  /// reports no fix). The fix has the time of its last sentence.
  Result<Said> read(std::string_view line, std::int64_t time_ns);

 private:
  Result<Said> readRmc(std::string_view sentence, std::int64_t time_ns);
  Result<Said> readVtg(std::string_view sentence, std::int64_t time_ns);
  Result<Said> readGga(std::string_view sentence, std::int64_t time_ns);
  void readGst(std::string_view sentence);
  Said whole(std::int64_t time_ns);

  std::string rmc_utc_, gga_utc_;
  std::int64_t rmc_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  ///< time of the last RMC
  std::optional<double> speed_, course_;
  GnssFix place_;
  std::optional<double> stated_sigma_m_;  ///< sigma of the last GST
};

}  // namespace perdure::capture
