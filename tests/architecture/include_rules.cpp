#include "tests/architecture/include_rules.h"

#include <algorithm>
#include <array>
#include <sstream>
#include <string_view>

namespace perdure::tests {
namespace {

/// Bottom to top: a folder uses only itself and those before it.
constexpr std::array kCommon{"base",   "math",   "types", "earth", "camera", "mapping", "sim",
                             "config", "vision", "wire",  "ros",   "bus",    "replay",  "service"};

/// Folders with layers of their own. Lists their sub-folders from bottom to top; "" is the folder
/// itself.
struct Layers {
  std::string_view folder;
  std::vector<std::string_view> bottom_to_top;
};
const std::vector<Layers> kLayers{
    {"common/wire/", {"description", ""}},
    {"common/bus/", {"security", "", "foreign"}},
    {"common/mapping/", {"frames", "graph", "places", "appearance", "", "fusion"}},
    {"common/replay/", {"files", "recordings", ""}},
    {"common/sim/scenes/", {"parts", ""}},
    {"services/capture/live/", {"", "libcamera", "cameras"}},
    {"services/semantic_filter/core/",
     {"belief", "measurement", "visibility", "association", "update", "smoothing", "tracks",
      "memory", "planning", ""}},
    {"services/vio/core/", {"state", "propagation", "tracks", "update", "", "start"}},
    {"services/gateway/", {"core", "protocol", "mcp", "web", ""}},
    {"services/inference/core/", {"", "network", "decode", "takeover"}},
    {"services/map_store/", {"core", "fleet", ""}},
    {"services/ros2/", {"core", ""}},
    {"tools/bus_tools/", {"", "status", "doctor"}},
    {"tools/calibrate/", {"estimate", "motion", ""}},
    {"tools/evaluate/", {"", "memory"}},
    {"tools/outputs/", {"frames", "pictures", "boxes", ""}},
    {"tools/simulate/", {"shapes", "render", ""}}};

std::string part(const std::string& path, std::size_t index) {
  std::istringstream stream(path);
  std::string word;
  for (std::size_t i = 0; i <= index; ++i) {
    if (!std::getline(stream, word, '/')) return {};
  }
  return word;
}

std::ptrdiff_t heightOf(const std::string& folder) {
  return std::find(kCommon.begin(), kCommon.end(), folder) - kCommon.begin();
}

/// Returns the index of a file's layer; an unlisted sub-folder is above all layers.
std::ptrdiff_t layerOf(const std::string& file, const Layers& layers) {
  const std::string rest = file.substr(layers.folder.size());
  const std::size_t slash = rest.find('/');
  const std::string sub = slash == std::string::npos ? "" : rest.substr(0, slash);
  const auto& order = layers.bottom_to_top;
  return std::find(order.begin(), order.end(), sub) - order.begin();
}

/// True for parameters.h files: plain numbers that every file may include. They include only each
/// other.
bool isParameters(const std::string& path) { return path.ends_with("/parameters.h"); }

bool pointsUp(const std::string& path, const std::string& include) {
  if (isParameters(include)) return false;
  return std::any_of(kLayers.begin(), kLayers.end(), [&](const Layers& layers) {
    return path.starts_with(layers.folder) && include.starts_with(layers.folder) &&
           layerOf(include, layers) > layerOf(path, layers);
  });
}

bool startsWith(const std::string& text, std::initializer_list<std::string_view> prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(),
                     [&](std::string_view prefix) { return text.starts_with(prefix); });
}

/// True for core/ and node.{h,cpp}, the pure part of a service.
bool isPure(const std::string& path) {
  return part(path, 0) == "services" &&
         (part(path, 2) == "core" || startsWith(part(path, 2), {"node.", "node_"}));
}

std::string whyNotIncluded(const std::string& path, const std::string& include) {
  const std::string room = part(path, 0), used = part(include, 0);
  // Only common/wire uses the functions by which Cyclone encodes messages.
  const bool encodes = path.starts_with("common/wire/") &&
                       startsWith(include, {"dds/ddsi/", "dds/ddsc/dds_opcodes.h"});
  if (include.starts_with("dds/") && !encodes &&
      !startsWith(path, {"common/bus/", "tools/examples/", "tests/"})) {
    return "only common/bus speaks DDS";
  }
  if (room != "tests" && used == "tests") return "nobody includes tests";
  if ((room == "common" || room == "services") && used == "tools") return "nobody includes tools";
  if (room == "common" && used == "services") return "common knows no service";
  if (room == "services" && used == "services" && part(path, 1) != part(include, 1)) {
    return "no service includes another";
  }
  if (room == "common" && used == "common" &&
      heightOf(part(include, 1)) > heightOf(part(path, 1))) {
    return "a folder of common uses only those below it";
  }
  if (isParameters(path) && include.find('/') != std::string::npos && !isParameters(include)) {
    return "parameters are plain numbers";
  }
  if (pointsUp(path, include)) return "a layer of a folder uses only those below it";
  if ((used == "idl" || used == "final") &&
      !startsWith(path, {"common/wire/", "tools/examples/", "tests/"})) {
    return "only common/wire knows the generated types";
  }
  if (!isPure(path)) return {};
  if (startsWith(include,
                 {"common/wire/", "common/bus/", "common/service/", "yaml-cpp/", "spdlog/"})) {
    return "core and node know no wire, bus, YAML or log";
  }
  if (startsWith(include, {"thread", "mutex", "condition_variable", "future", "iostream"})) {
    return "core and node have no threads and print nothing";
  }
  return {};
}

/// Returns the text between the quotes or angle brackets of an include line, or "".
std::string includeOf(const std::string& line) {
  constexpr std::string_view kDirective = "#include ";
  if (!line.starts_with(kDirective) || line.size() < kDirective.size() + 2) return {};
  const char close = line[kDirective.size()] == '<' ? '>' : '"';
  const std::size_t begin = kDirective.size() + 1, end = line.find(close, begin);
  return end == std::string::npos ? "" : line.substr(begin, end - begin);
}

}  // namespace

std::vector<std::string> violations(const std::string& path, const std::string& content) {
  std::vector<std::string> found;
  std::istringstream lines(content);
  std::string line;
  while (std::getline(lines, line)) {
    const std::string include = includeOf(line);
    const std::string why = include.empty() ? "" : whyNotIncluded(path, include);
    if (!why.empty()) found.push_back(path + " includes " + include + ": " + why);
    const bool reads_clock = line.find("_clock::now") != std::string::npos ||
                             line.find("clock_gettime") != std::string::npos;
    if (isPure(path) && reads_clock) {
      found.push_back(path + " reads a clock: time enters core and node by messages");
    }
  }
  return found;
}

}  // namespace perdure::tests
