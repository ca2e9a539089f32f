#include "services/inference/model_file.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/base/files/text_mode.h"
#include "common/base/ids.h"

namespace perdure::inference {
namespace {

namespace fs = std::filesystem;

std::string readBytes(const fs::path& path, const std::string& what, const std::string& fix) {
  if (const auto why = whyUnreadable(path); !why.empty()) {
    throw StartupError(ExitCode::kUnavailable, why);
  }
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    const std::string why =
        fs::is_directory(path, error) ? whyFolderIsNoNetwork(path) + "; " : "is missing; ";
    throw StartupError(ExitCode::kUnavailable, what + " " + path.string() + " " + why + fix);
  }
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (!in || bytes.str().empty()) {
    throw StartupError(ExitCode::kUnavailable,
                       what + " " + path.string() + " is empty or cannot be read; " + fix);
  }
  return std::move(bytes).str();
}

std::string listOf(const std::vector<fs::path>& paths) {
  std::string text;
  for (const fs::path& p : paths) text += (text.empty() ? "" : ", ") + p.string();
  return text;
}

/// Core ML's .mlmodel begins with a version, as ONNX does. Its second field is a message that
/// begins with a field of its own; that of ONNX is the name of the program that wrote the file.
bool isCoreMl(std::string_view begins) {
  constexpr std::size_t kLength = 3;  // place of the second field's length
  if (begins.size() <= kLength || begins[0] != '\x08' || begins[2] != '\x12') return false;
  std::size_t at = kLength;
  while (at < begins.size() && (static_cast<unsigned char>(begins[at]) & 0x80U) != 0) ++at;
  return at + 1 < begins.size() && (begins[at + 1] == '\x0a' || begins[at + 1] == '\x52');
}

}  // namespace

std::string whyFolderIsNoNetwork(const fs::path& folder) {
  std::error_code error;
  if (folder.extension() == ".mlpackage" || folder.extension() == ".mlmodelc") {
    return "is a network of Core ML; export the network as ONNX from where it was trained";
  }
  if (fs::exists(folder / "saved_model.pb", error)) {
    return "is a SavedModel of TensorFlow; export it as ONNX (python -m tf2onnx.convert "
           "--saved-model)";
  }
  return "is a folder";
}

std::string whyNoNetwork(std::string_view bytes) {
  const auto begins = bytes.substr(0, 512);
  const auto text = begins.substr(std::min(begins.find_first_not_of(" \t\r\n"), begins.size()));
  if (begins.starts_with("version https://git-lfs")) {
    return "is a pointer of Git LFS, not the network; run `git lfs pull` in its repository";
  }
  if (text.starts_with("<!") || text.starts_with("<html") || text.starts_with("<HTML")) {
    return "is a page in HTML; fetch the file itself (the address of the raw file)";
  }
  if (begins.substr(std::min<std::size_t>(4, begins.size())).starts_with("TFL3")) {
    return "is a network of TensorFlow Lite; export it as ONNX (python -m tf2onnx.convert "
           "--tflite)";
  }
  if (isCoreMl(begins)) {
    return "is a network of Core ML; export the network as ONNX from where it was trained";
  }
  if (begins.starts_with("PK\x03\x04")) {
    return "is a ZIP archive, as PyTorch's .pt; unpack it, or export the network as ONNX";
  }
  if (begins.starts_with("\x1f\x8b") || begins.starts_with("\x28\xb5\x2f\xfd")) {
    return "is compressed; unpack it";
  }
  if (begins.starts_with("<?xml")) return "is XML, as OpenVINO's; export the network as ONNX";
  if (begins.starts_with("\x89HDF")) return "is HDF5, as Keras' .h5; export the network as ONNX";
  if (begins.starts_with("ftrt")) {
    return "is an engine of TensorRT, for one kind of GPU; export the network as ONNX";
  }
  constexpr std::size_t kJson = 8, kTar = 257;  // places of their first characters
  if (begins.size() > kJson && begins.substr(kJson).starts_with("{\"")) {
    return "is a file of weights (safetensors), without the network; export the network as ONNX";
  }
  if (begins.size() > kTar && begins.substr(kTar).starts_with("ustar")) {
    return "is a tar archive; unpack it";
  }
  if (begins.starts_with("7767517")) return "is a network of ncnn; export it as ONNX";
  if (begins.size() == 512 && begins.find_first_not_of('\0') == begins.npos) {
    return "begins with zeros only: it was not copied whole; fetch it again";
  }
  const auto isPrinted = [](unsigned char c) {
    return c >= ' ' || c == '\n' || c == '\r' || c == '\t';
  };
  const bool printed = std::ranges::all_of(begins, isPrinted);
  if (!printed && begins.starts_with('\n')) {  // ONNX begins with another field
    return "is a graph of TensorFlow (.pb); export it as ONNX (python -m tf2onnx.convert "
           "--graphdef)";
  }
  if (!printed && wasCopiedAsText(bytes)) return kCopiedAsText;
  if (!text.empty() && printed && text[0] != '[' && text[0] != '#' && text[0] != ';') {
    return "is a text that begins with `" +
           std::string(text.substr(0, text.find('\n')).substr(0, 60)) + "`; fetch the file itself";
  }
  return {};
}

std::vector<std::string> standardModelFolders() {
  std::vector<std::string> folders = {"config/models"};
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  fs::path folder = program.parent_path();
  for (int up = 0; up < 5 && folder.has_relative_path(); ++up, folder = folder.parent_path()) {
    for (const char* there : {"config/models", "share/perdure/models"}) {
      if (fs::is_directory(folder / there, error)) folders.push_back((folder / there).string());
    }
  }
  return folders;
}

std::string findDescription(const std::string& path, const std::vector<std::string>& folders) {
  const fs::path model = path;
  std::vector<fs::path> candidates = {model.string() + ".model.json",
                                      model.parent_path() / "model.json"};
  for (const std::string& folder : folders) {
    candidates.push_back(fs::path(folder) / (model.stem().string() + ".json"));
  }
  std::error_code error;
  for (const fs::path& candidate : candidates) {
    if (fs::is_regular_file(candidate, error)) return candidate.string();
  }
  throw StartupError(ExitCode::kUnavailable,
                     "Nothing describes the network " + model.string() + ": looked for " +
                         listOf(candidates) +
                         "; let `perdure model import` make one, write it "
                         "(services/inference/model_json.md) or name it with "
                         "--set model.description=FILE.");
}

ModelFile readModelFile(const std::string& path, const std::string& description,
                        const std::vector<std::string>& folders) {
  if (path.empty()) {
    throw StartupError(
        ExitCode::kConfiguration,
        "No network is configured; set model.path to an .onnx or Darknet .cfg file.");
  }
  const fs::path model = path;
  ModelFile file;
  file.network = readBytes(model, "The network", "set model.path to an .onnx or .cfg file.");
  if (const auto why = whyNoNetwork(file.network); !why.empty()) {
    throw StartupError(ExitCode::kConfiguration, "{} {}", model.string(), why);
  }
  if (model.extension() == ".cfg") {
    file.darknet_weights = readBytes(fs::path(model).replace_extension(".weights"), "The weights",
                                     "put them beside their .cfg file.");
  }
  const fs::path described = description.empty() ? findDescription(path, folders) : description;
  const std::string text =
      readBytes(described, "The description", "set model.description to a model.json.");
  file.description = parseModelDescription(text, described.string());
  const std::string sum = toHex(digest(file.network + file.darknet_weights));
  if (!file.description.digest.empty() && file.description.digest != sum) {
    throw StartupError(ExitCode::kConfiguration,
                       "{} is not the network that {} describes: its digest is {}, not {}. It was "
                       "damaged or replaced; copy it again, or import it again",
                       model.string(), described.string(), sum, file.description.digest);
  }
  if (file.description.name.empty()) file.description.name = model.stem().string();
  std::string all = file.network + file.darknet_weights + text;
  for (const std::string& name : file.description.classes) all += "\n" + name;
  file.hash = digest(all);
  return file;
}

}  // namespace perdure::inference
