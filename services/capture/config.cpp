#include "services/capture/config.h"

#include "common/base/errors.h"

namespace perdure::capture {
namespace {

void describeDataset(Config& c, config::Fields& fields) {
  fields.text("dataset.path", c.dataset.path,
              {"folder of the drive: EuRoC, KITTI raw or KITTI tracking; or a recording of images "
               "(.mcap)"});
  fields.text("dataset.sequence", c.dataset.sequence, {"of KITTI tracking: \"0001\""});
  fields.choice("dataset.cameras", c.dataset.cameras, {"mono", "stereo"},
                {"mono: cam0 only; stereo: cam1 too, where the drive has one"});
  fields.number("dataset.lead_s", c.dataset.lead_s, config::atLeast(0),
                {"inertial samples from so long before the first frame on", "s"});
  fields.number("dataset.trail_s", c.dataset.trail_s, config::atLeast(0),
                {"the drive ends so long after its last frame", "s"});
  const std::vector<std::string> encodings = {"as_is", "mono8", "bgr8"};
  fields.choice("image.cam0", c.image.cam0, encodings,
                {"encoding of cam0; inference wants colour where there is any"});
  fields.choice("image.cam1", c.image.cam1, encodings, {"encoding of cam1; only vio looks at it"});
}

}  // namespace

void describe(Config& c, config::Fields& fields) {
  fields.choice("source", c.source, {"dataset", "libcamera", "mcap"},
                {"where images and samples come from; this version has dataset only"});
  describeDataset(c, fields);
  fields.choice("pace.mode", c.pace.mode, {"clock", "follow"},
                {"clock: the drive's own times; follow: as fast as the readers answer"});
  fields.number("pace.rate", c.pace.rate, config::between(0.01, 100),
                {"clock: seconds of the drive in one second"});
  fields.integer("pace.window", c.pace.window, config::between(1, 3),
                 {"follow: frames on the way without an answer; the topic keeps 4"});
  fields.number("pace.timeout_s", c.pace.timeout_s, config::positive(),
                {"follow: go on without an answer after so long, and count it", "s"});
  fields.texts("start.readers", c.start.readers,
               {"processes to wait for before the drive starts: vio, inference, semantic_filter"});
  fields.number("start.timeout_s", c.start.timeout_s, config::atLeast(0),
                {"start without them after so long, and count it", "s"});
  fields.text("run.state", c.run.state,
              {"file that says where the run is, so that a restarted capture carries on; "
               "empty: none"});
  fields.choice("run.on_end", c.run.on_end, {"exit", "stay"},
                {"at the end of the drive: exit with status 0, or stay for late readers"});
}

void requireSource(const Config& config) {
  if (config.source != "dataset") {
    throw StartupError(ExitCode::kConfiguration,
                       "source: " + config.source +
                           " is not in this version; set source: dataset and dataset.path.");
  }
  if (config.dataset.path.empty()) {
    throw StartupError(ExitCode::kConfiguration,
                       "No drive is configured; set dataset.path to a folder in EuRoC, KITTI raw "
                       "or KITTI tracking layout, or to a recording (.mcap).");
  }
}

}  // namespace perdure::capture
