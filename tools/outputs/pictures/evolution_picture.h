// evolution.png: how sure the system was of a few objects, frame by frame: the error of the
// position where truth is known, its standard deviation, and the existence. Above them, where the
// map closed loops, how far off the body was.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "tools/outputs/pictures/drive_log.h"
#include "tools/outputs/pictures/loop_chart.h"
#include "tools/outputs/pictures/picture_truth.h"

namespace perdure::tools {

enum class Phase { kInSight, kHidden, kOutOfView };

struct EvolutionPoint {
  std::uint64_t frame = 0;
  double sigma = 0.0;           ///< root of the trace of the position's covariance, m
  std::optional<double> error;  ///< distance of the centre from truth, m
  double existence = 0.0;
  Phase phase = Phase::kInSight;
};

struct Evolution {
  ObjectId id = 0;
  std::string class_name;  ///< the last one
  std::vector<EvolutionPoint> points;
};

/// Of the objects that were confirmed: the longest seen of each class but *other*, then the longest
/// seen of the rest, at most `most`. Truth is the track that was nearest to an object by the median
/// over the frames in which it was in sight: within 3 m, the nearest pairs first, one each.
std::vector<Evolution> chooseEvolutions(const DriveLog& log, const PictureTruth* truth,
                                        std::size_t most);

/// `body` is a row of its own above the objects, where it has points.
cv::Mat drawEvolutions(const std::vector<Evolution>& evolutions, const BodyErrors& body = {});
/// False: there is nothing to draw, or the file cannot be written.
bool writeEvolution(const DriveLog& log, const PictureTruth* truth, const BodyErrors& body,
                    const std::filesystem::path& file);

}  // namespace perdure::tools
