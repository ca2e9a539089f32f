// report.json of a pipeline run.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/pipeline/pipeline.h"

namespace perdure::tools {

/// Counts by service, latency, and data that was left out, with reasons. If the folder has labels
/// (KITTI tracking): recall and precision of the objects at 1 m; the labels are copied to
/// OUT/truth.
nlohmann::ordered_json makeReport(const Pipeline& pipeline, const PipelineOptions& options);

}  // namespace perdure::tools
