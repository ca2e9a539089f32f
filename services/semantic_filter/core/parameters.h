// The parameters of all rooms. Each room owns its own; config.cpp says which of them can be set.
#pragma once

#include "services/semantic_filter/core/association/parameters.h"
#include "services/semantic_filter/core/belief/parameters.h"
#include "services/semantic_filter/core/measurement/parameters.h"
#include "services/semantic_filter/core/memory/parameters.h"
#include "services/semantic_filter/core/smoothing/parameters.h"
#include "services/semantic_filter/core/tracks/parameters.h"
#include "services/semantic_filter/core/visibility/parameters.h"

namespace perdure::semantic_filter {

struct Parameters {
  BoxParameters box;
  ClutterParameters clutter;
  InitiationParameters initiation;
  MotionParameters motion;
  PoseParameters pose;
  TemperingParameters tempering;
  VisibilityParameters visibility;
  TrackParameters tracks;
  SmoothingParameters smoothing;
  GroundParameters ground;
  MemoryParameters memory;
  AlignmentParameters alignment;
  DriftParameters drift;
};

}  // namespace perdure::semantic_filter
