#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/base/subprocess.h"
#include "services/inference/model_file.h"
#include "tools/model/command.h"
#include "tools/model/importer.h"
#include "tools/model/known.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFetchHelp = R"(
Takes a known network from the address in the list with curl, checks its size and sha256, imports
it, and writes the calibration that was measured in a place of that kind, where the input has the
size it was measured at. What is there already, with the right sum, is not taken again: so a file
that was carried here by hand is imported too.

  perdure model list                                 the names, licences, sizes, sums, addresses
  perdure model fetch yolox-nano --for street        into ./networks
  perdure model fetch yolox-nano --input camera --image street.jpg      for a wide camera
  perdure model fetch yolox-nano --dry-run           says what it would do)";

struct FetchRequest {
  fs::path list, out = "networks", image;
  std::string name, use = "street", input;
  bool dry = false;
};

const KnownNetwork& networkNamed(const std::vector<KnownNetwork>& networks,
                                 const std::string& name) {
  std::vector<std::string> names;
  for (const KnownNetwork& network : networks) {
    if (network.name == name) return network;
    names.push_back(network.name);
  }
  throw StartupError(ExitCode::kUsage, fmt::format("{} is not a known network; known are {}", name,
                                                   fmt::join(names, ", ")));
}

const KnownUse& useNamed(const KnownNetwork& network, const std::string& name) {
  std::vector<std::string> names;
  for (const KnownUse& use : network.uses) {
    if (use.name == name) return use;
    names.push_back(use.name);
  }
  throw StartupError(ExitCode::kUsage, fmt::format("--for {}: {} has classes for {}", name,
                                                   network.name, fmt::join(names, ", ")));
}

/// Describes the difference between a file and the known one. Returns nothing if they are equal.
std::optional<std::string> difference(const fs::path& path, const KnownFile& file) {
  const auto bytes = fs::file_size(path);
  if (bytes != file.bytes) {
    return fmt::format("has {} bytes, and {} are known of it", bytes, file.bytes);
  }
  const std::string sum = sha256Of(path);
  if (sum == file.sha256) return std::nullopt;
  return fmt::format("has the sha256 {}, and {} is known of it", sum, file.sha256);
}

std::string byHand(const KnownFile& file, const fs::path& path) {
  return fmt::format("  curl -L -o {} {}\n  echo '{}  {}' | sha256sum -c", path.string(), file.url,
                     file.sha256, path.string());
}

[[noreturn]] void throwNotTaken(const KnownFile& file, const fs::path& path,
                                const std::string& why) {
  throw StartupError(ExitCode::kUnavailable,
                     "{} cannot be taken ({}). On a machine with a network do this, put the file "
                     "to {}, and give the same command again:\n{}",
                     file.url, why, path.string(), byHand(file, path));
}

void take(const KnownFile& file, const fs::path& path) {
  std::error_code error;
  if (fs::is_regular_file(path, error)) {
    if (const auto other = difference(path, file)) {
      throw StartupError(ExitCode::kData, fmt::format("{} {}; remove it, or give another --out",
                                                      path.string(), *other));
    }
    std::printf("there       %s\n", path.c_str());
    return;
  }
  if (!findProgram("curl")) throwNotTaken(file, path, "curl is missing: apt-get install curl");
  const fs::path part = path.string() + ".part";
  std::printf("takes       %s\n", file.url.c_str());
  std::fflush(stdout);
  const auto answer = runProgram(
      {.command = {"curl", "--fail", "--location", "--silent", "--show-error", "--proto",
                   "=https,http", "--connect-timeout", "10", "--speed-limit", "1000",
                   "--speed-time", "30", "--max-filesize", std::to_string(file.bytes + (1U << 20U)),
                   "--output", part.string(), "--", file.url}},
      std::chrono::minutes(30));
  if (answer.status != 0) {
    fs::remove(part, error);
    std::string why = answer.output.substr(0, answer.output.find('\n'));
    throwNotTaken(file, path, why.empty() ? fmt::format("curl: status {}", answer.status) : why);
  }
  if (const auto other = difference(part, file)) {
    fs::remove(part, error);
    throw StartupError(ExitCode::kData,
                       "what {} gives {}: it was changed there, or on the way; nothing was kept",
                       file.url, *other);
  }
  fs::rename(part, path);
  std::printf("checked     %s (%llu bytes, sha256 as known)\n", path.c_str(),
              static_cast<unsigned long long>(file.bytes));
}

/// Returns the file of class names in a folder of model descriptions.
fs::path classesOf(const KnownNetwork& network) {
  std::error_code error;
  for (const std::string& folder : inference::standardModelFolders()) {
    const fs::path file = fs::path(folder) / network.classes_file;
    if (fs::is_regular_file(file, error)) return fs::absolute(file).lexically_normal();
  }
  throw StartupError(ExitCode::kUnavailable,
                     network.classes_file + " is missing beside the descriptions of networks");
}

/// Copies the description of a Darknet network, which has no graph to import, beside the network.
fs::path describeDarknet(const fs::path& path) {
  const fs::path from =
      inference::findDescription(path.string(), inference::standardModelFolders());
  const fs::path to = path.string() + ".model.json";
  if (from == to) return to;
  std::ifstream in(from);
  auto json = nlohmann::ordered_json::parse(in);
  if (json.contains("classes_file")) {
    const fs::path names = from.parent_path() / json["classes_file"].get<std::string>();
    fs::copy_file(names, path.parent_path() / names.filename(),
                  fs::copy_options::overwrite_existing);
  }
  writeChecked(to, json.dump(1) + "\n");
  return to;
}

/// Returns the reason why the calibration cannot be used; an empty string if it can.
std::string whyUncalibrated(const nlohmann::ordered_json& description, const KnownNetwork& network,
                            const KnownUse& use, bool resized) {
  if (use.calibration.is_null()) return "no calibration was measured for " + use.name;
  if (!resized) return {};
  const auto& input = description.at("input");
  const std::string size =
      fmt::format("{}x{}", input.at("width").get<int>(), input.at("height").get<int>());
  if (size == network.input) return {};
  return fmt::format("the calibration was measured at {}, not at this size", network.input);
}

/// Adds the known keys and the calibration to the description. `resized` is true if --input was
/// given.
void calibrated(const fs::path& description, const KnownNetwork& network, const KnownUse& use,
                bool resized) {
  std::ifstream in(description);
  auto json = nlohmann::ordered_json::parse(in);
  in.close();
  for (const auto& [key, value] : network.keys.items()) json[key] = value;
  if (const std::string why = whyUncalibrated(json, network, use, resized); !why.empty()) {
    writeChecked(description, json.dump(1) + "\n");
    std::printf("note        %s: perdure model calibrate\n", why.c_str());
    return;
  }
  for (const auto& [key, value] : use.calibration.items()) json["calibration"][key] = value;
  writeChecked(description, json.dump(1) + "\n");
  std::printf("calibrated  %s (%s)\n", use.calibration.dump().c_str(), use.measured.c_str());
}

/// Returns the arguments of the import: the network's known properties, and the user's options.
std::vector<std::string> importArguments(const KnownNetwork& network, const std::string& input) {
  std::vector<std::string> arguments = {"--classes=" + classesOf(network).string(),
                                        "--family=" + network.family};
  if (!input.empty()) arguments.push_back("--input=" + input);
  return arguments;
}

void sayOnly(const KnownNetwork& network, const FetchRequest& request) {
  std::printf("%s", describe(network).c_str());
  std::printf("would make the folder %s and do this:\n", request.out.c_str());
  for (const KnownFile& file : network.files) {
    std::printf("%s\n", byHand(file, request.out / file.name).c_str());
  }
  const fs::path path = request.out / network.files.front().name;
  if (path.extension() != ".onnx") {
    std::printf("  write its description, %s.model.json\n", path.c_str());
    return;
  }
  auto arguments = importArguments(network, request.input);
  if (!request.image.empty()) arguments.push_back("--image=" + request.image.string());
  std::printf("  perdure model import %s %s\n", path.c_str(),
              fmt::format("{}", fmt::join(arguments, " ")).c_str());
}

void fetch(const FetchRequest& request) {
  const auto networks = knownNetworks(request.list);
  const KnownNetwork& network = networkNamed(networks, request.name);
  const KnownUse& use = useNamed(network, request.use);
  const bool onnx = fs::path(network.files.front().name).extension() == ".onnx";
  if (!onnx && !request.input.empty()) {
    throw StartupError(ExitCode::kUsage, network.name +
                                             " is a Darknet network, of the size of its "
                                             ".cfg; leave --input out");
  }
  if (request.dry) return sayOnly(network, request);
  std::error_code error;
  fs::create_directories(request.out, error);
  if (error) {
    throw StartupError(ExitCode::kUnavailable, request.out.string() + " cannot be made (" +
                                                   error.message() + "); give another --out");
  }
  for (const KnownFile& file : network.files) take(file, request.out / file.name);
  fs::path path = request.out / network.files.front().name;
  fs::path description;
  if (onnx) {
    ImportOptions options{.network = path, .out = {}, .image = request.image};
    options.arguments = importArguments(network, request.input);
    importAndLook(options);
    path = importedPath(path, "");
    description = path.string() + ".model.json";
  } else {
    description = describeDarknet(path);
  }
  calibrated(description, network, use, !request.input.empty());
  std::printf("use it      perdure-inference --set model.path=%s --set 'detection.classes=[%s]'\n",
              path.c_str(), fmt::format("{}", fmt::join(use.classes, ", ")).c_str());
}

}  // namespace

void addFetch(CLI::App& model) {
  const auto request = std::make_shared<FetchRequest>();
  CLI::App* list = model.add_subcommand("list", "Networks that are known to work");
  list->add_option("--list", request->list, "another list than the program's own")
      ->type_name("FILE");
  list->callback([request] {
    for (const KnownNetwork& network : knownNetworks(request->list)) {
      std::printf("%s", describe(network).c_str());
    }
    std::printf("perdure model fetch NAME takes one from there, checks it and makes it ready\n");
  });
  CLI::App* command = model.add_subcommand("fetch", "Take a known network, and make it ready");
  command->footer(kFetchHelp);
  command->add_option("name", request->name, "of `perdure model list`")->required();
  command->add_option("--for", request->use, "street or room: the classes, and the calibration")
      ->capture_default_str();
  command->add_option("--out", request->out, "the folder")->capture_default_str();
  command->add_option("--input", request->input, "as of `perdure model import`")
      ->type_name("WxH|camera");
  command->add_option("--image", request->image, "a picture to look at")->type_name("FILE");
  command->add_option("--list", request->list, "another list than the program's own")
      ->type_name("FILE");
  command->add_flag("--dry-run", request->dry, "say what would be done");
  command->callback([request] { fetch(*request); });
}

}  // namespace perdure::tools
