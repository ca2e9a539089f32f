// The checks of `perdure doctor`: each is a line with its verdict and, where it fails, the mend.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/bus/domain.h"

namespace perdure::tools {

enum class Verdict { kOk, kWarn, kFail };

struct Finding {
  Verdict verdict = Verdict::kOk;
  std::string text;  ///< what was found; the mend where it is not well
};
using Findings = std::vector<Finding>;

/// "OK   vio is on the bus", a line each.
std::string toText(const Findings& findings);

/// Of the host: receive buffers, the interface, large datagrams over loopback, the clock.
Findings checkHost(const bus::Options& options);
/// Of RouDi, where images are to go through shared memory: it answers, and its largest chunk
/// (`roudi_toml`, where it can be read) holds an image of bus.shared_memory_mb. Else nothing.
Findings checkSharedMemory(const bus::Options& options, const std::string& roudi_toml);
/// Of the identities in bus.security that this user can read, and of an authority beside them.
Findings checkSecurity(const bus::Options& options);
/// Of a folder that a service must write to.
Finding checkWritable(const std::string& folder);
/// Of the bus: who is there, what each says of itself, what does not fit together.
Findings checkBus(const bus::Options& options, double seconds);

struct Drive {
  std::string data;
  std::string rig = {};       ///< a file in place of the recording's own calibration
  std::string sequence = {};  ///< of KITTI tracking, and of a 7-Scenes folder with several
  std::string poses = {};     ///< a file of another program's poses, looked at as well
};

/// A camera that hangs upside down is no fault where vio, which feels gravity, agrees.
void settleUpsideDown(bool vio_agrees, Findings& findings);
/// Of a recording: stamps, units, images, axes; and where these can be used at all, of its rig by
/// the innovations of vio over it, for so many seconds, or until the rig is surely good.
Findings checkRigBy(const Drive& drive, std::optional<double> seconds = {});

/// model.path of inference.yaml in the folder; empty where none is set.
std::string configuredNetwork(const std::string& folder);
/// Warns where a letterboxed network shows a third of its input no image of the recording's cam0.
/// Throws StartupError as the service does.
Findings checkNetworkShape(const Drive& drive, const std::string& network);

/// Writes a copy of a recording to `folder` with what is sure mended, and looks at it again. The
/// progress goes to standard error. Throws StartupError as writeDrive does.
Findings fixRecording(const Drive& given, const std::string& folder);

/// The largest bus.shared_memory_mb in the folder's files; 0 where none is set.
std::int64_t configuredSharedMemory(const std::string& folder);

struct ReportOptions {
  bus::Options bus;
  double seconds = 5.0;  ///< how long Health is written down
  std::string file;      ///< NAME.tar.gz
  std::string configuration;
  bool images = false;  ///< one of each camera
};
/// Packs what a maintainer asks for: versions, host, configuration, status, Health, journal.
/// Throws StartupError where the file cannot be written.
void writeReport(const ReportOptions& options, const Findings& findings);

}  // namespace perdure::tools
