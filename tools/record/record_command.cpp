#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <memory>

#include "common/base/errors.h"
#include "common/service/signals.h"
#include "tools/bus_tools/common.h"
#include "tools/perdure/commands.h"
#include "tools/record/files.h"
#include "tools/record/recorder.h"

namespace perdure::tools {
namespace {

struct RecordOptions {
  bus::Options bus;
  std::string out, fault = "failed";
  RecorderOptions recorder;
  StoreOptions store;
  std::uint64_t quota = 8ull << 30, keep_free = 100ull << 20;
  double seconds = 0;
  bool dump_at_end = false;
};

/// Blocks SIGUSR1 and polls for it, so that no extra thread is needed.
class DumpSignal {
 public:
  DumpSignal() {
    sigemptyset(&set_);
    sigaddset(&set_, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }
  bool came() const {
    const timespec now{0, 0};
    return sigtimedwait(&set_, nullptr, &now) == SIGUSR1;
  }

 private:
  sigset_t set_{};
};

void printSummary(const StoreReport& stored, std::uint64_t messages, const std::string& out) {
  std::string text =
      fmt::format("{} messages came, {} are in {} files ({:.1f} MB) in {}", messages,
                  stored.messages, stored.files, 1e-6 * static_cast<double>(stored.bytes), out);
  if (stored.overrun > 0) {
    text += fmt::format("; {} chunks were lost to a slow disk", stored.overrun);
  }
  std::puts(text.c_str());  // does not throw, so lost messages are reported even if this fails
  std::fflush(stdout);
}

void refuseLoss(const StoreReport& stored) {
  if (stored.lost == 0 && stored.overrun > 0) {
    throw StartupError(ExitCode::kInputOutput,
                       "{} chunks were lost to a slow disk; give --out a folder on a faster disk, "
                       "or fewer --topics",
                       stored.overrun);
  }
  if (stored.lost == 0) return;
  throw StartupError(ExitCode::kInputOutput,
                     fmt::format("{} messages were lost and are in no file: {}; free some room, or "
                                 "give --out a folder on another disk",
                                 stored.lost, stored.lost_to));
}

void runRecord(RecordOptions& options) {
  if (options.out.empty()) {
    throw StartupError(ExitCode::kUsage, "perdure record needs --out DIR, the recordings' folder");
  }
  const DumpSignal dump;  // must exist before other threads, which inherit its signal mask
  const service::BlockedSignals blocked;
  options.recorder.fault =
      options.fault == "failed" ? HealthState::kFailed : HealthState::kDegraded;
  SegmentFolder folder(options.out, options.quota, options.keep_free);
  const bool black_box = options.store.last_s > 0;
  const std::string process = black_box ? "black_box" : "record";
  service::Context context(process, options.bus, service::makeLog(process));
  for (const std::string& file : folder.repaired()) {
    context.log().info("{} had been cut off and is whole again", file);
  }
  Store store(options.store, folder);
  Recorder recorder(context, options.recorder, store);
  context.every(std::chrono::milliseconds(100), [&] {
    if (dump.came()) recorder.cut(true);
  });
  if (options.seconds > 0) {
    context.every(std::chrono::nanoseconds(static_cast<std::int64_t>(options.seconds * 1e9)),
                  [&] { context.stop(); });
  }
  const service::SignalThread signals(blocked, [&] { context.stop(); });
  context.run();
  recorder.cut(options.dump_at_end);
  store.finish();
  printSummary(store.report(), recorder.messages(), options.out);
  refuseLoss(store.report());
}

void addOptions(CLI::App& command, RecordOptions& options) {
  command.add_option("--out", options.out, "folder of the recordings");
  command.add_option("--topics", options.recorder.topics, "only these, as odometry or frame/cam0");
  command.add_flag("--images", options.recorder.images, "also the images of every camera");
  command.add_option("--segment", options.store.segment_s, "seconds to a file")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 86400.0));
  command
      .add_option(
          "--quota", options.quota,
          "bytes that all recordings in the folder may take (8GB); then the oldest are deleted; 0: "
          "no quota")
      ->transform(CLI::AsSizeValue(false));
  command
      .add_option("--keep-free", options.keep_free,
                  "bytes that are left free on the disk (100MB); recording waits for them")
      ->transform(CLI::AsSizeValue(false));
  command
      .add_option(
          "--last", options.store.last_s,
          "black box: keep so many seconds in memory (60s), and write them only at a fault, "
          "at SIGUSR1, or with --dump-at-end")
      ->transform(CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1}, {"min", 60}}));
  command.add_option("--after", options.store.after_s, "seconds that follow the fault in its file")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command.add_option("--memory", options.store.memory, "largest memory of --last (512MB)")
      ->transform(CLI::AsSizeValue(false));
  command
      .add_option("--fault", options.fault, "what counts: a process that is failed, or degraded")
      ->capture_default_str()
      ->check(CLI::IsMember({"failed", "degraded"}));
  command.add_flag("--dump-at-end", options.dump_at_end, "write what --last holds at the end too");
  command.add_option("--seconds", options.seconds, "end after this time");
  addBusOptions(command, options.bus);
}

}  // namespace

void setUpRecord(CLI::App& command) {
  auto options = std::make_shared<RecordOptions>();
  addOptions(command, *options);
  addFileCommands(command);
  command.callback([&command, options] {
    if (command.get_subcommands().empty()) runRecord(*options);
  });
}

}  // namespace perdure::tools
