#include "tools/model/known.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "services/inference/model_file.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

fs::path ownList() {
  std::error_code error;
  for (const std::string& folder : inference::standardModelFolders()) {
    const fs::path list = fs::path(folder) / "known/networks.json";
    if (fs::is_regular_file(list, error)) return list;
  }
  throw StartupError(ExitCode::kUnavailable,
                     "config/models/known/networks.json is missing; it belongs into the source "
                     "tree, or into share/perdure/models/known of the installation");
}

KnownFile fileOf(const Json& json) {
  if (!json.at("bytes").is_number_unsigned()) {
    throw std::invalid_argument("\"bytes\" of a file is no whole number from 0 on");
  }
  KnownFile file{json.at("name"), json.at("url"),
                 replay::toLower(json.at("sha256").get<std::string>()), json.at("bytes")};
  const bool plain = !file.name.empty() && file.name.find('/') == std::string::npos;
  if (!plain || file.name.front() == '.' || file.sha256.size() != 64) {
    throw std::invalid_argument("a file has no plain name, or no sha256 of 64 digits");
  }
  return file;
}

KnownUse useOf(const std::string& name, const Json& json) {
  return {name, json.at("classes").get<std::vector<std::string>>(),
          json.value("calibration", Json()), json.value("measured", "")};
}

KnownNetwork networkOf(const Json& json) {
  KnownNetwork network{json.at("name"),
                       json.at("maker"),
                       json.at("licence"),
                       json.at("family"),
                       json.at("source"),
                       json.at("input"),
                       json.at("classes_file"),
                       json.value("accuracy", ""),
                       {},  // files and uses are set below
                       {},
                       json.value("keys", Json::object())};
  for (const Json& file : json.at("files")) network.files.push_back(fileOf(file));
  for (const auto& [name, use] : json.at("uses").items()) {
    network.uses.push_back(useOf(name, use));
  }
  if (network.files.empty()) throw std::invalid_argument(network.name + " has no files");
  return network;
}

}  // namespace

std::vector<KnownNetwork> knownNetworks(const fs::path& list) {
  const fs::path path = list.empty() ? ownList() : list;
  std::ifstream in(path);
  if (!in) {
    throw StartupError(ExitCode::kUnavailable,
                       path.string() + " cannot be read; give --list FILE, or leave it out");
  }
  try {
    std::vector<KnownNetwork> networks;
    const Json json = Json::parse(in);
    for (const Json& one : json.at("networks")) networks.push_back(networkOf(one));
    return networks;
  } catch (const std::exception& e) {
    throw StartupError(ExitCode::kConfiguration,
                       path.string() + " is no list of networks: " + e.what() +
                           "; compare it with config/models/known/networks.json");
  }
}

std::string sha256Of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw StartupError(ExitCode::kUnavailable, file.string() + " cannot be read; is it yours?");
  }
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(),
                                                                        &EVP_MD_CTX_free);
  EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr);
  std::array<char, 1 << 16> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    EVP_DigestUpdate(context.get(), block.data(), static_cast<std::size_t>(in.gcount()));
  }
  std::array<unsigned char, 32> sum{};
  EVP_DigestFinal_ex(context.get(), sum.data(), nullptr);
  return fmt::format("{:02x}", fmt::join(sum, ""));
}

std::string describe(const KnownNetwork& network) {
  std::uint64_t bytes = 0;
  for (const KnownFile& file : network.files) bytes += file.bytes;
  std::string text = fmt::format("{}\n  {}, by {}; {}; input {}; {:.1f} MB\n  from      {}\n",
                                 network.name, network.family, network.maker, network.licence,
                                 network.input, static_cast<double>(bytes) / 1e6, network.source);
  for (const KnownFile& file : network.files) {
    text += fmt::format("  file      {}\n            sha256 {}\n", file.url, file.sha256);
  }
  if (!network.accuracy.empty()) text += fmt::format("  accuracy  {}\n", network.accuracy);
  for (const KnownUse& use : network.uses) {
    text += fmt::format("  {:<8}  {}\n", use.name, fmt::join(use.classes, ", "));
    text += use.calibration.is_null()
                ? "            not calibrated there: perdure model calibrate\n"
                : fmt::format("            calibration {} ({})\n", use.calibration.dump(),
                              use.measured);
  }
  return text;
}

}  // namespace perdure::tools
