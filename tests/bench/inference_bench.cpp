// Measures the cost of inference without the network's forward pass: decoding, suppression,
// top-down answers, serialisation, and the conversion of the image. The inputs are raw heads of
// 416×416 networks with the density of a busy street (seeded).
#include <benchmark/benchmark.h>

#include <random>

#include "common/wire/codec.h"
#include "services/inference/core/decode/decode.h"
#include "services/inference/core/decode/prime.h"
#include "services/inference/core/decode/suppress.h"
#include "services/inference/core/network/image_fit.h"

namespace {

using namespace perdure;
using namespace perdure::inference;

constexpr int kSide = 416;
constexpr double kLax = 0.05, kFloor = 0.002;

/// Heads of YOLOX with 80 classes, or of the project's own family with 8 classes.
struct Heads {
  ModelDescription model;
  std::vector<std::vector<float>> values;
  std::vector<Tensor> tensors;
  DecodeOptions options;

  void add(std::vector<int> shape, std::vector<float> v) {
    values.push_back(std::move(v));
    tensors.push_back({std::move(shape), {}});
  }
  void seal() {
    for (std::size_t i = 0; i < tensors.size(); ++i) tensors[i].values = values[i];
    for (std::size_t k = 0; k < model.classes.size(); ++k) options.wanted.push_back(k);
    model.calibration = {.temperature = 1.3, .clutter_rate = 0.7};
    model.calibration.primed = {.floor = kFloor, .slope = 0.3, .offset = 4.0, .nothing = -0.4};
  }
};

/// 40 objects, each of which activates a patch of cells of one stride.
struct Things {
  std::mt19937 random{11};
  std::normal_distribution<float> normal;

  std::vector<float> patches(int cells, float background, float peak) {
    std::vector<float> plane(static_cast<std::size_t>(cells * cells));
    for (float& v : plane) v = background + 1.5F * normal(random);
    std::uniform_int_distribution<int> at(1, cells - 2);
    for (int thing = 0; thing < 13; ++thing) {
      const int x = at(random), y = at(random);
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          plane[static_cast<std::size_t>((y + dy) * cells + x + dx)] = peak + normal(random);
        }
      }
    }
    return plane;
  }
  std::vector<float> noise(std::size_t count, float mean, float sigma) {
    std::vector<float> v(count);
    for (float& value : v) value = mean + sigma * normal(random);
    return v;
  }
};

Heads yolox() {
  Heads heads;
  Things things;
  heads.model.family = Family::kYolox;
  heads.model.input = {.width = kSide, .height = kSide, .fit = Fit::kLetterboxTopLeft};
  for (int k = 0; k < 80; ++k) heads.model.classes.push_back("class" + std::to_string(k));
  for (const int stride : {8, 16, 32}) {
    const int n = kSide / stride;
    const auto cells = static_cast<std::size_t>(n * n);
    heads.model.levels.emplace_back();
    heads.model.levels.back().stride = stride;
    heads.add({1, 4, n, n}, things.noise(4 * cells, 0.7F, 0.3F));
    heads.add({1, 1, n, n}, things.patches(n, -8.5F, 0.5F));
    heads.add({1, 80, n, n}, things.noise(80 * cells, -3.0F, 1.5F));
  }
  heads.seal();
  return heads;
}

Heads perdureFamily() {
  Heads heads;
  Things things;
  heads.model.family = Family::kPerdure;
  heads.model.input = {.width = kSide, .height = kSide, .fit = Fit::kLetterboxTopLeft};
  heads.model.azimuth = {.bins = 12, .sigma = 0.2, .classes = {"class0", "class1"}};
  heads.model.spread_scale = 1.0;
  heads.model.class_softmax = true;
  heads.model.background = Background::kFirst;
  for (int k = 0; k < 8; ++k) heads.model.classes.push_back("class" + std::to_string(k));
  for (const int stride : {8, 16, 32}) {
    const int n = kSide / stride;
    const auto cells = static_cast<std::size_t>(n * n);
    heads.model.levels.emplace_back();
    heads.model.levels.back().stride = stride;
    heads.add({1, 4, n, n}, things.noise(4 * cells, 1.5F, 0.5F));
    auto logits = things.noise(9 * cells, -6.0F, 1.0F);
    const auto peaks = things.patches(n, -6.0F, 3.5F);
    for (std::size_t i = 0; i < cells; ++i) logits[i] = 4.0F, logits[cells + i] = peaks[i];
    heads.add({1, 9, n, n}, std::move(logits));
    heads.add({1, 24, n, n}, things.noise(24 * cells, 0.0F, 1.0F));
    heads.add({1, 4, n, n}, things.noise(4 * cells, 0.0F, 0.5F));
  }
  heads.seal();
  return heads;
}

const Heads& headsOf(int family) {
  static const Heads kYolox = yolox(), kOwn = perdureFamily();
  return family == 0 ? kYolox : kOwn;
}

std::vector<Candidate> candidatesOf(const Heads& heads, double floor) {
  DecodeOptions options = heads.options;
  options.score_threshold = floor;
  auto result = decode(heads.model, options, heads.tensors);
  if (!result) throw std::runtime_error(result.error().detail);
  return *std::move(result);
}

std::vector<Candidate> passing(const std::vector<Candidate>& candidates) {
  std::vector<Candidate> result;
  for (const Candidate& c : candidates) {
    if (c.score >= kLax) result.push_back(c);
  }
  return result;
}

/// Returns expectations: every third reported box as it is, and the same boxes shifted to empty
/// places.
std::vector<Expectation> expectationsFor(const std::vector<Candidate>& reported) {
  std::vector<Expectation> expected;
  for (std::size_t i = 0; i < reported.size(); i += 3) {
    Box b = reported[i].box;
    expected.push_back({b, 1, {2, 2, 2, 2}});
    b.x1 += 60, b.x2 += 60, b.y1 += 40, b.y2 += 40;
    expected.push_back({b, 1, {2, 2, 2, 2}});
  }
  return expected;
}

Detections messageOf(const std::vector<Candidate>& reported) {
  Detections m;
  m.camera = "cam0";
  for (const Candidate& c : reported) {
    m.detections.push_back({.box = c.box,
                            .activations = c.activations,
                            .azimuth = c.azimuth,
                            .azimuth_sigma = c.azimuth_sigma,
                            .side_sigma = c.side_sigma});
  }
  return m;
}

void overTheWire(const Detections& message, wire::Arena& arena) {
  wire::Type<Detections>::Wire sample;
  if (!wire::encode(message, sample, arena)) throw std::runtime_error("not encoded");
  auto back = wire::decode<Detections>(sample);
  if (!back) throw std::runtime_error("not decoded: " + back.error().detail);
  benchmark::DoNotOptimize(back->detections.data());
}

void decodeAlone(benchmark::State& state) {
  const Heads& heads = headsOf(static_cast<int>(state.range(0)));
  std::size_t count = 0;
  for (auto _ : state) count = candidatesOf(heads, kFloor).size();
  state.counters["candidates"] = static_cast<double>(count);
}

void suppressAlone(benchmark::State& state) {
  const auto lax = passing(candidatesOf(headsOf(static_cast<int>(state.range(0))), kLax));
  std::size_t count = 0;
  for (auto _ : state) count = suppress(lax, 0.5, 100).size();
  state.counters["boxes"] = static_cast<double>(count);
}

void primeAlone(benchmark::State& state) {
  const Heads& heads = headsOf(static_cast<int>(state.range(0)));
  const auto all = candidatesOf(heads, kFloor);
  const auto reported = suppress(passing(all), 0.5, 100);
  const auto expected = expectationsFor(reported);
  for (auto _ : state) {
    benchmark::DoNotOptimize(prime(heads.model.calibration, expected, reported, all));
  }
  state.counters["expected"] = static_cast<double>(expected.size());
}

void wireAlone(benchmark::State& state) {
  const auto reported =
      suppress(passing(candidatesOf(headsOf(static_cast<int>(state.range(0))), kLax)), 0.5, 100);
  const Detections message = messageOf(reported);
  wire::Arena arena;
  for (auto _ : state) overTheWire(message, arena);
  state.counters["boxes"] = static_cast<double>(reported.size());
}

/// All work for a frame except the forward pass and the image. The limit is 2 ms.
void beyondTheForwardPass(benchmark::State& state) {
  const Heads& heads = headsOf(static_cast<int>(state.range(0)));
  const auto expected = expectationsFor(suppress(passing(candidatesOf(heads, kLax)), 0.5, 100));
  wire::Arena arena;
  for (auto _ : state) {
    const auto all = candidatesOf(heads, kFloor);
    const auto reported = suppress(passing(all), 0.5, 100);
    benchmark::DoNotOptimize(prime(heads.model.calibration, expected, reported, all));
    overTheWire(messageOf(reported), arena);
  }
}

void imageToInput(benchmark::State& state) {
  Frame frame;
  frame.width = 640, frame.height = 480;
  frame.encoding = ImageEncoding::kBgr8;
  frame.data = std::make_shared<const std::vector<std::uint8_t>>(640 * 480 * 3, std::uint8_t{90});
  const Input input = headsOf(0).model.input;
  for (auto _ : state) benchmark::DoNotOptimize(makeBlob(input, frame));
}

BENCHMARK(decodeAlone)->ArgName("family")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(suppressAlone)->ArgName("family")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(primeAlone)->ArgName("family")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(wireAlone)->ArgName("family")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(beyondTheForwardPass)->ArgName("family")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);
BENCHMARK(imageToInput)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
