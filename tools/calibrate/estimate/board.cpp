#include "tools/calibrate/estimate/board.h"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <memory>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::calibrate {
namespace {

constexpr int kTagModules = 8;  ///< modules of 36h11: six of data and the black border
constexpr int kMostTags = 587;  ///< size of the family
constexpr char kFix[] =
    "give chessboard:COLUMNSxROWS:SQUARE (inner corners, metres) such as chessboard:9x6:0.03, or "
    "aprilgrid:COLUMNSxROWS:TAG[:GAP] such as aprilgrid:6x6:0.088:0.3";

[[noreturn]] void wrong(const std::string& text, const std::string& what) {
  throw StartupError(ExitCode::kUsage, "--board `" + text + "` " + what + "; " + kFix);
}

/// The black modules of each tag of the family, row by row.
const std::vector<std::uint64_t>& tagPictures() {
  static const std::vector<std::uint64_t> pictures = [] {
    const std::unique_ptr<apriltag_family_t, decltype(&tag36h11_destroy)> family(tag36h11_create(),
                                                                                 tag36h11_destroy);
    std::vector<std::uint64_t> all;
    for (std::uint32_t tag = 0; tag < family->ncodes; ++tag) {
      std::uint64_t picture = ~std::uint64_t{0};
      for (std::uint32_t bit = 0; bit < family->nbits; ++bit) {
        const bool white = (family->codes[tag] >> (family->nbits - 1 - bit)) & 1U;
        const std::uint32_t at = family->bit_y[bit] * kTagModules + family->bit_x[bit];
        if (white) picture &= ~(std::uint64_t{1} << at);
      }
      all.push_back(picture);
    }
    return all;
  }();
  return pictures;
}

bool within(double value, double low, double high) { return value >= low && value < high; }

}  // namespace

Board Board::parse(const std::string& text) {
  const auto parts = replay::split(text, ':');
  Board board;
  if (parts[0] == "chessboard") {
    board.kind = BoardKind::kChessboard;
  } else if (parts[0] != "aprilgrid") {
    wrong(text, "is no known kind of board");
  }
  const bool chess = board.kind == BoardKind::kChessboard;
  if (parts.size() < 3 || parts.size() > (chess ? 3 : 4)) wrong(text, "has too few or many parts");
  const auto counts = replay::split(parts[1], 'x');
  const auto columns = replay::parseInteger(counts[0]);
  const auto rows = counts.size() == 2 ? replay::parseInteger(counts[1]) : std::nullopt;
  const auto size = replay::parseNumber(parts[2]);
  const auto gap = parts.size() == 4 ? replay::parseNumber(parts[3]) : std::optional(board.gap);
  const int least = chess ? 3 : 1;
  if (!columns || !rows || *columns < least || *rows < least || *columns > 50 || *rows > 50) {
    wrong(text, "has no numbers of columns and rows that make sense");
  }
  if (!size || *size < 1e-3 || *size > 5.0) wrong(text, "has a size outside 0.001 … 5 m");
  if (!gap || *gap < 0.15 || *gap > 2.0) wrong(text, "has a gap outside 0.15 … 2 tags");
  board.columns = static_cast<int>(*columns), board.rows = static_cast<int>(*rows);
  board.size_m = *size, board.gap = *gap;
  if (chess && (*columns + *rows) % 2 == 0) {
    wrong(text, "looks the same upside down; one of its numbers is to be even, the other odd");
  }
  if (!chess && board.columns * board.rows > kMostTags) wrong(text, "has more tags than there are");
  return board;
}

std::string Board::text() const {
  if (kind == BoardKind::kChessboard) {
    return fmt::format("chessboard:{}x{}:{}", columns, rows, size_m);
  }
  return fmt::format("aprilgrid:{}x{}:{}:{}", columns, rows, size_m, gap);
}

std::size_t Board::cornerCount() const {
  const auto cells = static_cast<std::size_t>(columns * rows);
  return kind == BoardKind::kChessboard ? cells : 4 * cells;
}

Eigen::Vector3d Board::corner(std::size_t id) const {
  const auto width = static_cast<std::size_t>(columns);
  if (kind == BoardKind::kChessboard) {
    return size_m *
           Eigen::Vector3d(static_cast<double>(id % width), static_cast<double>(id / width), 0.0);
  }
  const std::size_t tag = id / 4, which = id % 4;
  const Eigen::Vector3d first(static_cast<double>(tag % width), static_cast<double>(tag / width),
                              0.0);
  const Eigen::Vector3d within_tag(which == 1 || which == 2 ? 1.0 : 0.0, which >= 2 ? 1.0 : 0.0,
                                   0.0);
  return pitch() * first + size_m * within_tag;
}

Eigen::Vector2d Board::printFrom() const {
  const double margin = kind == BoardKind::kChessboard ? 1.4 * size_m : (gap + 0.15) * size_m;
  return Eigen::Vector2d(-margin, -margin);
}

Eigen::Vector2d Board::printTo() const {
  return corner(cornerCount() - (kind == BoardKind::kChessboard ? 1 : 2)).head<2>() - printFrom();
}

bool Board::black(const Eigen::Vector2d& point) const {
  if (kind == BoardKind::kChessboard) {
    const double column = std::floor(point.x() / size_m), row = std::floor(point.y() / size_m);
    if (!within(column, -1, columns) || !within(row, -1, rows)) return false;
    return static_cast<int>(column + row + 2) % 2 == 0;
  }
  const double x = point.x() / size_m, y = point.y() / size_m, step = 1.0 + gap;
  if (!within(x, -gap, columns * step) || !within(y, -gap, rows * step)) return false;
  const double column = std::floor((x + gap) / step), row = std::floor((y + gap) / step);
  const double u = x - column * step, v = y - row * step;  // range -gap … 1
  if (u < 0 && v < 0) return true;                         // square between four tags
  if (u < 0 || v < 0 || column >= columns || row >= rows) return false;
  const auto tag = static_cast<std::size_t>(row * columns + column);
  const auto at = static_cast<std::uint64_t>(v * kTagModules) * kTagModules +
                  static_cast<std::uint64_t>(u * kTagModules);
  return (tagPictures()[tag] >> at) & 1U;
}

std::string boardSvg(const Board& board) {
  const Eigen::Vector2d from = board.printFrom(), to = board.printTo();
  const double width = 1e3 * (to.x() - from.x()), height = 1e3 * (to.y() - from.y());
  const double cell =
      board.kind == BoardKind::kChessboard ? board.size_m : board.size_m / kTagModules;
  const double line = 12.0;  // mm below the board, for scale and text
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" "
      "viewBox=\"0 0 {0} {1}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<g fill=\"black\" shape-rendering=\"crispEdges\">\n",
      width, height + line);
  const auto rectangle = [&](double x, double y, double w, double h) {
    text += fmt::format("<rect x=\"{:.4f}\" y=\"{:.4f}\" width=\"{:.4f}\" height=\"{:.4f}\"/>\n",
                        1e3 * (x - from.x()), 1e3 * (y - from.y()), 1e3 * w, 1e3 * h);
  };
  if (board.kind == BoardKind::kChessboard) {
    for (int row = -1; row < board.rows; ++row) {
      for (int column = -1; column < board.columns; ++column) {
        const Eigen::Vector2d middle((column + 0.5) * cell, (row + 0.5) * cell);
        if (board.black(middle)) rectangle(column * cell, row * cell, cell, cell);
      }
    }
  } else {
    const double step = board.size_m * (1.0 + board.gap), square = board.size_m * board.gap;
    for (int row = 0; row <= board.rows; ++row) {
      for (int column = 0; column <= board.columns; ++column) {
        rectangle(column * step - square, row * step - square, square, square);
        if (row == board.rows || column == board.columns) continue;
        for (int module = 0; module < kTagModules * kTagModules; ++module) {
          const double x = column * step + (module % kTagModules) * cell;
          const double y = row * step + (module / kTagModules) * cell;
          if (board.black({x + 0.5 * cell, y + 0.5 * cell})) rectangle(x, y, cell, cell);
        }
      }
    }
  }
  text += fmt::format(
      "</g>\n<path d=\"M5 {0}h100m-100 -2v4m100 -4v4\" stroke=\"black\" stroke-width=\"0.3\" "
      "fill=\"none\"/>\n<text x=\"5\" y=\"{1}\" font-size=\"3.5\" font-family=\"sans-serif\">this "
      "line is 100 mm long; --board {2}</text>\n</svg>\n",
      height + 3, height + 9, board.text());
  return text;
}

}  // namespace perdure::calibrate
