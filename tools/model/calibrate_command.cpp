#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "common/base/checked_file.h"
#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "services/inference/model_file.h"
#include "tools/model/calibrate.h"
#include "tools/model/command.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp = R"(
Looks at labelled frames with the service's own node and fits what its activations are worth:
temperature and bias by maximum likelihood, the share of boxes that are clutter, and what the best
candidate says at a place where something is expected and no box was reported. Where model.json
has box_sigma or side_insets, those too. The figures printed as "after" are of frames that the fit
did not see (five unbroken folds). Writes model.json and keeps the old one as model.json.before.

  perdure model calibrate net.onnx --frames DRIVE                     simulated, with its truth
  perdure model calibrate net.onnx --frames ROOT --sequence 0001      KITTI tracking with image_02
  perdure model calibrate net.onnx --frames *_sync --labels label_02/0000.txt      KITTI raw

Without labels, the objects on the map of a run replace them:

  perdure pipeline --data DRIVE --odometry vio --detections model --model net.onnx --out OUT
  perdure model calibrate net.onnx --frames DRIVE --labels OUT)";

struct CalibrateRequest {
  CalibrateOptions options;
  std::vector<fs::path> folders;
  std::string sequence;
  fs::path labels, out;
  std::uint64_t every = 1;
  bool dry = false, quiet = false;
};

void print(const CalibrationResult& r) {
  const auto line = [](const char* what, const std::string& text) {
    std::printf("%-24s %s\n", what, text.c_str());
  };
  line("looked at", fmt::format("{} frames, {} boxes, {:.2f} false ones a frame", r.frames, r.boxes,
                                r.false_boxes));
  line("objects found", fmt::format("{} of {}", r.targets_found, r.targets));
  line("temperature",
       fmt::format("{:.3f} (was {:.3f})", r.fitted.temperature, r.before.temperature));
  line("bias", fmt::format("{:.3f} nats (was {:.3f})", r.fitted.bias, r.before.bias));
  line("clutter_rate",
       fmt::format("{:.3f} (was {:.3f})", r.fitted.clutter_rate, r.before.clutter_rate));
  line("calibration error", fmt::format("{:.4f} before, {:.4f} after, on frames held out",
                                        r.reliability_before.error, r.reliability_after.error));
  line("log-likelihood",
       fmt::format("{:.4f} before, {:.4f} after, on frames held out, nats a box",
                   -r.reliability_before.likelihood, -r.reliability_after.likelihood));
  if (r.has_primed) {
    const auto& p = r.fitted.primed;
    line("primed answers",
         fmt::format("slope {:.3f}, offset {:.3f}, nothing {:.3f}; {:+.2f} nats a look where it is "
                     "({}), {:+.2f} where nothing is ({})",
                     p.slope, p.offset, p.nothing, r.primed_nats_there, r.asked_there,
                     r.primed_nats_elsewhere, r.asked_elsewhere));
  } else {
    line("primed answers",
         fmt::format("not fitted: {} places where something was missed, {} where nothing is; 40 of "
                     "each are the least",
                     r.asked_there, r.asked_elsewhere));
  }
  if (r.box_sigma > 0.0) line("box_sigma", fmt::format("{:.3f}", r.box_sigma));
  line("clutter.per_frame", fmt::format("{:.2f} would be semantic_filter's", r.false_boxes));
}

fs::path descriptionOf(const inference::Config& config) {
  if (!config.model.description.empty()) return config.model.description;
  return inference::findDescription(config.model.path, inference::standardModelFolders());
}

void run(const CalibrateRequest& request) {
  CalibrateOptions options = request.options;
  if (request.folders.size() > 1 && fs::is_directory(request.labels)) {
    throw StartupError(ExitCode::kUsage, request.labels.string() +
                                             " is of one run, over one drive; give one --frames");
  }
  for (const fs::path& folder : request.folders) {
    options.data.push_back({folder, request.sequence, request.labels, request.every});
  }
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto result = calibrate(options, [&](std::size_t done, std::size_t all) {
    if (request.quiet || (!terminal && done % 100 != 0)) return;
    std::fprintf(stderr, "%sframe %zu of %zu%s", terminal ? "\r" : "", done, all,
                 terminal ? "\033[K" : "\n");
  });
  if (!request.quiet && terminal) std::fputc('\n', stderr);
  print(result);
  if (request.dry) return;
  const fs::path description = descriptionOf(options.inference);
  const std::string old = textOf(description);
  const fs::path out = request.out.empty() ? description : request.out;
  const std::string text = withCalibration(old, result);
  (void)inference::parseModelDescription(text, description.string());
  if (request.out.empty()) writeChecked(description.string() + ".before", old);
  writeChecked(out, text);
  std::printf("%-24s %s\n", "written", out.c_str());
}

}  // namespace

void addCalibrate(CLI::App& model) {
  auto request = std::make_shared<CalibrateRequest>();
  CLI::App* command =
      model.add_subcommand("calibrate", "Fit what a network's activations are worth, on labels");
  command->footer(kHelp);
  auto& inference = request->options.inference;
  command->add_option("network", inference.model.path, "the .onnx or .cfg file")
      ->required()
      ->type_name("FILE");
  command->add_option("--frames", request->folders, "labelled folders")
      ->required()
      ->type_name("DIR");
  command
      ->add_option(
          "--labels", request->labels,
          "label_02/SEQUENCE.txt, of KITTI raw; or OUT of `perdure pipeline` over the frames")
      ->type_name("FILE");
  command->add_option("--sequence", request->sequence, "of KITTI tracking")->type_name("NAME");
  command->add_option("--every", request->every, "look at each N-th frame")
      ->check(CLI::PositiveNumber);
  command->add_option("--description", inference.model.description, "its model.json, elsewhere")
      ->type_name("FILE");
  command
      ->add_option("--threshold", inference.detection.score_threshold,
                   "the service's detection.score_threshold")
      ->check(CLI::Range(0.001, 0.999))
      ->capture_default_str();
  command
      ->add_option("--merge-iou", inference.detection.merge_iou,
                   "the service's detection.merge_iou")
      ->check(CLI::Range(0.1, 1.0))
      ->capture_default_str();
  command->add_option("--threads", inference.model.threads, "of OpenCV")->check(CLI::Range(1, 64));
  command->add_option("--out", request->out, "another model.json than the network's")
      ->type_name("FILE");
  command->add_flag("--primed-only", request->options.primed_only,
                    "fit the evidence of primed answers; the rest stays as it is");
  command->add_flag("--dry-run", request->dry, "print, write no model.json");
  command->add_flag("--quiet", request->quiet, "no progress");
  command->callback([request] { run(*request); });
}

}  // namespace perdure::tools
