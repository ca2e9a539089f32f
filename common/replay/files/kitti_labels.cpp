#include "common/replay/files/kitti_labels.h"

#include <cmath>

#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

constexpr double kLastFrame = 999999;  // KITTI's image names have six digits
constexpr double kMostCount = 1e6;

/// Returns whether frame, track, truncated and occluded can be converted to integers.
bool countsMakeSense(const std::vector<double>& v) {
  const auto within = [](double x) { return std::abs(x) <= kMostCount; };
  return v[0] >= 0 && v[0] <= kLastFrame && within(v[1]) && within(v[3]) && within(v[4]);
}

}  // namespace

std::vector<KittiLabel> readKittiLabels(const std::filesystem::path& file) {
  constexpr std::size_t kFields = 17;
  std::vector<KittiLabel> labels;
  Complaints wrong(file);
  for (const auto& line : readLines(file, "KITTI tracking keeps label_02/SEQUENCE.txt")) {
    auto fields = split(line.text, ' ');
    if (fields.size() != kFields) {
      wrong.add(line.number, "17 fields are expected: frame id type truncated occluded …");
      continue;
    }
    KittiLabel label;
    label.type = std::string(fields[2]);
    fields[2] = "0";
    const auto v = parseNumbers(fields);
    if (!v || !countsMakeSense(*v)) {
      wrong.add(line.number, "a field is not a number, or none that makes sense");
      continue;
    }
    label.frame = static_cast<std::uint64_t>((*v)[0]);
    label.track = static_cast<std::int64_t>((*v)[1]);
    label.truncated = static_cast<int>((*v)[3]);
    label.occluded = static_cast<int>((*v)[4]);
    label.box = Box{(*v)[6], (*v)[7], (*v)[8], (*v)[9]};
    label.height = (*v)[10], label.width = (*v)[11], label.length = (*v)[12];
    label.centre = Eigen::Vector3d((*v)[13], (*v)[14] - 0.5 * label.height, (*v)[15]);
    label.rotation_y = (*v)[16];
    labels.push_back(std::move(label));
  }
  wrong.throwIfAny();
  return labels;
}

}  // namespace perdure::replay
