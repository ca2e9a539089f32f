// The map's legend: symbols, colours, north arrow and scale bar.
#pragma once

#include "tools/outputs/pictures/drawing.h"
#include "tools/outputs/pictures/map_picture.h"

namespace perdure::tools {

inline const Colour kDots(170, 165, 160);
Stroke loopStroke(bool believed, double text);
/// Opacity of an object's filled outline for its visibility at the end of the run.
double fillOf(Visibility visibility);
cv::Size pictureSize(const MapContent& content, const MapView& view);
/// Draws a bar of view.bar_m metres, with its length as text.
void drawScaleBar(cv::Mat& picture, const MapView& view);
void drawMapLegend(cv::Mat& picture, const MapContent& content, const MapView& view);

}  // namespace perdure::tools
