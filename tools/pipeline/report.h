// report.json of a pipeline run.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/pipeline/pipeline.h"

namespace perdure::tools {

/// Counts by service, latency, what was left out and why; where the folder has labels (KITTI
/// tracking) the objects' recall and precision at 1 m, with the labels copied to OUT/truth.
nlohmann::ordered_json makeReport(const Pipeline& pipeline, const PipelineOptions& options);

}  // namespace perdure::tools
