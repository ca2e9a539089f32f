#include "tools/detect/detect.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <ostream>
#include <vector>

#include "common/base/algorithms/median.h"
#include "common/base/checked_file.h"
#include "common/replay/dataset.h"
#include "services/inference/node.h"

namespace perdure::tools {
namespace {

double cpuMs() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

void writeDetectionHeader(std::ostream& out, const ModelInfo& model) {
  out << "frame,class,x1,y1,x2,y2,score,azimuth,sigma_azimuth,sigma_x1,sigma_y1,sigma_x2,sigma_y2";
  for (const std::string& name : model.classes) out << ",logit:" << name;
  out << '\n';
}

void writeDetection(std::ostream& out, const ModelInfo& model, std::uint64_t frame,
                    const Detection& detection) {
  const auto& a = detection.activations;
  const auto best = std::max_element(a.begin() + 1, a.end());
  const double highest = *std::ranges::max_element(a);
  double sum = 0.0;
  for (const float value : a) sum += std::exp(value - highest);
  const auto k = static_cast<std::size_t>(best - a.begin()) - 1;
  const Box& b = detection.box;
  out << frame << ',' << model.classes.at(k) << ',' << b.x1 << ',' << b.y1 << ',' << b.x2 << ','
      << b.y2 << ',' << std::exp(*best - highest) / sum << ',';
  if (detection.azimuth) out << *detection.azimuth << ',' << detection.azimuth_sigma;
  if (!detection.azimuth) out << ',';
  for (const double sigma : detection.side_sigma) {
    out << ',';
    if (sigma > 0.0) out << sigma;
  }
  for (std::size_t i = 1; i < a.size(); ++i) out << ',' << a[i];
  out << '\n';
}

DetectSummary detect(const DetectOptions& options,
                     const std::function<void(std::uint64_t, std::uint64_t)>& report) {
  replay::DatasetOptions data;
  data.path = options.data;
  data.sequence = options.sequence;
  const auto dataset = replay::Dataset::open(data);
  inference::Node node(options.inference, 1);
  CheckedFile file(options.out);
  std::ostream& out = file.stream();
  out.precision(7);
  writeDetectionHeader(out, node.model());
  DetectSummary summary;
  std::vector<double> times;
  const std::string camera = dataset->calibration().cameras.front().name;
  while (const auto message = dataset->next()) {
    const Frame* frame = std::get_if<Frame>(&*message);
    if (frame == nullptr || frame->camera != camera) continue;
    const double before = cpuMs();
    const auto answer = node.infer(*frame);
    times.push_back(cpuMs() - before);
    ++summary.frames;
    if (answer) {
      summary.boxes += answer->detections.size();
      for (const auto& d : answer->detections) {
        writeDetection(out, node.model(), frame->stamp.sequence, d);
      }
    } else {
      ++summary.failed;
    }
    if (report) report(summary.frames, dataset->frameCount());
  }
  file.close();
  summary.cpu_ms_median = medianOf(std::move(times));
  return summary;
}

}  // namespace perdure::tools
