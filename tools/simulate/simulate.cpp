#include "tools/simulate/simulate.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/base/files/folder_lock.h"
#include "common/sim/truth.h"
#include "tools/simulate/journal.h"
#include "tools/simulate/render/counter_noise.h"
#include "tools/simulate/render/outline.h"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/render/sensor.h"
#include "tools/simulate/scene_digest.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

constexpr char kSceneFile[] = "scene.json", kJournalFile[] = "unfinished.journal";
constexpr int kTruthStep = 2;  ///< pixels between visibility rays if no images are rendered

nlohmann::json descriptionOf(const SimulateOptions& options, const sim::Scene& scene) {
  const sim::SceneOptions& w = options.world;
  return {{"name", scene.name},
          {"seed", scene.seed},
          {"proves", scene.proves},
          {"seconds", scene.seconds},
          {"program", std::string("perdure ") + PERDURE_VERSION},
          {"digest", fmt::format("{:016x}", digestOf(scene))},
          {"epoch_ns", toNanoseconds(kSceneEpoch)},
          {"options",
           {{"width", w.width},
            {"height", w.height},
            {"rate_hz", w.rate_hz},
            {"every", options.every},
            {"stereo", w.stereo},
            {"mono", w.mono8},
            {"rolling_shutter", w.rolling_shutter},
            {"noise", w.noise},
            {"look_set", w.look_set},
            {"images", options.images},
            {"encoding", options.format == ImageFormat::kPng ? "png" : "jpeg"}}}};
}

/// Locks the folder. Throws StartupError if it has other content than that of this run.
FolderLock claim(const fs::path& out, const std::string& description) {
  FolderLock lock(out);
  const fs::path file = out / kSceneFile;
  if (!fs::exists(file) && !fs::is_empty(out)) {
    throw StartupError(ExitCode::kUsage, out.string() +
                                             " holds something else; give --out a new folder, or "
                                             "empty this one");
  }
  if (fs::exists(file) && textOf(file) != description) {
    throw StartupError(ExitCode::kUsage,
                       out.string() +
                           " holds another simulation (see its scene.json); give --out a new "
                           "folder, or remove this one");
  }
  if (!fs::exists(file)) writeWhole(file, description);
  return lock;
}

class Run {
 public:
  Run(const SimulateOptions& options, const sim::Scene& scene)
      : options_(options),
        scene_(scene),
        workers_(options.threads),
        world_(scene_, options.threads),
        renderer_(world_, workers_) {
    const auto& cameras = scene_.rig.true_calibration.cameras;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      lenses_.emplace_back(cameras[i]);
      sensors_.emplace_back(sensorOptions(i), lenses_.back());
    }
    const double rate = cameras.at(0).rate_hz;
    const auto count = static_cast<std::uint64_t>(std::floor(scene_.seconds * rate + 1e-9));
    for (std::uint64_t i = 0; i < count; i += options_.every) {
      stamps_.push_back(kSceneEpoch + durationFromSeconds(static_cast<double>(i) / rate));
    }
  }

  const std::vector<TimePoint>& stamps() const { return stamps_; }
  std::size_t cameras() const { return lenses_.size(); }
  fs::path folderOf(std::size_t camera) const {
    return options_.out / "mav0" / ("cam" + std::to_string(camera));
  }

  void writeLists() const {
    for (std::size_t i = 0; i < cameras(); ++i) {
      CameraCalibration calibration = scene_.rig.calibration.cameras.at(i);
      calibration.rate_hz /= static_cast<double>(options_.every);
      writeWhole(folderOf(i) / "sensor.yaml", cameraYaml(calibration));
      writeWhole(folderOf(i) / "data.csv", imageListCsv(stamps_, extensionOf(options_.format)));
      fs::create_directories(folderOf(i) / "data");
    }
    writeSensors(options_.out, scene_);
  }
  bool isWhole(std::size_t frame) const {
    for (std::size_t i = 0; i < cameras(); ++i) {
      if (options_.images && !fs::exists(fileOf(i, frame))) return false;
    }
    return frame < stamps_.size();
  }
  bool isWhole() const {
    for (std::size_t frame = 0; frame < stamps_.size(); ++frame) {
      if (!isWhole(frame)) return false;
    }
    return true;
  }
  void resume(const JournalEntry& last) {
    for (std::size_t i = 0; i < cameras(); ++i) sensors_[i].setState(last.sensors[i]);
  }
  JournalEntry draw(std::size_t frame) {
    JournalEntry entry;
    for (std::size_t i = 0; i < cameras(); ++i) {
      const double t = toSeconds(stamps_[frame] - kSceneEpoch);
      const double offset = scene_.rig.true_calibration.cameras[i].time_offset_s;
      const Shot shot = shotAt(scene_, i, t + offset);
      const int step = options_.images ? 1 : kTruthStep;
      if (options_.images) {
        renderer_.render(lenses_[i], shot, picture_);
        keep(i, frame);
      } else if (i == 0) {
        renderer_.identify(lenses_[i], shot, step, picture_);
      }
      if (i == 0) entry.views = viewsOf(world_, lenses_[i], shot, picture_, step, workers_);
      entry.sensors.push_back(sensors_[i].state());
    }
    return entry;
  }
  void finish() { workers_.drain(); }

 private:
  SensorOptions sensorOptions(std::size_t camera) const {
    SensorOptions sensor;
    sensor.errors = scene_.rig.cameras.at(camera);
    sensor.encoding = options_.world.mono8 ? ImageEncoding::kMono8 : ImageEncoding::kBgr8;
    sensor.noise = options_.world.noise;
    sensor.adapt = scene_.name != "random";  // views of `random` are independent
    sensor.interval_s = static_cast<double>(options_.every) /
                        scene_.rig.true_calibration.cameras.at(camera).rate_hz;
    sensor.seed = mixBits(scene_.seed, 0xca3 + camera);
    return sensor;
  }
  fs::path fileOf(std::size_t camera, std::size_t frame) const {
    return folderOf(camera) / "data" /
           (std::to_string(toNanoseconds(stamps_[frame])) + extensionOf(options_.format));
  }
  void keep(std::size_t camera, std::size_t frame) {
    auto pixels = std::make_shared<std::vector<std::uint8_t>>(
        sensors_[camera].develop(picture_, frame, workers_));
    workers_.post([file = fileOf(camera, frame), width = picture_.width, height = picture_.height,
                   channels = options_.world.mono8 ? 1 : 3, pixels, format = options_.format] {
      writeImage(file, width, height, channels, *pixels, format);
    });
  }

  const SimulateOptions& options_;
  const sim::Scene& scene_;
  Workers workers_;
  World world_;
  Renderer renderer_;
  std::vector<Lens> lenses_;
  std::vector<Sensor> sensors_;
  std::vector<TimePoint> stamps_;
  Picture picture_;
};

void require(const SimulateOptions& options) {
  if (options.every < 1) throw StartupError(ExitCode::kUsage, "--every is at least 1");
  if (options.threads < 1) throw StartupError(ExitCode::kUsage, "--threads is at least 1");
  if (options.world.seconds && !(*options.world.seconds > 0.0)) {
    throw StartupError(ExitCode::kUsage, "--seconds is more than 0");
  }
}

void finishFolder(const fs::path& out, const Journal& journal) {
  std::vector<std::vector<sim::TruthView>> views;
  for (const auto& entry : journal.entries()) views.push_back(entry.views);
  writeWhole(out / sim::kInsideTruthFile, insideCsv(views));
  writeWhole(out / sim::kVisibilityTruthFile, visibilityCsv(views));
  fs::remove(out / kJournalFile);
}

}  // namespace

bool simulate(const SimulateOptions& options,
              const std::function<void(const SimulateProgress&)>& report) {
  require(options);
  return simulate(sim::makeScene(options.scene, options.seed, options.world), options, report);
}

bool simulate(const sim::Scene& scene, const SimulateOptions& options,
              const std::function<void(const SimulateProgress&)>& report) {
  require(options);
  const FolderLock lock = claim(options.out, descriptionOf(options, scene).dump(2) + "\n");
  Run run(options, scene);
  const fs::path last = options.out / sim::kVisibilityTruthFile;
  if (fs::exists(last) && run.isWhole()) return false;
  fs::remove(last);  // images were removed after completion
  run.writeLists();
  Journal journal(options.out / kJournalFile, run.cameras(),
                  [&](std::size_t frame) { return run.isWhole(frame); });
  SimulateProgress progress{journal.entries().size(), run.stamps().size(),
                            journal.entries().size()};
  if (progress.resumed > 0) run.resume(journal.entries().back());
  try {
    while (progress.frame < progress.frames) {
      journal.append(run.draw(progress.frame));
      ++progress.frame;
      if (report) report(progress);
    }
    run.finish();
  } catch (const std::exception&) {
    if (lock.holds()) throw;
  }
  if (!lock.holds() || !run.isWhole()) {
    throw StartupError(ExitCode::kInputOutput,
                       "{}: the folder, or images in it, were removed while it was written; "
                       "remove it and run it again",
                       options.out.string());
  }
  finishFolder(options.out, journal);
  return true;
}

}  // namespace perdure::tools
