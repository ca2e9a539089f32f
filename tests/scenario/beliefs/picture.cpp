#include "tests/scenario/beliefs/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "common/math/chi2.h"
#include "tools/outputs/pictures/chart.h"

namespace perdure::test {
namespace {

using tools::Chart;

constexpr std::size_t kFewest = 10;  // smallest number of samples in a drawn bin
constexpr int kWidth = 400, kHeight = 330, kSide = 280, kBelow = 250;
const tools::Colour kBars(190, 120, 60);

cv::Rect cell(int row, int column) {
  return {column * kWidth + 70, row * kHeight + 40, kSide, kBelow};
}

void title(cv::Mat& picture, const cv::Rect& area, const std::string& text) {
  tools::drawText(picture, text, {area.x - 40, area.y - 14}, tools::kInk, {0.5});
}

void drawReliability(cv::Mat& picture, const cv::Rect& area, const tools::Reliability& r) {
  title(picture, area,
        fmt::format("{}: so against believed, ECE {:.3f}", r.what, r.calibrationError()));
  Chart chart(picture, area, {0.0, 1.0}, {0.0, 1.0});
  const auto bins = r.bins();
  std::size_t most = 1;
  for (const auto& bin : bins) most = std::max(most, bin.count);
  std::vector<cv::Point2d> curve;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double share = static_cast<double>(bins[i].count) / static_cast<double>(most);
    const double left = static_cast<double>(i) / static_cast<double>(bins.size());
    const double right = left + 1.0 / static_cast<double>(bins.size());
    tools::drawFilled(picture,
                      {chart.at(left, 0), chart.at(right, 0), chart.at(right, 0.3 * share),
                       chart.at(left, 0.3 * share)},
                      kBars, 0.3);
    if (bins[i].count >= kFewest) curve.emplace_back(bins[i].believed, bins[i].observed);
  }
  chart.drawGrid(true);
  chart.drawCurve({{0, 0}, {1, 1}}, {tools::kTruthColour, 1, true});
  chart.drawCurve(curve, {kBars, 2});
}

/// Histogram of the quantiles: flat for consistent errors, high at the right for overconfident
/// ones.
void drawQuantiles(cv::Mat& picture, const cv::Rect& area, const tools::Anees& anees) {
  title(picture, area, fmt::format("{}: quantiles, mean {:.2f}", anees.what, anees.mean()));
  constexpr int kBins = 20;
  std::vector<double> share(kBins, 0.0);
  for (const double nees : anees.nees) {
    const int at = static_cast<int>(chi2Cdf(nees, anees.dof) * kBins);
    share[static_cast<std::size_t>(std::min(at, kBins - 1))] +=
        1.0 / static_cast<double>(anees.nees.size());
  }
  const double top = std::max(0.1, 1.1 * *std::max_element(share.begin(), share.end()));
  Chart chart(picture, area, {0.0, 1.0}, {0.0, top});
  for (int i = 0; i < kBins; ++i) {
    const double left = double(i) / kBins, right = double(i + 1) / kBins;
    const double high = share[static_cast<std::size_t>(i)];
    tools::drawFilled(
        picture,
        {chart.at(left, 0), chart.at(right, 0), chart.at(right, high), chart.at(left, high)}, kBars,
        0.6);
  }
  chart.drawGrid(true);
  chart.drawCurve({{0, 1.0 / kBins}, {1, 1.0 / kBins}}, {tools::kTruthColour, 1, true});
}

}  // namespace

void drawBeliefs(const BeliefScores& scores, const std::filesystem::path& file) {
  cv::Mat picture(2 * kHeight, 3 * kWidth, CV_8UC3, tools::kPaper);
  drawReliability(picture, cell(0, 0), scores.existence);
  drawReliability(picture, cell(0, 1), scores.classes.best());
  drawQuantiles(picture, cell(1, 0), scores.all_position);
  drawQuantiles(picture, cell(1, 1), scores.all_half_yaw);
  drawQuantiles(picture, cell(1, 2), scores.all_size);
  cv::imwrite(file.string(), picture);
}

}  // namespace perdure::test
