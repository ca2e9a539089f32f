// evolution.png: position error, standard deviation and existence of selected objects over the
// frames. If there were loops, a further row shows the body's error.
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
  double sigma = 0.0;           ///< root of the trace of the position covariance, m
  std::optional<double> error;  ///< distance of the centre from ground truth, m
  double existence = 0.0;
  Phase phase = Phase::kInSight;
};

struct Evolution {
  ObjectId id = 0;
  std::string class_name;  ///< the class at the end
  std::vector<EvolutionPoint> points;
};

/// Selects at most `most` confirmed objects: first, from each class except *other*, the object that
/// was visible longest, then the others by duration. An object's ground truth is the true track
/// with the smallest median distance while the object was visible, at most 3 m. Pairs are
/// one-to-one, the smallest distance first.
std::vector<Evolution> chooseEvolutions(const DriveLog& log, const PictureTruth* truth,
                                        std::size_t most);

/// Draws a row for each object, and above them a row for `body` if it has points.
cv::Mat drawEvolutions(const std::vector<Evolution>& evolutions, const BodyErrors& body = {});
/// Draws and writes the picture; returns false if there is nothing to draw. Throws
/// StartupError(kInputOutput) if the file cannot be written.
bool writeEvolution(const DriveLog& log, const PictureTruth* truth, const BodyErrors& body,
                    const std::filesystem::path& file);

}  // namespace perdure::tools
