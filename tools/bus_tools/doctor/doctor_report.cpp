
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "common/base/errors.h"
#include "common/base/subprocess.h"
#include "common/vision/image.h"
#include "common/vision/jpeg.h"
#include "common/wire/json.h"
#include "tools/base/files.h"
#include "tools/bus_tools/common.h"
#include "tools/bus_tools/doctor/doctor.h"
#include "tools/bus_tools/status/status_watch.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

/// Appends the output of each command under its own heading.
void writeAnswers(const fs::path& file, std::initializer_list<const char*> commands) {
  for (const char* command : commands) {
    std::ofstream(file, std::ios::app) << "\n$ " << command << '\n'
                                       << runProgram({.command = {"sh", "-c", command}}).output;
  }
}

void writeHost(const fs::path& folder) {
  writeAnswers(folder / "versions.txt",
               {"cat /etc/os-release", "uname -a",
                "dpkg-query -W 'perdure*' 'cyclonedds*' 'libddsc*' 'iceoryx*' 'libopencv-dnn*' "
                "'libceres*' 'libcamera*' 'libiio*'"});
  writeAnswers(folder / "host.txt",
               {"uptime", "nproc", "free -m", "df -h", "ip -brief address", "ip -s link",
                "sysctl net.core.rmem_max net.core.rmem_default", "cat /proc/net/snmp",
                "ls /dev/video* /dev/media* /dev/iio* /tmp/roudi /dev/shm",
                "ps -eo pid,cls,rtprio,psr,pcpu,rss,etime,args --sort=-pcpu | head -n 40"});
  writeAnswers(folder / "journal.txt",
               {"systemctl status --no-pager 'perdure*' iox-roudi",
                "journalctl --no-pager -o short-precise -n 5000 -u 'perdure-*' -u iox-roudi"});
}

/// Copies only settings, because the folder may also contain the keys of bus.security.
void copyConfiguration(const std::string& from, const fs::path& to) {
  std::error_code ignored;
  if (from.empty()) return;
  for (const auto& entry : fs::recursive_directory_iterator(
           from, fs::directory_options::skip_permission_denied, ignored)) {
    const auto kind = entry.path().extension();
    if (kind != ".yaml" && kind != ".toml") continue;
    const fs::path copy = to / fs::relative(entry.path(), from, ignored);
    fs::create_directories(copy.parent_path(), ignored);
    fs::copy_file(entry.path(), copy, ignored);
  }
}

/// Writes one image of each camera as PGM or PPM, if they arrive within two seconds.
void writeImages(const bus::Options& options, const StatusSeen& seen, const fs::path& folder) {
  if (!seen.calibration) return;
  for (const CameraCalibration& camera : seen.calibration->cameras) {
    const bus::Domain domain(options);
    const bus::Participant participant(domain, "perdure doctor");
    bus::WaitLoop loop(participant);
    bus::Reader<Frame> reader(participant, bus::frameTopic(camera.name));
    loop.on(reader, [&](const Frame& compressed) {
      const auto pixels = vision::decompressed(compressed);
      if (!pixels) return;
      const auto image = vision::viewOf(*pixels);
      if (!image) return;
      cv::imwrite(folder / (camera.name + (image->channels() == 1 ? ".pgm" : ".ppm")), *image);
      loop.stop();
    });
    runLoop(loop, 2.0);
  }
}

/// Writes each Health message on one line as it arrives, and finally the status.
StatusSeen writeBus(const ReportOptions& options, const fs::path& folder) {
  std::ofstream health(folder / "health.jsonl");
  StatusWatch watch(options.bus);
  watch.onHealth([&](const Health& h) { health << dumped(wire::toJson(h)) << '\n'; });
  runLoop(watch.loop(), options.seconds);
  StatusSeen seen = watch.seen();
  seen.host = lookAtHost({"/"}, options.bus);
  const StatusNode status = judge(seen);
  std::ofstream(folder / "status.txt") << toText(status, false);
  std::ofstream(folder / "status.json") << dumped(toJson(status), 2) << '\n';
  return seen;
}

}  // namespace

void writeReport(const ReportOptions& options, const Findings& findings) {
  const fs::path place = fs::temp_directory_path();
  const TemporaryFolder workshop(place / "perdure-report-", [&](const std::string&) {
    throw StartupError(ExitCode::kUnavailable, "no folder can be made in " + place.string() +
                                                   "; set TMPDIR to one that can be written");
  });
  const fs::path folder = workshop.path() / "perdure-report";
  fs::create_directories(folder);
  std::ofstream(folder / "doctor.txt") << toText(findings);
  writeHost(folder);
  copyConfiguration(options.configuration, folder / "configuration");
  const StatusSeen seen = writeBus(options, folder);
  if (options.images) writeImages(options.bus, seen, folder);
  const fs::path file = fs::absolute(options.file);
  const auto packed = runProgram({.command = {"tar", "-C", workshop.path().string(), "-czf",
                                              file.string(), "perdure-report"}});
  if (packed.status != 0) {
    throw StartupError(ExitCode::kUnavailable, file.string() +
                                                   " cannot be written; give --report a file in a "
                                                   "folder that can be");
  }
}

}  // namespace perdure::tools
