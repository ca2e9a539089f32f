#include "common/replay/files/boxes/coco_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

using Json = nlohmann::json;

class CocoReader {
 public:
  CocoReader(const std::filesystem::path& file, const std::string& class_name,
             const std::map<std::string, std::uint64_t>& numbers)
      : file_(file), class_name_(class_name), numbers_(numbers) {}

  CocoBoxes read() {
    const Json json = Json::parse(std::ifstream(file_), nullptr, false);
    if (json.is_discarded()) {
      std::string line;
      std::getline(std::ifstream(file_), line);
      refuse(Json::accept(line) ? "has a JSON document in each line; write one list of them"
                                : "is no whole JSON document; write it again");
    }
    const Json& boxes = json.is_array() ? json : memberOf(json, "annotations");
    if (!boxes.is_array()) refuse("is no list of COCO's results and has no `annotations`");
    if (json.is_object()) readTables(json);
    for (std::size_t i = 0; i < boxes.size(); ++i) take(boxes[i], fmt::format("annotation {}", i));
    if (!named_) countFromZero();
    return std::move(result_);
  }

 private:
  [[noreturn]] void refuse(const std::string& why, ExitCode code = ExitCode::kData) const {
    throw StartupError(code, file_.string() + " " + why);
  }

  [[noreturn]] void refuseKeys(const Json& annotation) const {
    std::string keys;
    if (annotation.is_object()) {
      for (const auto& [key, value] : annotation.items()) keys += (keys.empty() ? "" : ", ") + key;
    }
    refuse("is not COCO's JSON: its boxes have the keys " + (keys.empty() ? "(none)" : keys) +
           ", COCO's have image_id, category_id, bbox ([x, y, width, height]) and score; convert "
           "it, or write a table with the header frame,class,x1,y1,x2,y2,score");
  }

  /// Returns a null value if the member is missing.
  static const Json& memberOf(const Json& object, const char* name) {
    static const Json kNone;
    const auto found = object.is_object() ? object.find(name) : object.end();
    return found == object.end() ? kNone : *found;
  }

  void readTables(const Json& json) {
    for (const Json& category : memberOf(json, "categories")) {
      const Json& name = memberOf(category, "name");
      if (name.is_string()) names_[memberOf(category, "id").dump()] = name.get<std::string>();
    }
    const Json& images = memberOf(json, "images");
    if (!images.is_array() && !images.is_null()) refuse("has `images` that are no list");
    if (!images.empty()) result_.frames.emplace();
    named_ = std::any_of(images.begin(), images.end(),
                         [&](const Json& image) { return numbers_.contains(stemOf(image)); });
    for (const Json& image : images) {
      const std::uint64_t frame = frameOfImage(image);
      if (!frames_.emplace(memberOf(image, "id").dump(), frame).second) {
        refuse("has two `images` with the id " + memberOf(image, "id").dump());
      }
      if (!result_.frames->insert(frame).second && frame != kNoFrame) {
        refuse(
            fmt::format("has two `images` of frame {}, the second is {}; give the boxes of one "
                        "camera of one drive",
                        frame, memberOf(image, "file_name").dump()));
      }
    }
  }

  static std::string stemOf(const Json& image) {
    const Json& name = memberOf(image, "file_name");
    return name.is_string() ? std::filesystem::path(name.get<std::string>()).stem().string() : "";
  }

  std::uint64_t frameOfImage(const Json& image) const {
    const std::string stem = stemOf(image);
    if (named_) {
      const auto found = numbers_.find(stem);
      return found == numbers_.end() ? kNoFrame : found->second;
    }
    const auto number = parseInteger(stem.substr(stem.find_last_not_of("0123456789") + 1));
    return number ? static_cast<std::uint64_t>(*number) : frameOf(image, "id");
  }

  /// Subtracts 1 from all frames if they certainly count from 1. Adds a note if they may do so.
  void countFromZero() {
    std::set<std::uint64_t> frames = result_.frames.value_or(std::set<std::uint64_t>());
    for (const CocoBox& box : result_.boxes) frames.insert(box.frame);
    if (frames.empty() || *frames.begin() != 1) return;
    std::uint64_t last = 0;
    for (const auto& [name, number] : numbers_) last = std::max(last, number);
    const bool beyond = !numbers_.empty() && *frames.rbegin() == last + 1;
    const bool ends_with_drive = !numbers_.empty() && *frames.rbegin() == last;
    const bool complete = result_.frames && *frames.rbegin() == frames.size();
    if (!beyond && (!complete || ends_with_drive)) {
      result_.note =
          "its frames begin at 1 and are taken as counted from 0; if they count from 1, "
          "subtract 1 from each";
      return;
    }
    for (CocoBox& box : result_.boxes) --box.frame;
    if (result_.frames) {
      result_.frames->clear();
      for (const std::uint64_t frame : frames) result_.frames->insert(frame - 1);
    }
    result_.note =
        fmt::format("its frames are 1 … {}: they count from 1 and were read so", *frames.rbegin());
  }

  std::uint64_t frameOf(const Json& object, const char* name) const {
    const Json& id = memberOf(object, name);
    if (id.is_number_unsigned()) return id.get<std::uint64_t>();
    refuse(fmt::format("has `{}`: {}; it must be the number of a frame of the drive, from 0", name,
                       id.dump()));
  }

  void take(const Json& annotation, const std::string& name) {
    CocoBox box;
    box.name = name;
    if (!annotation.contains("image_id")) refuseKeys(annotation);
    const auto image = frames_.find(memberOf(annotation, "image_id").dump());
    box.frame = image != frames_.end() ? image->second : frameOf(annotation, "image_id");
    box.class_name = classOf(memberOf(annotation, "category_id"));
    const Json& sides = memberOf(annotation, "bbox");
    const bool whole =
        sides.is_array() && sides.size() == 4 &&
        std::all_of(sides.begin(), sides.end(), [](const Json& side) { return side.is_number(); });
    if (!whole) refuse("has " + name + " without `bbox`: [x, y, width, height]");
    const auto v = sides.get<std::vector<double>>();
    if (!(v[2] > 0.0 && v[3] > 0.0)) {
      refuse("has " + name + " with a `bbox` whose width or height is not above 0");
    }
    box.box = {v[0], v[1], v[0] + v[2], v[1] + v[3]};
    const Json& score = memberOf(annotation, "score");
    if (!score.is_number() && !score.is_null()) {
      refuse("has " + name + " with `score`: " + score.dump() + "; it is a number from 0 to 1");
    }
    if (score.is_number()) box.score = score.get<double>();
    result_.boxes.push_back(std::move(box));
  }

  std::string classOf(const Json& category) {
    const auto name = names_.find(category.dump());
    if (name != names_.end()) return name->second;
    unnamed_.insert(category.dump());
    if (unnamed_.size() == 1 && !class_name_.empty()) return class_name_;
    refuse(fmt::format("has no name of category {}: {}, or add `categories`: {{\"categories\": "
                       "[{{\"id\": {}, \"name\": \"car\"}}, …], \"annotations\": […]}}",
                       category.dump(),
                       unnamed_.size() > 1 ? "--class names one category only"
                                           : "give --class NAME if there is one category",
                       category.dump()),
           ExitCode::kUsage);
  }

  const std::filesystem::path& file_;
  const std::string& class_name_;
  /// Frame numbers of the drive, by image name.
  const std::map<std::string, std::uint64_t>& numbers_;
  bool named_ = false;  ///< at least one image has the name of an image of the drive
  std::map<std::string, std::string> names_;     ///< category id to class name
  std::map<std::string, std::uint64_t> frames_;  ///< image id to frame
  std::set<std::string> unnamed_;                ///< categories without a name
  CocoBoxes result_;
};

}  // namespace

bool looksLikeCoco(std::string_view first_line) {
  return first_line.starts_with('[') || first_line.starts_with('{');
}

CocoBoxes readCoco(const std::filesystem::path& file, const std::string& class_name,
                   const std::map<std::string, std::uint64_t>& numbers) {
  return CocoReader(file, class_name, numbers).read();
}

}  // namespace perdure::replay
