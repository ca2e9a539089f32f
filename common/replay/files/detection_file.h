// Detections from a CSV, as evidence: a header `frame,class,x1,y1,x2,y2,score` with, where known,
// an azimuth column (its name begins with alpha or azimuth) and `logit:<class>` columns; or RRC's
// headerless `frame,x1,y1,x2,y2,score`, to which the caller gives the class.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/replay/files/class_aliases.h"
#include "common/types/detections.h"

namespace perdure::replay {

struct DetectionFileOptions {
  std::filesystem::path file;
  std::string class_name;  ///< of a headerless file
  /// Subtracted from each corner. RRC counts pixels from 1; a CSV does not say so, hence 0 unless
  /// the caller knows better (--box-origin).
  double box_origin = 0.0;
  /// Scores are clipped into [floor, 1 - floor] before they become a logit: a score of 1.0 is a
  /// network's opinion, not certainty.
  double score_floor = 0.01;
  double azimuth_sigma = 0.35;  ///< radians
  BoxExtent boxes = BoxExtent::kCuboid;
};

/// Activations of a row: clutter 0; with `logit:` columns those; else logit(score) for its class
/// and the floor's logit for the others. Frames without rows have an empty list, which is evidence;
/// where FILE.frames (same stem, a frame number a line) stands beside the CSV, only the frames in
/// it have a message at all.
class DetectionFile {
 public:
  /// Throws StartupError(kData) that names each wrong line with the mend.
  static DetectionFile read(const DetectionFileOptions& options, const ClassAliases& aliases);

  /// Classes known at a frame: those of `logit:` columns, else those of rows up to that frame, so
  /// that a prefix of the file gives the same. Grows with the frame; the hash changes with it.
  ModelInfo modelAt(std::uint64_t frame) const;
  /// Nothing where the file makes no statement about the frame.
  std::optional<std::vector<Detection>> at(std::uint64_t frame) const;
  std::uint64_t firstFrame() const { return rows_.empty() ? 0 : rows_.begin()->first; }
  std::uint64_t lastFrame() const { return rows_.empty() ? 0 : rows_.rbegin()->first; }
  /// How many detections it holds.
  std::size_t rows() const;

  struct Row {
    Detection detection;     ///< activations still empty where logits are not in the file
    std::string class_name;  ///< canonical
    double logit = 0.0;
  };

 private:
  void noteClasses();
  std::vector<std::string> classesAt(std::uint64_t frame) const;

  DetectionFileOptions options_;
  std::vector<std::string> logit_classes_;
  std::vector<std::pair<std::uint64_t, std::string>> first_seen_;  ///< of classes, in file order
  std::map<std::uint64_t, std::vector<Row>> rows_;
  std::optional<std::set<std::uint64_t>> listed_frames_;
};

}  // namespace perdure::replay
