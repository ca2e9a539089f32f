// Uses the objects of a run as labels, for calibration without manual labels.
#pragma once

#include <memory>

#include "tools/model/labelled_frames.h"

namespace perdure::tools {

/// `request.labels` is OUT of `perdure pipeline` over the same frames. Objects of its final map
/// (objects_final.csv) are expected in each frame in which they are not occluded.
///
/// Boxes of objects that are uncertain, truncated, largely occluded or small are ignored. Boxes
/// beside an object are ignored too, because sizes of the map have errors. Only classes with at
/// least twenty views are judged. Boxes of moving objects, and of objects missing from the map,
/// count as clutter.
///
/// Throws StartupError (69) with the fix if there are too few data.
LabelledData readMapLabels(const LabelRequest& request, std::unique_ptr<replay::Dataset> dataset,
                           const replay::ClassAliases& aliases, double least_px);

}  // namespace perdure::tools
