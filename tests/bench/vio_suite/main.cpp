// Runs vio over all clips of the suite, under one or more settings, and prints one table.
#include <CLI/CLI.hpp>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "common/base/errors.h"
#include "tests/bench/vio_suite/clips.h"
#include "tests/bench/vio_suite/starts.h"
#include "tests/bench/vio_suite/table.h"

namespace perdure::bench {
namespace {

namespace fs = std::filesystem;

struct CommandLine {
  std::string data = "../shared/data", cache = "build/vio_suite", csv, half;
  std::vector<std::string> only, variants, set;
  double from_s = 0.0, until_s = 1e9;
  std::optional<double> readout_s;
  int jobs = 1, starts = 0;
  unsigned draw = 0;
  bool no_klt = false, innovations = false, reasons = false, list = false;
};

void assign(vio::Config& config, const std::string& assignments) {
  config::Fields fields;
  vio::describe(config, fields);
  std::size_t from = 0;
  while (from < assignments.size()) {
    const std::size_t to = std::min(assignments.find(',', from), assignments.size());
    config::refuse(config::assign(fields, assignments.substr(from, to - from)));
    from = to + 1;
  }
}

/// Parses "name:key=value,key=value"; the settings of --set are applied first.
std::vector<Variant> variantsOf(const CommandLine& line) {
  vio::Config base;
  for (const std::string& s : line.set) assign(base, s);
  std::vector<Variant> variants;
  for (const std::string& text : line.variants) {
    const std::size_t colon = text.find(':');
    Variant v{text.substr(0, colon), base};
    if (colon != std::string::npos) assign(v.config, text.substr(colon + 1));
    variants.push_back(std::move(v));
  }
  if (variants.empty()) variants.push_back({"default", base});
  return variants;
}

bool wanted(const Clip& clip, const CommandLine& line) {
  if (line.half == "tuned" && clip.half != Half::kTuned) return false;
  if (line.half == "judged" && clip.half != Half::kJudged) return false;
  return line.only.empty() ||
         std::find(line.only.begin(), line.only.end(), clip.name) != line.only.end();
}

/// Several threads process the clips; each prints its progress on one line.
class Suite {
 public:
  Suite(const CommandLine& line, std::vector<Clip> clips)
      : line_(line), clips_(std::move(clips)), variants_(variantsOf(line)) {}

  void run() {
    std::vector<std::thread> threads;
    for (int i = 0; i < line_.jobs; ++i) {
      threads.emplace_back([this] {
        for (std::size_t at = next_++; at < clips_.size(); at = next_++) take(clips_[at]);
      });
    }
    for (std::thread& t : threads) t.join();
  }
  Table table;
  bool failed = false;

 private:
  void say(const std::string& text) {
    const std::lock_guard lock(mutex_);
    std::cerr << text << '\n';
  }
  std::function<void(double)> progress(const Clip& clip, const char* what) {
    return [this, name = clip.name, what, tenth = 0](double share) mutable {
      if (share * 10 < tenth + 1) return;
      tenth = static_cast<int>(share * 10);
      if (tenth % 5 == 0) say(name + ": " + what + " " + std::to_string(10 * tenth) + " %");
    };
  }
  void take(const Clip& clip) {
    try {
      const auto folder = prepare(clip, line_.cache, line_.draw, progress(clip, "is made,"));
      if (!folder) return say(clip.name + ": skipped, " + clip.real.string() + " is not there");
      if (line_.starts > 0) {
        const auto rows = startsOf(clip, *folder, variants_, line_.starts);
        const std::lock_guard lock(mutex_);
        table.add(rows);
        return;
      }
      const auto outcomes =
          play(*folder, variants_,
               {line_.from_s, line_.until_s, !line_.no_klt, line_.innovations, line_.readout_s},
               progress(clip, "is played,"));
      const std::lock_guard lock(mutex_);
      for (std::size_t i = 0; i < outcomes.size(); ++i) {
        table.add(clip, variants_[i].name, outcomes[i]);
        if (!line_.reasons) continue;
        if (outcomes[i].readout_s != 0.0) {
          std::fprintf(stderr, "  %s %s read-out %.2f ms\n", clip.name.c_str(),
                       variants_[i].name.c_str(), 1e3 * outcomes[i].readout_s);
        }
        for (const NeesAt& n : outcomes[i].accuracy.nees) {
          std::fprintf(stderr, "  %s %s %3.0f s: %.3f m, %.2f deg; NEES %.2f %.2f %.2f\n",
                       clip.name.c_str(), variants_[i].name.c_str(), n.seconds, n.position_error,
                       n.yaw_error * 180.0 / M_PI, n.position, n.yaw, n.velocity);
        }
        for (const auto& [code, n] : outcomes[i].reasons) {
          std::fprintf(stderr, "  %s %s %s %llu\n", clip.name.c_str(), variants_[i].name.c_str(),
                       code.c_str(), static_cast<unsigned long long>(n));
        }
      }
    } catch (const std::exception& e) {
      say(clip.name + ": " + e.what());
      failed = true;
    }
  }

  const CommandLine& line_;
  std::vector<Clip> clips_;
  std::vector<Variant> variants_;
  std::mutex mutex_;
  std::atomic<std::size_t> next_ = 0;
};

int run(const CommandLine& line) {
  cv::setNumThreads(1);
  std::vector<Clip> clips = allClips(line.data);
  std::erase_if(clips, [&](const Clip& clip) { return !wanted(clip, line); });
  if (line.list) {
    for (const Clip& clip : clips) {
      std::printf("%-16s %-6s %s\n", clip.name.c_str(),
                  clip.half == Half::kTuned ? "tuned" : "judged", clip.what.c_str());
    }
    return 0;
  }
  Suite suite(line, clips);
  suite.run();
  suite.table.print(std::cout);
  if (!line.csv.empty()) {
    std::ofstream file(line.csv);
    suite.table.writeCsv(file);
    if (!file) throw StartupError(ExitCode::kUnavailable, line.csv + " cannot be written");
  }
  return suite.failed ? 1 : 0;
}

}  // namespace
}  // namespace perdure::bench

int main(int argc, char** argv) {
  perdure::bench::CommandLine line;
  CLI::App app("vio over clips of real and simulated motion: accuracy, consistency and time");
  app.add_option("--data", line.data, "Real clips are in its euroc_semi")->capture_default_str();
  app.add_option("--cache", line.cache, "Folder in which clips are rendered once")
      ->capture_default_str();
  app.add_option("--only", line.only, "Names of clips")->delimiter(',');
  app.add_option("--half", line.half, "tuned or judged (default: both)")
      ->check(CLI::IsMember({"tuned", "judged"}));
  app.add_option("--set", line.set, "KEY=VALUE, of all variants");
  app.add_option("--variant", line.variants, "NAME:KEY=VALUE,KEY=VALUE …; may be given again");
  app.add_option("--from", line.from_s, "Begin so many seconds into each clip");
  app.add_option("--until", line.until_s, "Stop at this time");
  app.add_option("--starts", line.starts,
                 "Cut each clip at so many random places instead, and "
                 "judge how vio starts in motion");
  app.add_option("--draw", line.draw,
                 "Simulated clips with other looks, noise and sensors, for each number");
  app.add_option("--readout", line.readout_s,
                 "Seconds of a rolling shutter that vio is told, whatever the clip has");
  app.add_option("--jobs", line.jobs, "Clips at a time")->capture_default_str();
  app.add_option("--csv", line.csv, "Also write the table to this file");
  app.add_flag("--no-klt", line.no_klt, "Without OpenCV's tracking beside it");
  app.add_flag("--innovations", line.innovations, "Size and whiteness of the innovations");
  app.add_flag("--reasons", line.reasons, "Errors by time and what was counted, to stderr");
  app.add_flag("--list", line.list, "List the clips and their options");
  CLI11_PARSE(app, argc, argv);
  try {
    return perdure::bench::run(line);
  } catch (const perdure::StartupError& e) {
    std::cerr << e.what() << '\n';
    return static_cast<int>(e.code());
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 70;
  }
}
