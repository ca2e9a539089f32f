#include "tools/model/command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/base/ids.h"
#include "tools/model/check.h"
#include "tools/model/importer.h"
#include "tools/model/look.h"
#include "tools/model/staging.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kImportHelp = R"(
Looks at the graph, finds the family, cuts off what follows the raw heads (decoding, sigmoids,
suppression), repairs what OpenCV 4.6 cannot load or computes wrongly, compares OpenCV's answers
with what the file says, and looks at a picture. Writes

  NAME.perdure.onnx               the network, for OpenCV 4.6
  NAME.perdure.onnx.model.json    what its numbers mean (services/inference/model_json.md)
  NAME.perdure.png                what it sees

  perdure model import yolov8n.onnx --image street.jpg        names are in the file
  perdure model import net.onnx --classes car,person          names in the network's order
  perdure model import net.onnx --classes coco.names --family yolov7 --size 640x640
  perdure model import yolov8n.onnx --input camera --image street.jpg   wide cameras: a wide input
  perdure-inference --set model.path=yolov8n.perdure.onnx     then run it

Look at the picture: colours, mean and scale of the input are the usual ones of the family, and
boxes that are a little off say that they are other ones here.)";

void showSights(const fs::path& network, const fs::path& image, double threshold,
                const fs::path& drawing) {
  std::optional<Frame> frame;
  if (!image.empty()) frame = readPicture(image);
  const Look look = lookAt(network, frame ? &*frame : nullptr, threshold);
  std::printf("sees        %zu boxes of score %.2f and more in %s\n", look.sights.size(), threshold,
              frame ? image.c_str() : "a grey ramp, which holds nothing: give --image");
  for (std::size_t i = 0; i < look.sights.size() && i < 10; ++i) {
    const Sight& s = look.sights[i];
    std::printf("            %.2f %-14s %6.0f %6.0f %6.0f %6.0f\n", s.score, s.name.c_str(),
                s.box.x1, s.box.y1, s.box.x2, s.box.y2);
  }
  drawSights(frame ? *frame : greyRamp(look.input_width, look.input_height), look.sights, drawing);
}

void compare(const fs::path& network, const fs::path& reference) {
  if (!fs::exists(reference / "input.f32")) return;  // the import has reported the reason
  const Answers answers = checkAnswers(network, reference);
  if (answers.difference > kMostDifference) {
    throw StartupError(ExitCode::kConfiguration,
                       "{} computes {} of {} otherwise than the file says (by {:.2g} of its "
                       "largest value), so that its boxes would be wrong; export it with another "
                       "opset (11 to 13), or a plainer network of the family",
                       answers.by, answers.tensor, network.string(), answers.difference);
  }
  std::printf("%-11s answers as the file says (within %.0e)\n", answers.by.c_str(),
              answers.difference);
}

/// Adds the digest of the network to its description, so that a damaged copy is refused.
void seal(const fs::path& network) {
  const fs::path description = network.string() + ".model.json";
  auto json = nlohmann::ordered_json::parse(textOf(description));
  json["digest"] = toHex(digest(textOf(network)));
  writeChecked(description, json.dump(1) + "\n");
}

/// Runs the Python part and checks the network that it wrote.
void importTo(const fs::path& out, const Staging& staging, const ImportOptions& request) {
  const TemporaryFolder reference = temporaryFolder(fs::temp_directory_path(), "perdure-model-",
                                                    "set TMPDIR to a folder that you may write");
  const fs::path made = staging.path() / out.filename();
  ImportRequest wanted{request.network, made, out,
                       request.unchecked ? fs::path() : reference.path(), request.arguments};
  if (!request.image.empty()) {  // "--input camera" needs the image
    const Frame picture = readPicture(request.image);
    wanted.arguments.push_back(fmt::format("--camera={}x{}", picture.width, picture.height));
  }
  std::fflush(stdout);
  if (const int status = importNetwork(wanted); status != 0) throw CLI::RuntimeError(status);
  seal(made);
  compare(made, reference.path());
  showSights(made, request.image, request.threshold, fs::path(made).replace_extension(".png"));
}

}  // namespace

void importAndLook(const ImportOptions& request) {
  const fs::path out = importedPath(request.network, request.out);
  std::error_code error;
  if (!fs::exists(request.network, error) && !error) {
    throw StartupError(ExitCode::kUnavailable,
                       request.network.string() + " is missing; give an .onnx file");
  }
  Staging staging(out.parent_path());
  try {
    importTo(out, staging, request);
    staging.publish();
  } catch (const StartupError& fault) {
    throw StartupError(fault.code(), staging.said(fault.what()));
  }
  const fs::path description = out.string() + ".model.json";
  std::printf("drawn       %s\n", fs::path(out).replace_extension(".png").c_str());
  std::printf("written     %s, %s\nuse it      perdure-inference --set model.path=%s\n",
              out.c_str(), description.c_str(), out.c_str());
  std::printf(
      "calibrate   perdure model calibrate %s --frames DRIVE --labels OUT\n"
      "            by a run over a drive of yours\n",
      out.c_str());
}

namespace {

/// Adds an option that is passed unchanged to the Python part.
void passOn(CLI::App& command, ImportOptions& request, const std::string& name,
            const std::string& help, const std::string& type) {
  command
      .add_option_function<std::string>(
          name,
          [&request, name](const std::string& value) {
            request.arguments.push_back(name + "=" + value);
          },
          help)
      ->type_name(type);
}

void addImport(CLI::App& model, const std::shared_ptr<ImportOptions>& request) {
  CLI::App* command = model.add_subcommand("import", "Make a detector's ONNX file ready for use");
  command->footer(kImportHelp);
  command->add_option("network", request->network, "the .onnx file")->required()->type_name("FILE");
  passOn(*command, *request, "--classes", "names in the network's order, or a file with one a line",
         "NAMES");
  passOn(*command, *request, "--family",
         "instead of a guess: yolov5, yolov7, yolov8 (also v9 to v12 and 26), yolox, nanodet, "
         "picodet, rtmdet, fastestdet, yolo-fastestv2, ssd, detr",
         "NAME");
  passOn(*command, *request, "--size", "of an input without a fixed size", "WxH");
  passOn(*command, *request, "--input",
         "another size than the file's, of a network that is convolutional; camera: the shape of "
         "--image, with as many pixels",
         "WxH|camera");
  passOn(*command, *request, "--anchors",
         "yolov5, yolov7, yolo-fastestv2: W,H,W,H,… of each level, / between levels", "LIST");
  passOn(*command, *request, "--priors", "ssd: a line x y width height for each box, in shares",
         "FILE");
  passOn(*command, *request, "--variances", "ssd: of centre and size (0.1,0.2)", "V,V");
  passOn(*command, *request, "--boxes", "ssd, detr: the output that has the boxes", "OUTPUT");
  command->add_flag_callback(
      "--y-first", [request] { request->arguments.emplace_back("--y-first"); },
      "ssd: boxes are y1 x1 y2 x2, as TensorFlow has them");
  passOn(*command, *request, "--bins", "nanodet: values of a distance (8)", "N");
  passOn(*command, *request, "--cell-offset", "nanodet: 0, or 0.5 for the older ones", "SHARE");
  passOn(*command, *request, "--colour", "rgb or bgr", "ORDER");
  passOn(*command, *request, "--fit", "letterbox_centre, letterbox_top_left or resize", "HOW");
  passOn(*command, *request, "--scale", "input = (pixel - mean)·scale: one number or three",
         "LIST");
  passOn(*command, *request, "--mean", "three numbers, in the order of the colours", "LIST");
  passOn(*command, *request, "--pad", "the grey around a letterboxed picture", "VALUE");
  command->add_option("--image", request->image, "a picture to look at")->type_name("FILE");
  command->add_option("--out", request->out, "another folder than the network's")->type_name("DIR");
  command->add_option("--threshold", request->threshold, "least score of what is drawn")
      ->check(CLI::Range(0.001, 0.999))
      ->capture_default_str();
  command->add_flag("--no-check", request->unchecked,
                    "do not compare OpenCV's answers with the file's (seconds, for large networks "
                    "minutes)");
  command->callback([request] { importAndLook(*request); });
}

void addLook(CLI::App& model, const std::shared_ptr<ImportOptions>& request) {
  CLI::App* command =
      model.add_subcommand("look", "Draw what a network with a model.json sees in a picture");
  command->add_option("network", request->network, "the .onnx or .cfg file")
      ->required()
      ->type_name("FILE");
  command->add_option("--image", request->image, "the picture")->required()->type_name("FILE");
  command->add_option("--out", request->out, "the drawing, a .png")->required()->type_name("FILE");
  command->add_option("--threshold", request->threshold, "least score of what is drawn")
      ->check(CLI::Range(0.001, 0.999))
      ->capture_default_str();
  command->callback([request] {
    checkDrawing(request->out);
    showSights(request->network, request->image, request->threshold, request->out);
    std::printf("drawn       %s\n", request->out.c_str());
  });
}

}  // namespace

void setUpModel(CLI::App& model) {
  model.require_subcommand(1);
  model.footer(
      "\nA network is an ONNX file and a model.json that says what its numbers mean. `import` "
      "writes\nboth from the file that a training framework exports; `look` shows what one sees; "
      "`calibrate`\nfits what it says to labelled frames. `list` tells networks that are known to "
      "work, `fetch`\n"
      "takes one of them.\n"
      "\n  perdure model import yolov8n.onnx --image street.jpg\n"
      "  perdure model look yolov8n.perdure.onnx --image other.jpg --out other.png\n"
      "\nperdure model import --help tells the options; services/inference/README.md the "
      "families.");
  addImport(model, std::make_shared<ImportOptions>());
  addLook(model, std::make_shared<ImportOptions>());
  addFetch(model);
  addCalibrate(model);
}

}  // namespace perdure::tools
