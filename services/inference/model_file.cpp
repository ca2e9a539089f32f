#include "services/inference/model_file.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <optional>
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
    const char* why = fs::is_directory(path, error) ? " is a folder; " : " is missing; ";
    throw StartupError(ExitCode::kUnavailable, what + " " + path.string() + why + fix);
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

constexpr char kCoreMl[] =
    "is a network of Core ML; export the network as ONNX from where it was trained";
constexpr char kSavedModel[] =
    "is a SavedModel of TensorFlow; export it as ONNX (python -m tf2onnx.convert --saved-model)";

/// The start of a field of protobuf: its length, and the first byte of its contents.
struct Field {
  std::size_t length = 0;
  unsigned char first = 0;
};
std::optional<Field> fieldAt(std::string_view bytes, std::size_t at) {
  Field field;
  for (int shift = 0; at + 1 < bytes.size() && shift < 63; ++at, shift += 7) {
    const auto byte = static_cast<unsigned char>(bytes[at]);
    field.length |= static_cast<std::size_t>(byte & 0x7fU) << shift;
    if ((byte & 0x80U) != 0) continue;
    field.first = static_cast<unsigned char>(bytes[at + 1]);
    return field;
  }
  return std::nullopt;
}

/// Core ML's .mlmodel and TensorFlow's saved_model.pb begin with a version and a message. ONNX
/// begins with a version and the name of the program that wrote the file, which is text.
std::string whyOtherMessage(std::string_view bytes) {
  if (bytes.size() < 4 || bytes[0] != '\x08' || bytes[2] != '\x12') return {};
  const auto field = fieldAt(bytes, 3);
  const bool text = !field || (field->first >= ' ' && field->first < 0x80) || field->first >= 0xc2;
  if (text || field->length == 0) return {};
  return 2 * field->length > bytes.size() ? kSavedModel : kCoreMl;
}

/// TensorFlow's graph begins with a message, Caffe's network with its name.
std::string whyGraph(std::string_view bytes) {
  const auto field = fieldAt(bytes, 1);
  if (field && field->first != '\n') return "is a network of Caffe; export it as ONNX";
  return "is a graph of TensorFlow (.pb); export it as ONNX (python -m tf2onnx.convert "
         "--graphdef)";
}

struct Magic {
  std::size_t at;
  std::string_view bytes;
  const char* why;
};
constexpr std::array kMagics{
    Magic{4, "TFL3",
          "is a network of TensorFlow Lite; export it as ONNX (python -m tf2onnx.convert "
          "--tflite)"},
    Magic{4, "ORTM", "is in ONNX Runtime's own format (.ort); give the .onnx it was made of"},
    Magic{4, "ET12", "is a network of ExecuTorch; export the network as ONNX"},
    Magic{4, "{\"", "is an engine of TensorRT, for one kind of GPU; export the network as ONNX"},
    Magic{0, "ftrt", "is an engine of TensorRT, for one kind of GPU; export the network as ONNX"},
    Magic{0, "RKNN", "is compiled for Rockchip's accelerators; export the network as ONNX"},
    Magic{0, "\x01HEF", "is compiled for Hailo's accelerators; export the network as ONNX"},
    Magic{0, "PK\x03\x04",
          "is a ZIP archive, as PyTorch's .pt and Keras' .keras; export the network as ONNX, or "
          "unpack the archive"},
    Magic{0, "\x80\x02", "is a pickle of Python, as PyTorch's .pt; export the network as ONNX"},
    Magic{0, "\x1f\x8b", "is compressed; unpack it"},
    Magic{0, "\x28\xb5\x2f\xfd", "is compressed; unpack it"},
    Magic{0, "<?xml", "is XML, as OpenVINO's; export the network as ONNX"},
    Magic{0, "\x89HDF", "is HDF5, as Keras' .h5; export the network as ONNX"},
    Magic{8, "{\"",
          "is a file of weights (safetensors), without the network; export the network as ONNX"},
    Magic{257, "ustar", "is a tar archive; unpack it"},
    Magic{0, "7767517", "is a network of ncnn; export it as ONNX"},
    Magic{0, "version https://git-lfs",
          "is a pointer of Git LFS, not the network; run `git lfs pull` in its repository"}};

}  // namespace

std::string whyFolderIsNoNetwork(const fs::path& folder) {
  const auto holds = [&](const char* name) {
    std::error_code error;
    return fs::exists(folder / name, error);
  };
  const std::string ending = folder.extension().string();
  if (ending == ".mlpackage" || ending == ".mlmodelc" || holds("Manifest.json")) return kCoreMl;
  if (holds("saved_model.pb") || holds("saved_model.pbtxt")) return kSavedModel;
  return "is a folder, not a network; give the network's .onnx or .cfg";
}

std::string whyNoNetwork(std::string_view bytes) {
  const auto begins = bytes.substr(0, 512);
  const auto text = begins.substr(std::min(begins.find_first_not_of(" \t\r\n"), begins.size()));
  for (const Magic& magic : kMagics) {
    if (begins.size() >= magic.at && begins.substr(magic.at).starts_with(magic.bytes)) {
      return magic.why;
    }
  }
  if (text.starts_with("<!") || text.starts_with("<html") || text.starts_with("<HTML")) {
    return "is a page in HTML; fetch the file itself (the address of the raw file)";
  }
  if (auto why = whyOtherMessage(bytes); !why.empty()) return why;
  if (begins.size() == 512 && begins.find_first_not_of('\0') == begins.npos) {
    return "begins with zeros only: it was not copied whole; fetch it again";
  }
  const auto isPrinted = [](unsigned char c) {
    return c >= ' ' || c == '\n' || c == '\r' || c == '\t';
  };
  const bool printed = std::ranges::all_of(begins, isPrinted);
  if (!printed && begins.starts_with('\n')) return whyGraph(bytes);  // ONNX begins otherwise
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
  if (std::error_code missing; fs::is_directory(model, missing)) {
    throw StartupError(ExitCode::kUnavailable, "The network {} {}", path,
                       whyFolderIsNoNetwork(model));
  }
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
