// Reads detections from a file as evidence: a CSV with the header `frame,class,x1,y1,x2,y2,score`.
// `frame` is the number of a frame, or the name of its image.
// Optional columns are an azimuth (its name begins with alpha or azimuth) and `logit:<class>`.
// Without a header, lines are RRC's `frame,x1,y1,x2,y2,score` or MOT's `frame,id,x,y,width,height,
// score,…`, whose frames count from 1; the caller then gives the class. Further columns after the
// corners are refused, because their meaning is not known. KITTI tracking's lines and COCO's JSON
// (coco_file.h) are read too.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/replay/files/boxes/coco_file.h"
#include "common/replay/files/class_aliases.h"
#include "common/replay/files/text_file.h"
#include "common/types/detections.h"

namespace perdure::replay {

struct DetectionFileOptions {
  std::filesystem::path file;
  std::string class_name;  ///< class of a file without header
  /// Subtracted from each corner. RRC counts pixels from 1. A CSV does not state its origin; the
  /// default is 0, unless the caller sets it (--box-origin).
  double box_origin = 0.0;
  /// Scores are clipped to [floor, 1 - floor] before conversion to a logit, because a network's
  /// score of 1.0 is not certainty.
  double score_floor = 0.01;
  double azimuth_sigma = 0.35;  ///< radians
  BoxExtent boxes = BoxExtent::kUnknown;
  double width = 0.0, height = 0.0;  ///< size of the images in pixels; 0: not known
  /// Frame numbers of the drive by image name (Recording::numbers).
  std::map<std::string, std::uint64_t> numbers = {};
};

/// The detections in a file. Activations of a row: clutter is 0. Other classes have the values of
/// the `logit:` columns, if present. Otherwise the row's class has logit(score), and the others
/// have the logit of the floor. Frames without rows have an empty list, which is evidence too. If
/// FILE.frames (same stem, one frame number per line) exists, only the frames listed in it have a
/// message.
class DetectionFile {
 public:
  /// Throws StartupError(kData) that names each wrong line and the fix.
  static DetectionFile read(const DetectionFileOptions& options, const ClassAliases& aliases);

  /// Classes known at a frame: those of the `logit:` columns, otherwise those of rows up to that
  /// frame. Later rows therefore never change the result. The list grows with the frame, and the
  /// hash changes with it.
  ModelInfo modelAt(std::uint64_t frame) const;
  /// The detections of a frame. Returns nothing if the file contains no information about the
  /// frame.
  std::optional<std::vector<Detection>> at(std::uint64_t frame) const;
  std::uint64_t firstFrame() const { return rows_.empty() ? 0 : rows_.begin()->first; }
  std::uint64_t lastFrame() const { return rows_.empty() ? 0 : rows_.rbegin()->first; }
  /// rows() counts all detections in the file; rowsBeyond() counts those of frames after `last`.
  std::size_t rows() const;
  std::size_t rowsBeyond(std::uint64_t last) const;
  /// A sentence if the file's frames count from 1, or if this is not certain. Otherwise "".
  const std::string& note() const { return note_; }
  /// Returns whether x2 and y2 are probably a width and a height: nearly all boxes share one pair
  /// of them, away from the image's border, although their left sides differ.
  bool hasSizes() const;
  /// A sentence if many boxes lie outside the images. Otherwise "".
  std::string whyOutside() const;
  /// A sentence if boxes reach beyond the image on one side of it only, or if they are cut off at
  /// other borders, as those of images of another size are. Otherwise "".
  std::string whyBeyond() const;
  std::map<std::string, std::size_t> classCounts() const;  ///< rows by canonical class name

  struct Row {
    Detection detection;     ///< empty until at() sets the activations, if the file has no logits
    std::string class_name;  ///< canonical name
    double logit = 0.0, score = 0.0;
  };

 private:
  void takeCoco(const CocoBoxes& coco, const ClassAliases& aliases);
  void takeLines(const std::vector<TextLine>& lines, const ClassAliases& aliases);
  void refuseShares() const;
  bool isExchanged(double right, double bottom) const;
  std::string exchanged(double right, double bottom) const;
  std::string whyCut(double right, double bottom) const;
  void noteClasses();
  std::vector<std::string> classesAt(std::uint64_t frame) const;

  DetectionFileOptions options_;
  std::vector<std::string> logit_classes_;
  std::string note_;
  std::vector<std::pair<std::uint64_t, std::string>>
      first_seen_;  ///< classes, each with its first frame
  std::map<std::uint64_t, std::vector<Row>> rows_;
  std::optional<std::set<std::uint64_t>> listed_frames_;
};

}  // namespace perdure::replay
