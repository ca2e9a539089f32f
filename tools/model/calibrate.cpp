#include "tools/model/calibrate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "services/inference/core/decode/evidence.h"
#include "services/inference/core/decode/prime.h"
#include "services/inference/core/decode/suppress.h"
#include "services/inference/core/network/image_fit.h"
#include "services/inference/node.h"
#include "tools/base/config_folder.h"

namespace perdure::tools {
namespace {

using inference::Calibration;
using inference::Candidate;

constexpr double kSame = 0.5;       // least IoU of a box and the object that it matches
constexpr double kOnIgnored = 0.7;  // least share of a box inside an ignored one
constexpr double kApart = 0.3;      // a place is empty if its IoU with every true box is below this
constexpr double kClear = 0.8;      // least probability of a box whose sides are measured
constexpr double kLarge_px = 40.0, kFull_px = 12.0;  // pixels of the input
constexpr std::size_t kLeastInsets = 20, kLeastSides = 40;
constexpr int kRounds = 3;
constexpr double kLeastTarget_px = 10.0;  // pixels of the input

struct Target {
  Box box;            ///< pixels of the input
  std::size_t k = 0;  ///< class index of the network + 1; 0: no class of the network
  bool ignored = false;
  std::optional<Box> hull;
};

/// The network's output for a frame. Activations are the network's own log-odds, not evidence.
struct Seen {
  std::vector<Candidate> candidates;
  std::vector<Target> targets;
  double width = 0.0, height = 0.0;  ///< size of the image within the input
  bool sides_known = true;
};

Calibration plain() { return {.temperature = 1.0, .clutter_rate = 0.5}; }

std::vector<Candidate> calibrated(const std::vector<Candidate>& raw, const Calibration& calibration,
                                  double threshold) {
  std::vector<Candidate> result;
  for (const Candidate& candidate : raw) {
    if (candidate.score < threshold) continue;
    result.push_back(candidate);
    auto& a = result.back().activations;
    for (std::size_t k = 1; k < a.size(); ++k) a[k] = inference::evidenceOf(calibration, a[k]);
  }
  return result;
}

double covered(const Box& box, const Box& by) {
  const double w = std::min(box.x2, by.x2) - std::max(box.x1, by.x1);
  const double h = std::min(box.y2, by.y2) - std::max(box.y1, by.y1);
  return w > 0.0 && h > 0.0 ? w * h / box.area() : 0.0;
}

constexpr int kClutter = -1, kNeutral = -2;

/// Returns, for each box, its target, kClutter or kNeutral. The boxes must be sorted by decreasing
/// evidence.
std::vector<int> match(const std::vector<Candidate>& boxes, const std::vector<Target>& targets) {
  std::vector<int> result;
  std::vector<bool> taken(targets.size(), false);
  for (const Candidate& box : boxes) {
    int best = kClutter;
    double most = kSame;
    bool neutral = false;
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const double iou = intersectionOverUnion(box.box, targets[t].box);
      const bool counted = !targets[t].ignored && targets[t].k > 0;
      if (counted && !taken[t] && iou >= most) most = iou, best = static_cast<int>(t);
      if (!counted && (iou >= kSame || covered(box.box, targets[t].box) >= kOnIgnored)) {
        neutral = true;
      }
    }
    if (best >= 0) taken[static_cast<std::size_t>(best)] = true;
    result.push_back(best >= 0 ? best : neutral ? kNeutral : kClutter);
  }
  return result;
}

class Study {
 public:
  Study(const CalibrateOptions& options, CalibrationResult& result)
      : options_(options),
        node_(options.inference, 1),
        aliases_(replay::ClassAliases::load(configFolder() / "class_aliases.yaml")),
        result_(result) {
    for (const auto& name : node_.model().classes) names_.push_back(aliases_.canonical(name));
    result.before = node_.description().calibration;
  }

  void look(const std::function<void(std::size_t, std::size_t)>& progress);
  void fit();

 private:
  void lookAt(LabelledData& data, std::size_t done, std::size_t all,
              const std::function<void(std::size_t, std::size_t)>& progress);
  Seen seenIn(const Frame& frame, const LabelledFrame& labels);
  std::vector<Candidate> reported(const Seen& frame, const Calibration& calibration) const;
  std::vector<BoxOutcome> outcomes(const Calibration& calibration) const;
  bool judged(std::size_t k) const { return judged_.empty() || judged_.contains(names_[k]); }
  void countTargets(const Calibration& calibration);
  void requireTheSameFrames() const;
  void measureSides(const Calibration& calibration);
  void fitPrimedAnswers(Calibration& calibration);
  std::vector<PrimedOutcome> askAround(const Calibration& calibration) const;

  const CalibrateOptions& options_;
  inference::Node node_;
  replay::ClassAliases aliases_;
  std::vector<std::string> names_;  ///< canonical names of the reported classes
  std::set<std::string> judged_;
  std::vector<Seen> frames_;
  CalibrationResult& result_;
};

void Study::look(const std::function<void(std::size_t, std::size_t)>& progress) {
  const auto& input = node_.description().input;
  std::vector<LabelledData> all;
  std::size_t count = 0;
  for (const LabelRequest& request : options_.data) {
    auto dataset = replay::Dataset::open(
        {.path = request.data, .sequence = request.sequence, .decode = false});
    const auto& camera = dataset->calibration().cameras.front();
    const auto fit =
        inference::fitOf(input, static_cast<int>(camera.width), static_cast<int>(camera.height));
    all.push_back(readLabelled(request, aliases_, kLeastTarget_px / fit.scale_x));
    count += all.back().frames.size();
    judged_.insert(all.back().judged.begin(), all.back().judged.end());
  }
  std::size_t done = 0;
  for (LabelledData& data : all) {
    lookAt(data, done, count, progress);
    done += data.frames.size();
  }
  result_.frames = frames_.size();
}

void Study::lookAt(LabelledData& data, std::size_t done, std::size_t all,
                   const std::function<void(std::size_t, std::size_t)>& progress) {
  for (const LabelledFrame& labels : data.frames) {
    if (const auto frame = data.dataset->frameAt(labels.frame)) {
      frames_.push_back(seenIn(*frame, labels));
      frames_.back().sides_known = data.sides_known;
    }
    if (progress) progress(++done, all);
  }
}

Seen Study::seenIn(const Frame& frame, const LabelledFrame& labels) {
  auto candidates = node_.candidatesIn(frame, options_.primed_floor);
  if (!candidates) {
    throw StartupError(ExitCode::kConfiguration,
                       "frame " + std::to_string(labels.frame) + ": " + candidates.error().detail);
  }
  Seen seen{*std::move(candidates), {}, 0, 0};
  for (Candidate& candidate : seen.candidates) {
    auto& a = candidate.activations;
    for (std::size_t k = 1; k < a.size(); ++k) {
      a[k] = static_cast<float>(inference::oddsOf(result_.before, a[k]));
    }
  }
  const auto fit = inference::fitOf(node_.description().input, static_cast<int>(frame.width),
                                    static_cast<int>(frame.height));
  seen.width = fit.width, seen.height = fit.height;
  for (const TrueBox& label : labels.boxes) {
    const auto name = std::ranges::find(names_, label.class_name);
    Target target{fit.toInput(label.box), 0, label.ignored, {}};
    if (name != names_.end()) target.k = static_cast<std::size_t>(name - names_.begin()) + 1;
    if (label.hull) target.hull = fit.toInput(*label.hull);
    seen.targets.push_back(target);
  }
  return seen;
}

std::vector<Candidate> Study::reported(const Seen& frame, const Calibration& calibration) const {
  const auto& detection = options_.inference.detection;
  return inference::suppress(calibrated(frame.candidates, calibration, detection.score_threshold),
                             detection.merge_iou, static_cast<std::size_t>(detection.limit));
}

std::vector<BoxOutcome> Study::outcomes(const Calibration& calibration) const {
  std::vector<BoxOutcome> result;
  for (std::size_t f = 0; f < frames_.size(); ++f) {
    const auto boxes = reported(frames_[f], calibration);
    const auto taken = match(boxes, frames_[f].targets);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (taken[i] == kNeutral) continue;
      BoxOutcome outcome;
      outcome.frame = f;
      const auto& a = boxes[i].activations;
      for (std::size_t k = 1; k < a.size(); ++k) {
        outcome.odds.push_back(inference::oddsOf(calibration, a[k]));
      }
      const auto best = std::max_element(a.begin() + 1, a.end()) - a.begin() - 1;
      if (taken[i] >= 0) {
        outcome.label = frames_[f].targets[static_cast<std::size_t>(taken[i])].k;
      } else if (!judged(static_cast<std::size_t>(best))) {
        continue;  // may be correct, because the class has no labels
      }
      result.push_back(std::move(outcome));
    }
  }
  return result;
}

void Study::countTargets(const Calibration& calibration) {
  for (const Seen& frame : frames_) {
    for (const int taken : match(reported(frame, calibration), frame.targets)) {
      result_.targets_found += taken >= 0 ? 1 : 0;
    }
    result_.targets += static_cast<std::size_t>(std::ranges::count_if(
        frame.targets, [](const Target& t) { return !t.ignored && t.k > 0; }));
  }
}

/// Throws StartupError if most objects of a map are not detected. The map's run detected all of
/// them, so it used other frames.
void Study::requireTheSameFrames() const {
  const bool by_map =
      std::ranges::any_of(frames_, [](const Seen& frame) { return !frame.sides_known; });
  if (!by_map || 2 * result_.targets_found >= result_.targets) return;
  throw StartupError(ExitCode::kUnavailable,
                     "of {} objects that --labels expects {} are seen in --frames: is it a run "
                     "over these frames, with this network?",
                     result_.targets, result_.targets_found);
}

void Study::measureSides(const Calibration& calibration) {
  std::vector<double> errors;
  std::map<std::size_t, std::array<std::vector<double>, 4>> insets;
  for (const Seen& frame : frames_) {
    if (!frame.sides_known) continue;
    const auto boxes = reported(frame, calibration);
    const auto taken = match(boxes, frame.targets);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const double odds =
          inference::totalEvidence(boxes[i]) - inference::logit(calibration.clutter_rate);
      if (taken[i] < 0 || inference::sigmoid(odds) < kClear) continue;
      const Target& target = frame.targets[static_cast<std::size_t>(taken[i])];
      const Box &got = boxes[i].box, &is = target.box;
      const double w = is.width(), h = is.height();
      if (w > kLarge_px && is.x1 > 1.0) errors.push_back((got.x1 - is.x1) / w);
      if (w > kLarge_px && is.x2 < frame.width - 1.0) errors.push_back((got.x2 - is.x2) / w);
      if (h > kLarge_px && is.y1 > 1.0) errors.push_back((got.y1 - is.y1) / h);
      if (h > kLarge_px && is.y2 < frame.height - 1.0) errors.push_back((got.y2 - is.y2) / h);
      if (!target.hull) continue;
      const bool outline = node_.description().boxes == BoxExtent::kOutline;
      const Box& hull = outline ? target.box : *target.hull;
      if (std::min(hull.width(), hull.height()) <= kFull_px) continue;
      auto& of_class = insets[target.k - 1];
      of_class[0].push_back((got.x1 - hull.x1) / hull.width());
      of_class[1].push_back((got.y1 - hull.y1) / hull.height());
      of_class[2].push_back((hull.x2 - got.x2) / hull.width());
      of_class[3].push_back((hull.y2 - got.y2) / hull.height());
    }
  }
  if (errors.size() >= kLeastSides) {
    result_.box_sigma = std::clamp(robustSigma(std::move(errors)), 0.01, 1.0);
  }
  for (auto& [k, sides] : insets) {
    if (sides[0].size() < kLeastInsets) continue;
    auto& inset = result_.side_insets[node_.model().classes[k]];
    for (std::size_t s = 0; s < 4; ++s) inset[s] = std::clamp(medianOf(sides[s]), -0.45, 0.45);
  }
}

/// Returns a prediction at the target, with random errors like those of the filter's predictions.
inference::Expectation expectationAt(const Target& target, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Box& b = target.box;
  const double x = 0.04 * b.width() + 0.7, y = 0.04 * b.height() + 0.7;
  Box moved{b.x1 + x * normal(random), b.y1 + y * normal(random), b.x2 + x * normal(random),
            b.y2 + y * normal(random)};
  if (moved.width() < 1.0 || moved.height() < 1.0) moved = b;
  return {moved, target.k, {x, y, x, y}};
}

/// Returns the outcomes of predictions at true objects and at empty places. The empty places are
/// those of objects in two other frames.
std::vector<PrimedOutcome> Study::askAround(const Calibration& calibration) const {
  std::mt19937 random(1);
  std::vector<PrimedOutcome> places;
  const std::size_t n = frames_.size();
  for (std::size_t f = 0; f < n; ++f) {
    const Seen& frame = frames_[f];
    std::vector<inference::Expectation> expected;
    for (const Target& t : frame.targets) {
      if (!t.ignored && t.k > 0) expected.push_back(expectationAt(t, random));
    }
    const std::size_t there = expected.size();
    for (const std::size_t other : {(f + n / 3) % n, (f + 2 * n / 3) % n}) {
      for (const Target& t : frames_[other].targets) {
        if (t.ignored || t.k == 0 || other == f) continue;
        const bool free = std::ranges::none_of(frame.targets, [&](const Target& mine) {
          return intersectionOverUnion(mine.box, t.box) >= kApart;
        });
        if (free) expected.push_back(expectationAt(t, random));
      }
    }
    const auto all = calibrated(frame.candidates, calibration, 0.0);
    for (const auto& answer :
         inference::prime(calibration, expected, reported(frame, calibration), all)) {
      PrimedOutcome place{answer.expectation < there, {}};
      if (answer.candidate) place.odds = answer.odds;
      places.push_back(place);
    }
  }
  return places;
}

void Study::fitPrimedAnswers(Calibration& calibration) {
  const auto places = askAround(calibration);
  for (const auto& p : places) ++(p.there ? result_.asked_there : result_.asked_elsewhere);
  const auto fitted = fitPrimed(places, options_.primed_floor);
  if (!fitted) return;
  calibration.primed = *fitted;
  result_.has_primed = true;
  double there = 0.0, elsewhere = 0.0;
  for (const auto& p : places) {
    const double nats = p.odds ? fitted->offset + fitted->slope * *p.odds : fitted->nothing;
    (p.there ? there : elsewhere) += nats;
  }
  result_.primed_nats_there = there / static_cast<double>(result_.asked_there);
  result_.primed_nats_elsewhere = elsewhere / static_cast<double>(result_.asked_elsewhere);
}

/// Fits the calibration in a few rounds, because the merged boxes depend slightly on it
/// (suppress.h).
void Study::fit() {
  Calibration calibration = options_.primed_only ? result_.before : plain();
  calibration.primed = {};
  std::vector<BoxOutcome> boxes;
  for (int round = 0; round < kRounds && !options_.primed_only; ++round) {
    boxes = outcomes(calibration);
    const Softening s = fitSoftening(boxes);
    calibration.temperature = s.temperature;
    calibration.bias = s.bias;
    calibration.clutter_rate = clutterRateOf(boxes);
  }
  countTargets(calibration);
  requireTheSameFrames();
  boxes = outcomes(calibration);
  const auto right = std::ranges::count_if(boxes, [](const auto& b) { return b.label > 0; });
  if (right < 20 || static_cast<std::size_t>(right) + 20 > boxes.size()) {
    throw StartupError(ExitCode::kUnavailable,
                       "the labelled frames hold " + std::to_string(right) + " right boxes of " +
                           std::to_string(boxes.size()) +
                           "; 20 right and 20 wrong ones are the least: give more --frames");
  }
  result_.boxes = boxes.size();
  result_.false_boxes = static_cast<double>(boxes.size() - static_cast<std::size_t>(right)) /
                        static_cast<double>(frames_.size());
  const auto before = outcomes(result_.before);
  result_.reliability_before = reliabilityOf(
      before,
      std::vector<Softening>(before.size(), {result_.before.temperature, result_.before.bias}));
  result_.reliability_after = reliabilityOf(boxes, crossValidated(boxes, frames_.size()));
  if (!options_.primed_only) measureSides(calibration);
  fitPrimedAnswers(calibration);
  result_.fitted = calibration;
}

}  // namespace

CalibrationResult calibrate(const CalibrateOptions& options,
                            const std::function<void(std::size_t, std::size_t)>& progress) {
  CalibrationResult result;
  Study study(options, result);
  study.look(progress);
  study.fit();
  return result;
}

}  // namespace perdure::tools
