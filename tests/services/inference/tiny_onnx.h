// An ONNX network of the family perdure, written at run time: a 64×48 input, one stride of 32 (2×2
// cells, the lower ones cross the border), two classes, four bins. The expected result is known
// exactly, because it is constant or depends only on the image's brightness.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace perdure::inference::testing {

/// The part of protobuf's wire format that onnx.proto needs here.
class Protobuf {
 public:
  Protobuf& number(int field, std::uint64_t value) {
    varint(static_cast<std::uint64_t>(field) << 3);
    varint(value);
    return *this;
  }
  Protobuf& bytes(int field, const std::string& value) {
    varint(static_cast<std::uint64_t>(field) << 3 | 2);
    varint(value.size());
    text_ += value;
    return *this;
  }
  Protobuf& message(int field, const Protobuf& value) { return bytes(field, value.text_); }
  const std::string& text() const { return text_; }

 private:
  void varint(std::uint64_t value) {
    for (; value > 127; value >>= 7) text_ += static_cast<char>(value % 128 + 128);
    text_ += static_cast<char>(value);
  }
  std::string text_;
};

struct TinyOnnx {
  std::vector<float> box = {0.5F, 1.0F, -0.5F, 2.0F};        ///< left, top, right, bottom
  std::vector<float> logits = {0.0F, 1.0F, -2.0F};           ///< background, car, person
  std::vector<float> azimuth = {0, 6, 0, 0, 0, 0.5F, 0, 0};  ///< bins, residuals
  /// Added to each output per unit of brightness of the cell's corner pixel; empty: 0.
  std::vector<float> box_by_light, logits_by_light;
  /// Adds an operator that OpenCV does not have: the boxes pass through ReverseSequence unchanged.
  bool for_other_runtimes = false;
  std::string name = "tiny", classes_json = R"(["car", "person"])";
  std::string azimuth_json = R"("azimuth": {"bins": 4, "sigma": 0.2, "classes": ["car"]},)";

  /// Writes tiny.onnx and tiny.onnx.model.json; returns the path of tiny.onnx.
  std::string write(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    const std::string path = (folder / "tiny.onnx").string();
    std::ofstream(path, std::ios::binary) << onnx();
    std::ofstream(path + ".model.json") << json();
    return path;
  }

  std::string json() const {
    return R"({"family": "perdure", "name": ")" + name + R"(",
      "input": {"width": 64, "height": 48, "fit": "letterbox_top_left", "colour": "rgb"},
      "classes": )" +
           classes_json + ", " + azimuth_json +
           R"( "calibration": {"temperature": 2.0, "clutter_rate": 0.75},
      "levels": [{"stride": 32, "box": "box32", "logits": "logits32", "azimuth": "azimuth32"}]})";
  }

 private:
  static Protobuf tensor(const std::string& name, const std::vector<std::uint64_t>& dims,
                         const std::vector<float>& values) {
    Protobuf p;
    for (const auto d : dims) p.number(1, d);
    p.number(2, 1).bytes(8, name);  // float32
    const auto* raw = reinterpret_cast<const char*>(values.data());
    return p.bytes(9, std::string(raw, values.size() * sizeof(float)));
  }
  static Protobuf value(const std::string& name, const std::vector<std::uint64_t>& dims) {
    Protobuf shape;
    for (const auto d : dims) shape.message(1, Protobuf().number(1, d));
    const auto type = Protobuf().number(1, 1).message(2, shape);
    return Protobuf().bytes(1, name).message(2, Protobuf().message(1, type));
  }
  /// Adds a 1×1 convolution of stride 32; its output in every cell is `bias` + `light` · pixel.
  static void addHead(Protobuf& graph, const std::string& name, const std::vector<float>& bias,
                      const std::vector<float>& light = {}) {
    const auto n = static_cast<std::uint64_t>(bias.size());
    Protobuf node;
    node.bytes(1, "images").bytes(1, name + ".w").bytes(1, name + ".b").bytes(2, name);
    node.bytes(3, "node_" + name).bytes(4, "Conv");
    const auto ints = [](const char* key, std::uint64_t v) {
      return Protobuf().bytes(1, key).number(8, v).number(8, v).number(20, 7);
    };
    node.message(5, ints("kernel_shape", 1)).message(5, ints("strides", 32));
    graph.message(1, node);
    std::vector<float> weights(bias.size() * 3);
    for (std::size_t i = 0; i < light.size(); ++i) weights[3 * i] = light[i];
    graph.message(5, tensor(name + ".w", {n, 3, 1, 1}, weights));
    graph.message(5, tensor(name + ".b", {n}, bias));
    graph.message(12, value(name, {1, n, 2, 2}));
  }
  /// Adds an operator without effect: it reverses four sequences of length one.
  static void addReverseSequence(Protobuf& graph, const std::string& from, const std::string& to) {
    Protobuf node, lengths;
    node.bytes(1, from).bytes(1, to + ".lengths").bytes(2, to).bytes(3, "node_" + to);
    graph.message(1, node.bytes(4, "ReverseSequence"));
    lengths.number(1, 4).number(2, 7).bytes(8, to + ".lengths");  // int64
    std::string ones;
    for (int i = 0; i < 4; ++i) ones += '\1' + std::string(7, '\0');
    graph.message(5, lengths.bytes(9, ones));
    graph.message(12, value(to, {1, 4, 2, 2}));
  }
  std::string onnx() const {
    Protobuf graph;
    graph.bytes(2, "tiny");
    addHead(graph, for_other_runtimes ? "box" : "box32", box, box_by_light);
    if (for_other_runtimes) addReverseSequence(graph, "box", "box32");
    addHead(graph, "logits32", logits, logits_by_light);
    addHead(graph, "azimuth32", azimuth);
    graph.message(11, value("images", {1, 3, 48, 64}));
    return Protobuf().number(1, 6).message(7, graph).message(8, Protobuf().number(2, 11)).text();
  }
};

}  // namespace perdure::inference::testing
