#include "common/replay/files/boxes/detection_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/errors.h"
#include "common/base/result.h"
#include "common/replay/files/boxes/foreign_boxes.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

/// Positions of the fields in a row.
struct Columns {
  std::size_t frame = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0, score = 0, count = 0;
  char separator = ',';
  bool mot = false;  ///< x2 and y2 are width and height, and frames count from 1
  std::optional<std::size_t> class_name, azimuth;
  std::optional<std::size_t> sigma_azimuth;
  std::optional<std::array<std::size_t, 4>> sigmas;
  std::vector<std::pair<std::size_t, std::string>> logits;
};

constexpr std::size_t kKitti = 17;  ///< fields of KITTI tracking's labels

Columns readHeader(const std::filesystem::path& file, const TextLine& line,
                   const ClassAliases& aliases) {
  Columns columns;
  Complaints wrong(file);
  std::map<std::string, std::size_t> at;
  std::string_view text = line.text;
  if (text.starts_with('#')) text.remove_prefix(1);
  columns.separator = separatorOf(text);
  const auto names = split(text, columns.separator);
  columns.count = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = toLower(names[i]);
    if (!at.emplace(name, i).second) wrong.add(line.number, "column " + name + " is there twice");
    if (name.starts_with("alpha") || name.starts_with("azimuth")) columns.azimuth = i;
    if (name.starts_with("logit:"))
      columns.logits.emplace_back(i, aliases.canonical(name.substr(6)));
  }
  const auto need = [&](const std::string& name) -> std::size_t {
    const auto found = at.find(name);
    if (found != at.end()) return found->second;
    wrong.add(line.number, "column " + name + " is missing; the header is " +
                               "frame,class,x1,y1,x2,y2,score[,azimuth][,logit:<class>]");
    return 0;
  };
  if (!at.contains("xmax") && (at.contains("w") || at.contains("width"))) {
    wrong.add(line.number, "a width and a height are no corner: write x2 = x1 + w, y2 = y1 + h");
  }
  columns.frame = need("frame");
  columns.x1 = need("x1"), columns.y1 = need("y1");
  columns.x2 = need("x2"), columns.y2 = need("y2");
  columns.score = need("score");
  columns.class_name = need("class");
  if (at.contains("sigma_azimuth")) columns.sigma_azimuth = at["sigma_azimuth"];
  if (at.contains("sigma_x1")) {
    columns.sigmas = {need("sigma_x1"), need("sigma_y1"), need("sigma_x2"), need("sigma_y2")};
  }
  wrong.throwIfAny();
  return columns;
}

/// Returns whether a line is KITTI tracking's: frame, id, type, …, with or without a score.
bool isKitti(const TextLine& line) {
  const auto fields = split(line.text, ' ');
  return (fields.size() == kKitti || fields.size() == kKitti + 1) && !parseNumber(fields[2]);
}

Columns headerlessColumns(const TextLine& line) {
  constexpr std::size_t kRrc = 6, kLeastOfMot = 7, kMostOfMot = 10;
  Columns columns;
  columns.separator = separatorOf(line.text);
  columns.count = split(line.text, columns.separator).size();
  if (isKitti(line)) {
    columns.class_name = 2, columns.score = kKitti;
    columns.x1 = 6, columns.y1 = 7, columns.x2 = 8, columns.y2 = 9;
    return columns;
  }
  columns.mot = columns.count >= kLeastOfMot && columns.count <= kMostOfMot;
  if (!columns.mot) columns.count = kRrc;
  const std::size_t x1 = columns.mot ? 2 : 1;
  columns.x1 = x1, columns.y1 = x1 + 1, columns.x2 = x1 + 2, columns.y2 = x1 + 3;
  columns.score = x1 + 4;
  return columns;
}

/// Writes the numbers into `row`. Returns the error in them, or an empty string.
std::string fillBox(const Box& box, double score, const DetectionFileOptions& options,
                    DetectionFile::Row& row) {
  if (box.x2 <= box.x1 || box.y2 <= box.y1) {
    return "x1 < x2 and y1 < y2: corners in this order, not a corner or a centre with a size";
  }
  if (!(score >= 0 && score <= 1)) return "score is a number from 0 to 1";
  const double o = options.box_origin;
  row.detection.box = Box{box.x1 - o, box.y1 - o, box.x2 - o, box.y2 - o};
  const double clipped = std::clamp(score, options.score_floor, 1.0 - options.score_floor);
  row.logit = std::log(clipped / (1.0 - clipped));
  row.score = score;
  return {};
}

std::string fillBox(const std::vector<std::string_view>& fields, const Columns& columns,
                    const DetectionFileOptions& options, DetectionFile::Row& row) {
  const auto x1 = parseNumber(fields[columns.x1]), y1 = parseNumber(fields[columns.y1]);
  const auto x2 = parseNumber(fields[columns.x2]), y2 = parseNumber(fields[columns.y2]);
  const bool scored = columns.score < fields.size();  // labels are certain
  const auto score = scored ? parseNumber(fields[columns.score]) : 1.0;
  if (!score && fields[columns.score].find(',') != std::string_view::npos) {
    return std::string(fields[columns.score]) + " has a decimal comma; write a point";
  }
  if (!x1 || !y1 || !x2 || !y2) return "x1, y1, x2 and y2 are finite numbers, in pixels";
  if (!score) return "score is a number from 0 to 1";
  const bool mot = columns.mot;
  return fillBox(Box{*x1, *y1, mot ? *x1 + *x2 : *x2, mot ? *y1 + *y2 : *y2}, *score, options, row);
}

std::string fillEvidence(const std::vector<std::string_view>& fields, const Columns& columns,
                         const DetectionFileOptions& options, DetectionFile::Row& row) {
  if (columns.azimuth && !fields[*columns.azimuth].empty()) {
    const auto azimuth = parseNumber(fields[*columns.azimuth]);
    if (!azimuth || std::abs(*azimuth) > 7.0) return "azimuth is in radians, or empty";
    row.detection.azimuth = *azimuth;
    row.detection.azimuth_sigma = options.azimuth_sigma;
    if (columns.sigma_azimuth && !fields[*columns.sigma_azimuth].empty()) {
      const auto sigma = parseNumber(fields[*columns.sigma_azimuth]);
      if (!sigma || *sigma <= 0.0) return "sigma_azimuth is above 0, in radians, or empty";
      row.detection.azimuth_sigma = *sigma;
    }
  }
  for (std::size_t i = 0; columns.sigmas && i < 4; ++i) {
    const auto field = fields[(*columns.sigmas)[i]];
    if (field.empty()) continue;
    const auto sigma = parseNumber(field);
    if (!sigma || *sigma < 0.0) return "sigma_x1 to sigma_y2 are 0 or more pixels, or empty";
    row.detection.side_sigma[i] = *sigma;
  }
  if (columns.logits.empty()) return {};
  row.detection.activations = {0.0F};
  for (const auto& [column, name] : columns.logits) {
    const auto logit = parseNumber(fields[column]);
    if (!logit) return "logit:" + name + " is a finite number";
    row.detection.activations.push_back(static_cast<float>(*logit));
  }
  return {};
}

std::optional<std::set<std::uint64_t>> readFrameList(std::filesystem::path file) {
  file.replace_extension(".frames");
  if (!std::filesystem::exists(file)) return std::nullopt;
  std::set<std::uint64_t> frames;
  Complaints wrong(file);
  for (const auto& line : readLines(file, "it lists the frames that have detections")) {
    for (const auto field : split(line.text, ' ')) {
      const auto frame = parseInteger(field);
      if (!frame || *frame < 0) {
        wrong.add(line.number, "write frame numbers from 0, separated by blanks or lines");
      } else {
        frames.insert(static_cast<std::uint64_t>(*frame));
      }
    }
  }
  wrong.throwIfAny();
  return frames;
}

bool isHeaderless(const std::vector<TextLine>& lines, const DetectionFileOptions& options) {
  if (lines.empty()) {
    throw StartupError(
        ExitCode::kData,
        options.file.string() + " is empty; it begins with a header frame,class,x1,y1,x2,y2,score");
  }
  if (!parseNumber(fieldsOf(lines[0].text)[0])) return false;
  if (isKitti(lines[0])) return true;
  if (options.class_name.empty()) {
    throw StartupError(ExitCode::kUsage, options.file.string() +
                                             " has no header: say the class of its boxes with "
                                             "--class (for example --class Car)");
  }
  return true;
}

/// Returns the number of a frame that is given by its number, which begins at `first`, or by the
/// name of its image. Names that are possible numbers count as numbers.
std::optional<std::int64_t> frameOf(std::string_view field, int first,
                                    const std::map<std::string, std::uint64_t>& numbers) {
  const auto number = parseInteger(field);
  if (number && *number - first < static_cast<std::int64_t>(numbers.size())) return *number - first;
  const auto named = numbers.find(std::filesystem::path(field).stem().string());
  if (named != numbers.end()) return static_cast<std::int64_t>(named->second);
  return number ? std::optional(*number - first) : std::nullopt;
}

using NumberedRow = std::pair<std::uint64_t, DetectionFile::Row>;

Result<NumberedRow> readRow(const std::string& text, const Columns& columns,
                            const DetectionFileOptions& options, const ClassAliases& aliases) {
  const auto fields = split(text, columns.separator);
  if (fields.size() != columns.count) {
    return fail("detection_malformed",
                std::to_string(fields.size()) + " fields; " + std::to_string(columns.count) +
                    " are expected (frame,x1,y1,x2,y2,score without a header; MOT's lines have 7 "
                    "to 10)");
  }
  const auto frame = frameOf(fields[columns.frame], columns.mot ? 1 : 0, options.numbers);
  if (!frame || *frame < 0) {
    return fail("detection_malformed", "frame is a whole number from {}", columns.mot ? 1 : 0);
  }
  DetectionFile::Row row;
  row.class_name =
      aliases.canonical(columns.class_name ? fields[*columns.class_name] : options.class_name);
  if (row.class_name.empty()) return fail("detection_malformed", "class is empty");
  std::string error = fillBox(fields, columns, options, row);
  if (error.empty()) error = fillEvidence(fields, columns, options, row);
  if (!error.empty()) return fail("detection_malformed", error);
  return NumberedRow(static_cast<std::uint64_t>(*frame), std::move(row));
}

}  // namespace

DetectionFile DetectionFile::read(const DetectionFileOptions& options,
                                  const ClassAliases& aliases) {
  refuseFolder(options);
  const auto lines =
      readLines(options.file, "--detections takes `model`, `none` or a file of boxes");
  DetectionFile result;
  result.options_ = options;
  result.listed_frames_ = readFrameList(options.file);
  if (!lines.empty() && looksLikeCoco(lines.front().text)) {
    result.takeCoco(readCoco(options.file, options.class_name, options.numbers), aliases);
  } else {
    result.takeLines(lines, aliases);
  }
  result.noteClasses();
  result.refuseShares();
  return result;
}

void DetectionFile::takeCoco(const CocoBoxes& coco, const ClassAliases& aliases) {
  Complaints wrong(options_.file);
  for (const CocoBox& box : coco.boxes) {
    Row row;
    row.class_name = aliases.canonical(box.class_name);
    const std::string error = fillBox(box.box, box.score, options_, row);
    if (!error.empty())
      wrong.add(fmt::format("{}: {}: {}", options_.file.c_str(), box.name, error));
    rows_[box.frame].push_back(std::move(row));
  }
  wrong.throwIfAny();
  if (!listed_frames_) listed_frames_ = coco.frames;
  note_ = coco.note;
}

void DetectionFile::takeLines(const std::vector<TextLine>& lines, const ClassAliases& aliases) {
  const DetectionFileOptions& options = options_;
  refuseForeign(options.file, lines);
  const bool headerless = isHeaderless(lines, options);
  const Columns columns =
      headerless ? headerlessColumns(lines[0]) : readHeader(options.file, lines[0], aliases);
  if (columns.mot) refuseCorners(options, lines);
  for (const auto& [column, name] : columns.logits) logit_classes_.push_back(name);
  Complaints wrong(options.file);
  for (std::size_t i = headerless ? 0 : 1; i < lines.size(); ++i) {
    const auto row = readRow(lines[i].text, columns, options, aliases);
    if (row && row->second.class_name == "dontcare") continue;  // KITTI: no statement
    if (row) {
      rows_[row->first].push_back(row->second);
    } else {
      wrong.add(lines[i].number, row.error().detail);
    }
  }
  wrong.throwIfAny();
  if (headerless && !columns.class_name)
    first_seen_.emplace_back(0, aliases.canonical(options.class_name));
}

void DetectionFile::noteClasses() {
  for (const auto& [frame, rows] : rows_) {
    for (const auto& row : rows) {
      const bool known = std::any_of(first_seen_.begin(), first_seen_.end(),
                                     [&](const auto& c) { return c.second == row.class_name; });
      if (!known) first_seen_.emplace_back(frame, row.class_name);
    }
  }
}

std::vector<std::string> DetectionFile::classesAt(std::uint64_t frame) const {
  if (!logit_classes_.empty()) return logit_classes_;
  std::vector<std::string> classes;
  for (const auto& [first, name] : first_seen_) {
    if (first <= frame) classes.push_back(name);
  }
  return classes;
}

std::map<std::string, std::size_t> DetectionFile::classCounts() const {
  std::map<std::string, std::size_t> counts;
  for (const auto& [frame, rows] : rows_) {
    for (const Row& row : rows) ++counts[row.class_name];
  }
  return counts;
}

std::size_t DetectionFile::rows() const {
  std::size_t count = 0;
  for (const auto& [frame, rows] : rows_) count += rows.size();
  return count;
}

std::size_t DetectionFile::rowsBeyond(std::uint64_t last) const {
  std::size_t count = 0;
  for (auto row = rows_.upper_bound(last); row != rows_.end(); ++row) count += row->second.size();
  return count;
}

ModelInfo DetectionFile::modelAt(std::uint64_t frame) const {
  ModelInfo model;
  model.name = options_.file.filename().string();
  model.classes = classesAt(frame);
  std::string identity = "detections of a file";
  for (const auto& name : model.classes) identity += '\n' + name;
  model.boxes = options_.boxes;
  model.hash = digest(identity);
  return model;
}

std::optional<std::vector<Detection>> DetectionFile::at(std::uint64_t frame) const {
  if (listed_frames_ && !listed_frames_->contains(frame)) return std::nullopt;
  std::vector<Detection> detections;
  const auto rows = rows_.find(frame);
  if (rows == rows_.end()) return detections;
  const auto classes = classesAt(frame);
  const double floor = std::log(options_.score_floor / (1.0 - options_.score_floor));
  for (const auto& row : rows->second) {
    Detection detection = row.detection;
    if (logit_classes_.empty()) {
      detection.activations = {0.0F};
      for (const auto& name : classes) {
        detection.activations.push_back(
            static_cast<float>(name == row.class_name ? row.logit : floor));
      }
    }
    detections.push_back(std::move(detection));
  }
  return detections;
}

}  // namespace perdure::replay
