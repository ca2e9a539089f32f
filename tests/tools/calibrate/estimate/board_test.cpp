#include "tools/calibrate/estimate/board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "common/base/errors.h"
#include "tools/calibrate/simulated.h"
#include "tools/simulate/render/sensor.h"
#include "tools/simulate/writer.h"

namespace perdure::calibrate {
namespace {

const Board kChess = Board::parse("chessboard:9x6:0.05");
const Board kGrid = Board::parse("aprilgrid:6x5:0.08:0.3");

TEST(Board, ReadsWhatItWrites) {
  for (const Board& board : {kChess, kGrid}) {
    const Board again = Board::parse(board.text());
    EXPECT_EQ(again.text(), board.text());
    EXPECT_EQ(again.cornerCount(), board.cornerCount());
  }
  EXPECT_EQ(kChess.cornerCount(), 54u);
  EXPECT_EQ(kGrid.cornerCount(), 120u);
}

TEST(Board, RefusesWhatCannotBePrintedOrTellsNotUpFromDown) {
  for (const char* text :
       {"", "chessboard", "chessboard:9x6", "chessboard:8x6:0.03", "chessboard:9x6:0",
        "chessboard:9x6:0.03:0.3", "aprilgrid:6x6:0.088:0.01", "aprilgrid:30x30:0.01",
        "circles:4x5:0.02", "chessboard:9:0.03", "aprilgrid:0x6:0.1"}) {
    EXPECT_THROW(Board::parse(text), StartupError) << text;
  }
}

TEST(Board, EveryCornerIsACrossingOfBlackAndWhite) {
  for (const Board& board : {kChess, kGrid}) {
    for (std::size_t id = 0; id < board.cornerCount(); ++id) {
      const Eigen::Vector2d p = board.corner(id).head<2>();
      const double d = 0.05 * board.size_m;
      const bool a = board.black(p + Eigen::Vector2d(d, d));
      const bool b = board.black(p + Eigen::Vector2d(-d, d));
      EXPECT_EQ(a, board.black(p - Eigen::Vector2d(d, d))) << id;
      EXPECT_EQ(b, board.black(p - Eigen::Vector2d(-d, d))) << id;
      EXPECT_NE(a, b) << id;
    }
  }
}

TEST(Board, TheSvgIsBlackWhereTheBoardIs) {
  const std::string svg = boardSvg(kChess);
  EXPECT_THAT(svg, testing::HasSubstr("--board chessboard:9x6:0.05"));
  std::size_t squares = 0;
  for (std::size_t at = 0; (at = svg.find("<rect x", at)) != std::string::npos; ++at) ++squares;
  EXPECT_EQ(squares, 35u);  // half of the 10×7 squares
}

/// Renders images with the sensor's noise, and detects the corners in them.
void expectExactCorners(const Board& board, DistortionModel model, double rms_px) {
  SimulatedOptions options;
  options.board = board;
  options.lens = model;
  options.exposure_s = 0.002;
  const auto simulated = simulateCalibration(options);
  const auto truth = simulateViews(simulated, 0.0);
  const tools::Lens lens(simulated.truth());
  tools::Workers workers(2);
  tools::Sensor sensor({simulated.scene.rig.cameras[0], ImageEncoding::kMono8}, lens);
  tools::Picture picture;
  std::size_t images = 0, corners = 0, expected = 0;
  double sum = 0.0;
  for (std::size_t i = 3; i < truth.size(); i += truth.size() / 8) {
    const double t_s =
        toSeconds(truth[i].time - tools::kSceneEpoch) + simulated.truth().time_offset_s;
    drawBoard(simulated, lens, t_s, workers, picture);
    auto pixels = sensor.develop(picture, i, workers);
    const cv::Mat image(picture.height, picture.width, CV_8UC1, pixels.data());
    const auto found = findCorners(board, image);
    ++images;
    expected += truth[i].corners.size();
    for (const Corner& corner : found) {
      for (const Corner& other : truth[i].corners) {
        if (other.id != corner.id) continue;
        ++corners;
        const double error = (corner.pixel - other.pixel).norm();
        EXPECT_LT(error, 1.0) << "corner " << corner.id << " of frame " << truth[i].frame;
        sum += error * error / 2.0;
      }
    }
  }
  EXPECT_GE(images, 8u);
  EXPECT_GT(corners, expected * 6 / 10);
  EXPECT_LT(std::sqrt(sum / static_cast<double>(corners)), rms_px);
}

TEST(FindCorners, FindsADrawnChessboardToATenthOfAPixel) {
  expectExactCorners(kChess, DistortionModel::kRadialTangential, 0.07);
}
TEST(FindCorners, FindsADrawnGridToATenthOfAPixel) {
  expectExactCorners(kGrid, DistortionModel::kRadialTangential, 0.1);
}
TEST(FindCorners, FindsADrawnGridThroughAFisheye) {
  expectExactCorners(kGrid, DistortionModel::kEquidistant, 0.12);
}

}  // namespace
}  // namespace perdure::calibrate
