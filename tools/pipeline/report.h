// report.json of a pipeline run.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/pipeline/pipeline.h"

namespace perdure::tools {

/// Returns counts by service, latency, and data that was left out, with reasons. If the folder has
/// labels (KITTI tracking), adds recall and precision of the objects at 1 m, and copies the labels
/// to OUT/truth.
nlohmann::ordered_json makeReport(const Pipeline& pipeline, const PipelineOptions& options);

}  // namespace perdure::tools
