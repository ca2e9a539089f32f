// The checks of `perdure doctor`. Each finding is one line with a verdict and, on failure, the fix.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::tools {

enum class Verdict { kOk, kWarn, kFail };

struct Finding {
  Verdict verdict = Verdict::kOk;
  std::string text;  ///< result of the check; with the fix if the verdict is not OK
};
using Findings = std::vector<Finding>;

/// Formats each finding as one line, for example "OK   vio is on the bus".
std::string toText(const Findings& findings);

/// Checks the host: receive buffers, the interface, large datagrams over loopback, the clock.
Findings checkHost(const bus::Options& options);
/// If images are sent through shared memory, checks that RouDi responds and that its largest chunk
/// can hold bus.shared_memory_mb. The chunk size is checked if `roudi_toml` is readable. Returns no
/// findings without shared memory.
Findings checkSharedMemory(const bus::Options& options, const std::string& roudi_toml);
/// Checks the identities in the folder bus.security, and that no authority is stored there.
Findings checkSecurity(const bus::Options& options);
/// Checks that a service can write to the folder, and that its disk has free space.
Finding checkWritable(const std::string& folder);
/// Observes the bus for `seconds`, and checks the participants, the state that each reports, and
/// incompatible types.
Findings checkBus(const bus::Options& options, double seconds);

struct Drive {
  std::string data;
  std::string rig = {};       ///< calibration file that replaces the recording's own
  std::string sequence = {};  ///< of KITTI tracking, or of a 7-Scenes folder with several ones
  std::string poses = {};     ///< file with poses of another program, which is also checked
};

/// Changes the verdict on an upside-down camera to OK if vio agrees that it is mounted so.
void settleUpsideDown(bool vio_agrees, Findings& findings);
/// Checks the time stamps, units, images and axes of a recording. If these are usable, also checks
/// the rig by the innovations of vio over `seconds`; if empty, until the rig is certainly good.
Findings checkRigBy(const Drive& drive, std::optional<double> seconds = {});

/// Returns model.path of inference.yaml in the folder; empty if it is not set.
std::string configuredNetwork(const std::string& folder);
/// Warns if more than a third of a letterboxed network's input would be padding for images of cam0.
/// Throws StartupError if the network cannot be used, as the service does.
Findings checkNetworkShape(const Drive& drive, const std::string& network);

/// Writes a copy of a recording to `folder` with every certain fault fixed, and checks the copy.
/// Reports progress on standard error. Throws StartupError as writeDrive does.
Findings fixRecording(const Drive& given, const std::string& folder);

/// The largest bus.shared_memory_mb in the folder's files; 0 if none is set.
std::int64_t configuredSharedMemory(const std::string& folder);

struct ReportOptions {
  bus::Options bus;
  double seconds = 5.0;  ///< how long Health is recorded
  std::string file;      ///< NAME.tar.gz
  std::string configuration;
  bool images = false;  ///< include one image of each camera
};
/// Packs versions, host, configuration, status, Health and journal into a file. Throws StartupError
/// if it cannot be written.
void writeReport(const ReportOptions& options, const Findings& findings);

}  // namespace perdure::tools
