// What stands beside the map: what its signs and colours mean, where north is, how long a metre is.
#pragma once

#include "tools/outputs/pictures/drawing.h"
#include "tools/outputs/pictures/map_picture.h"

namespace perdure::tools {

inline const Colour kDots(170, 165, 160);
/// A loop of the map's graph.
Stroke loopStroke(bool believed, double text);
/// How much of its colour an object's outline is filled with, by what is seen of it at the end.
double fillOf(Visibility visibility);
/// Map, axes and legend together.
cv::Size pictureSize(const MapContent& content, const MapView& view);
/// A bar of view.bar_m metres, view.bar_m × view.scale pixels long, with its length beside it.
void drawScaleBar(cv::Mat& picture, const MapView& view);
void drawMapLegend(cv::Mat& picture, const MapContent& content, const MapView& view);

}  // namespace perdure::tools
