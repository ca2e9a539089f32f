// Names of the truth files and of their columns.
#pragma once

namespace perdure::sim {

inline constexpr char kObjectsTruthFile[] = "objects_truth.json";
inline constexpr char kVisibilityTruthFile[] = "visibility_truth.csv";
inline constexpr char kVisibilityHeader[] = "frame,object_id,visible_fraction,x1,y1,x2,y2";
inline constexpr char kInsideTruthFile[] = "inside_truth.csv";
inline constexpr char kInsideHeader[] = "frame,object_id,x1,y1,x2,y2";

}  // namespace perdure::sim
