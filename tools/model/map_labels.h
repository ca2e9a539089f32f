// The objects of a run in place of labels: calibration where nobody labelled anything.
#pragma once

#include <memory>

#include "tools/model/labelled_frames.h"

namespace perdure::tools {

/// `request.labels` is OUT of `perdure pipeline` over the same frames. What it found to be there at
/// the end (objects_final.csv) is expected in each frame in which it was not hidden. Of an object
/// that is doubtful, cut by the border, largely behind another or small, boxes are ignored; so are
/// boxes beside an object, as the map errs by some of its size. Judged are the classes that
/// were seen in twenty views. Boxes of things that move, and of what the map did not hold, count as
/// clutter. Throws StartupError (69) where there is too little, with the mend.
LabelledData readMapLabels(const LabelRequest& request, std::unique_ptr<replay::Dataset> dataset,
                           const replay::ClassAliases& aliases, double least_px);

}  // namespace perdure::tools
