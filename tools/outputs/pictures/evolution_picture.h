// evolution.png: position error, deviation and existence of selected objects over the frames; if
// loops closed, a row with the body's error.
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

/// Selects at most `most` confirmed objects: the one visible longest in each class except *other*,
/// then the others visible longest. Ground truth is the nearest track by the median over the frames
/// in which the object was visible, within 3 m. Pairs are one-to-one, with the smallest distances
/// first.
std::vector<Evolution> chooseEvolutions(const DriveLog& log, const PictureTruth* truth,
                                        std::size_t most);

/// `body` is a separate row above the objects, if it has points.
cv::Mat drawEvolutions(const std::vector<Evolution>& evolutions, const BodyErrors& body = {});
/// Returns false if there is nothing to draw, or if the file cannot be written.
bool writeEvolution(const DriveLog& log, const PictureTruth* truth, const BodyErrors& body,
                    const std::filesystem::path& file);

}  // namespace perdure::tools
