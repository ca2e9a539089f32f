#include "common/replay/files/boxes/foreign_boxes.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"

namespace perdure::replay {
namespace {

/// Refuses files that are no tables. `text` is the first line.
void refuseOtherFiles(const std::filesystem::path& file, std::string_view text) {
  const char* what =
      text.starts_with('<') ? "XML, as of CVAT or Pascal VOC; export the boxes as COCO JSON"
      : text.starts_with("PK\x03\x04") ? "a ZIP archive or a spreadsheet; save the table as CSV"
                                       : nullptr;
  const auto isBinary = [](char c) { return c >= 0 && c < ' ' && c != '\t' && c != '\r'; };
  if (!what && std::ranges::any_of(text, isBinary)) {
    throw StartupError(ExitCode::kData,
                       "{} is no text; give a table of boxes, or a network as --detections model "
                       "--model FILE",
                       file.c_str());
  }
  if (!what) return;
  throw StartupError(ExitCode::kData,
                     "{} is {}, or write a table with the header frame,class,x1,y1,x2,y2,score",
                     file.c_str(), what);
}

/// Refuses lines in which all numbers after the first one or two lie between 0 and 1.
void refuseShareLines(const std::filesystem::path& file, const std::vector<TextLine>& lines) {
  if (lines.empty()) return;
  const char separator = separatorOf(lines.front().text);
  bool fraction = false;
  for (const TextLine& line : lines) {
    const auto v = parseNumbers(split(line.text, separator));
    if (!v || v->size() < 5) return;
    for (std::size_t i = v->size() > 6 ? 2 : 1; i < v->size(); ++i) {
      if ((*v)[i] < 0.0 || (*v)[i] > 1.0) return;
      fraction = fraction || ((*v)[i] > 0.0 && (*v)[i] < 1.0);
    }
  }
  if (!fraction) return;
  throw StartupError(
      ExitCode::kData,
      "{}: its lines have no header and numbers from 0 to 1, which are shares of the image, as in "
      "YOLO's label files (class, x and y of the centre, width, height); write a header "
      "frame,class,x1,y1,x2,y2,score and corners in pixels",
      file.c_str());
}

/// Returns the name of a format with one file for each image, and the command that joins them.
/// `text` is a line of the file.
std::pair<std::string, std::string> formatOf(const std::filesystem::path& file,
                                             std::string_view text,
                                             const DetectionFileOptions& options) {
  const auto fields = split(text, ' ');
  const std::string name = R"(n=FILENAME; gsub(/.*\/|\.[a-z]*$/,"",n); )";
  if (file.extension() == ".xml") {
    return {"Pascal VOC's",
            "-v RS='<' -F'>' '{" + name +
                R"(} $1=="name"{c=$2} $1=="xmin"{a=$2} $1=="ymin"{b=$2} $1=="xmax"{d=$2} )"
                R"($1=="ymax"{e=$2} $1=="/bndbox"{print n","c","a","b","d","e",1"}')"};
  }
  if (fields.size() == 15 || fields.size() == 16) {
    return {"KITTI's", "'{" + name + R"(print n","$1","$5","$6","$7","$8","(NF>15?$16:1)}')"};
  }
  if ((fields.size() == 5 || fields.size() == 6) && parseNumbers(fields)) {
    return {"YOLO's",
            fmt::format(R"('{{{}print n","$1","($2-$4/2)*{}","($3-$5/2)*{}","($2+$4/2)*{}",)"
                        R"("($3+$5/2)*{}","(NF>5?$6:1)}}')",
                        name, options.width, options.height, options.width, options.height)};
  }
  return {};
}

}  // namespace

void refuseForeign(const std::filesystem::path& file, const std::vector<TextLine>& lines) {
  if (lines.empty()) return;
  refuseOtherFiles(file, lines.front().text);
  refuseShareLines(file, lines);
}

void refuseFolder(const DetectionFileOptions& options) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (!fs::is_directory(options.file, error)) return;
  constexpr std::uintmax_t kLargest = 1'000'000;  // bytes of the boxes of one image
  std::pair<std::string, std::string> format;
  std::string ending;
  for (const auto& entry : fs::directory_iterator(options.file, error)) {
    const auto size = entry.is_regular_file(error) ? entry.file_size(error) : 0;
    if (size == 0 || size > kLargest || !format.first.empty()) continue;
    const auto lines = readLines(entry.path(), "it holds boxes");
    if (!lines.empty()) format = formatOf(entry.path(), lines.front().text, options);
    ending = entry.path().extension().string();
  }
  if (format.first.empty()) return;
  throw StartupError(ExitCode::kData,
                     "{} is a folder of {} labels, one file for each image; join them: (echo "
                     "frame,class,x1,y1,x2,y2,score; awk {} '{}'/*{}) > boxes.csv{}",
                     options.file.c_str(), format.first, format.second, options.file.c_str(),
                     ending,
                     format.first == "YOLO's" ? ", with names in place of the class numbers" : "");
}

void refuseCorners(const DetectionFileOptions& options, const std::vector<TextLine>& lines) {
  constexpr std::size_t kLeast = 3;
  constexpr double kBorder = 2.0;  // px
  std::size_t from_second = 0, from_third = 0;
  bool inside = options.width > 0.0;
  const char separator = separatorOf(lines.front().text);
  for (const TextLine& line : lines) {
    const auto v = parseNumbers(split(line.text, separator));
    if (!v || v->size() < 7) return;
    const auto isBox = [&](std::size_t i) {
      return (*v)[i] < (*v)[i + 2] && (*v)[i + 1] < (*v)[i + 3];
    };
    from_second += isBox(1) && (*v)[5] >= 0.0 && (*v)[5] <= 1.0 ? 1 : 0;
    from_third += isBox(2) ? 1 : 0;
    inside = inside && (*v)[2] + (*v)[4] < options.width + kBorder &&
             (*v)[3] + (*v)[5] < options.height + kBorder;
  }
  const bool second = from_second == lines.size();
  if (!second && (lines.size() < kLeast || from_third < lines.size() || inside)) return;
  throw StartupError(
      ExitCode::kData,
      "{}: its lines have no header and corners in columns {}, not MOT's id, x, y, width, height; "
      "write a header frame,class,x1,y1,x2,y2,score and these columns",
      options.file.c_str(), second ? "2 to 5 with a score behind them" : "3 to 6");
}

}  // namespace perdure::replay
