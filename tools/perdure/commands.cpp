#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

constexpr CommandEntry kCommands[] = {
    {"pipeline", "Run the services' nodes in one process over a dataset, repeatably"},
    {"evaluate", "Compare results with truth"},
    {"detect", "Write a network's detections of a dataset to a CSV that --detections reads"},
    {"model", "Bring a detector of your own: make it ready, and see what it sees"},
    {"inference", "inference processes while they run"},
    {"simulate", "Render a camera and IMU sequence with exact truth, in EuRoC's folder layout"},
    {"calibrate", "Lens, place and time offset of a camera on an IMU, from a recording of a board"},
    {"map", "What the map holds: over DDS, or from its file"},
    {"mcp", "Answer questions about a map by the Model Context Protocol, on standard input"},
    {"demo", "The five services under supervision over a drive; deploy/demo builds and calls it"},
    {"record", "record topics into MCAP files"},
    {"play", "play a recording onto the bus"},
    {"security", "identities for a bus that is closed to strangers (DDS-Security)"},
    {"topics", "list all topics, and who writes and reads them now"},
    {"hz", "measure the rate of a topic, once a second"},
    {"echo", "print a topic's messages as JSON lines"},
    {"env", "print the DDS configuration as shell variables: eval \"$(perdure env)\""},
    {"doctor", "check host, bus and services: a line each with OK, WARN or FAIL and the fix"},
    {"status", "services, sensors, topics and the host as one tree; the worst state dominates"},
};

}  // namespace

std::span<const CommandEntry> commands() { return kCommands; }

std::filesystem::path programFolder() {
  const auto prefix =
      std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path().parent_path();
  return prefix / "bin";
}

}  // namespace perdure::tools
