// A Darknet network written at run time: a 64×64 input, 2×2 cells, one anchor, two classes. Its
// output does not depend on the image, so that the expected result is known exactly.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace perdure::inference::testing {

struct TinyModel {
  std::vector<float> head = {0.0F, 0.0F, 0.0F, 0.0F, 2.0F, 3.0F, -1.0F};  ///< x y w h obj c1 c2
  double anchor_width = 16, anchor_height = 8;
  int classes_in_json = 2;

  /// Writes tiny.cfg, tiny.weights and tiny.cfg.model.json; returns the path of tiny.cfg.
  std::string write(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    const auto cfg = folder / "tiny.cfg";
    std::ofstream(cfg) << "[net]\nwidth=64\nheight=64\nchannels=3\nbatch=1\n\n"
                          "[convolutional]\nfilters=7\nsize=1\nstride=32\npad=0\n"
                          "activation=linear\n\n"
                          "[yolo]\nmask=0\nanchors=16,8\nclasses=2\nnum=1\n";
    std::ofstream weights(folder / "tiny.weights", std::ios::binary);
    const std::int32_t header[5] = {0, 2, 0, 0, 0};  // version 0.2.0 and a 64-bit count
    weights.write(reinterpret_cast<const char*>(header), sizeof header);
    std::vector<float> values = head;  // biases, then 7×3 weights
    values.resize(head.size() + 7 * 3, 0.0F);
    weights.write(reinterpret_cast<const char*>(values.data()),
                  static_cast<std::streamsize>(values.size() * sizeof(float)));
    std::ofstream(cfg.string() + ".model.json") << json();
    return cfg.string();
  }

  std::string json() const {
    return R"({"name": "tiny", "family": "yolo-fastest",
      "input": {"width": 64, "height": 64, "fit": "resize", "colour": "rgb", "scale": 0.00392},
      "classes": )" +
           std::string(classes_in_json == 2 ? R"(["Car", "person"])" : R"(["car"])") +
           R"(, "activation": {"class": "sigmoid"},
      "levels": [{"stride": 32, "tensor": "permute_1", "anchors": [[)" +
           std::to_string(anchor_width) + "," + std::to_string(anchor_height) + "]]}]}";
  }
};

}  // namespace perdure::inference::testing
