// Sentences of NMEA 0183: RMC, VTG, GGA, GST of any talker. Source: NMEA 0183 4.10 as receivers'
// makers describe it (u-blox M8 protocol, 31).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "services/capture/vehicle/gnss_fix.h"

namespace perdure::capture {

/// What one sentence adds. Single-threaded.
class NmeaReader {
 public:
  struct Said {
    std::optional<double> speed;  ///< m/s over ground, of RMC, or of VTG where there is no RMC
    std::optional<GnssFix> fix;   ///< once RMC and GGA of one second's fraction have come
  };
  /// One line without or with its end. Sentences of other kinds say nothing. Reasons:
  /// "nmea_malformed" (no sentence), "nmea_checksum", "nmea_no_fix" (it says itself that it has
  /// none). The fix has the time of its last sentence.
  Result<Said> read(std::string_view line, std::int64_t time_ns);

 private:
  Result<Said> readRmc(std::string_view sentence, std::int64_t time_ns);
  Result<Said> readVtg(std::string_view sentence, std::int64_t time_ns);
  Result<Said> readGga(std::string_view sentence, std::int64_t time_ns);
  void readGst(std::string_view sentence);
  Said whole(std::int64_t time_ns);

  std::string rmc_utc_, gga_utc_;
  std::int64_t rmc_ns_ = std::numeric_limits<std::int64_t>::min() / 2;  ///< of the last RMC
  std::optional<double> speed_, course_;
  GnssFix place_;
  std::optional<double> stated_sigma_m_;  ///< of the last GST
};

}  // namespace perdure::capture
