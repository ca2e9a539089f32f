#include "tools/demo/demo.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>

#include "common/base/errors.h"
#include "common/base/ids.h"
#include "common/base/subprocess.h"
#include "common/replay/recordings/ros_topics.h"
#include "common/types/health.h"
#include "tools/data_check/data_check.h"
#include "tools/evaluate/object_report.h"
#include "tools/evaluate/simulated_truth.h"
#include "tools/outputs/pictures/overlay_video.h"
#include "tools/outputs/pictures/truth_sources.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::int64_t kSecond = 1'000'000'000;

/// Reserves a DDS domain that no other demo on this host uses, until this process ends.
void leaseDomain() {
  const char* given = std::getenv("PERDURE_DOMAIN");
  if (given != nullptr && *given != '\0') return;
  constexpr int kFirst = 60, kLast = 99;
  for (int domain = kFirst; domain <= kLast; ++domain) {
    const auto path = fs::temp_directory_path() / fmt::format("perdure-domain-{}", domain);
    const int file = open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (file >= 0 && flock(file, LOCK_EX | LOCK_NB) == 0) {
      setenv("PERDURE_DOMAIN", std::to_string(domain).c_str(), 1);
      return;
    }
    if (file >= 0) close(file);
  }
  throw StartupError(ExitCode::kUnavailable,
                     "DDS domains 60 to 99 are all used by demos; end one of them, or set "
                     "PERDURE_DOMAIN to a free one");
}

/// The bus options of the services, from the bus.yaml beside their configuration.
bus::Options busOptions(const fs::path& root) {
  std::vector<config::Problem> problems;
  bus::Options options = bus::commonOptions(root / "config", problems);
  config::refuse(problems);
  options.shared_memory_mb = 0;  // the demo reads no images from the bus
  options.identity.clear();
  return options;
}

}  // namespace

Demo::Demo(const DemoOptions& options, const std::atomic<bool>& interrupted)
    : options_(options), interrupted_(interrupted) {
  openData();
  folders_ = prepareFolders(options_);
  services_ = planServices(options_, folders_);
  addGateway();
  checkConfigurations();
  leaseDomain();
  outputs_ = std::make_unique<OutputWriter>(
      folders_.out, truth_ ? truth_->sequence : fs::path(options_.data).filename().string());
  domain_ = std::make_unique<bus::Domain>(busOptions(options_.root));
  participant_ = std::make_unique<bus::Participant>(*domain_, "demo");
  loop_ = std::make_unique<bus::WaitLoop>(*participant_);
  reporter_ = std::make_unique<Reporter>(*participant_, *loop_, *outputs_, shapesFor(options_));
  supervisor_ = std::make_unique<Supervisor>(services_, fs::absolute(options_.root));
  std::cerr << fmt::format(
      "demo: {} frames, services on DDS domain {}; listen with: "
      "PERDURE_DOMAIN={} {}/perdure topics\n",
      frames_, domain_->options().domain, domain_->options().domain, options_.programs);
  if (!address_.empty()) std::cerr << "demo: look at " << address_ << std::endl;
}

void Demo::addGateway() {
  const std::uint16_t port = freePort();
  auto gateway = planGateway(options_, folders_, port);
  if (!gateway) return;
  services_.push_back(*std::move(gateway));
  address_ = fmt::format("http://127.0.0.1:{}/", port);
}

replay::DatasetOptions Demo::dataOptions() const {
  replay::DatasetOptions data;
  data.path = options_.data;
  data.sequence = options_.sequence;
  data.rig = options_.rig;
  data.topics = replay::topicsOf(options_.topics);
  data.decode = false;
  return data;
}

void Demo::openData() {
  replay::DatasetOptions with_images = dataOptions();
  with_images.decode = true;
  std::cerr << "demo: checks " << options_.data << '\n';
  const auto dataset = replay::Dataset::open(with_images);
  frames_ = dataset->frameCount();
  findings_ = checkDrive(dataset->recording(), {});
  replay::refuseFatal(findings_, options_.data);
  printDoubts(dataset->recording(), findings_);
  if (!fs::exists(options_.model)) {
    throw StartupError(ExitCode::kUnavailable,
                       options_.model + " does not exist; give --model a network, FILE.onnx");
  }
  truth_ = findTruth(options_);
}

void Demo::checkConfigurations() {
  for (const ServicePlan& service : services_) {
    std::vector<std::string> command = service.command;
    command.push_back("--print-config");
    const ProgramAnswer answer =
        runProgram({.command = command, .folder = fs::absolute(options_.root)});
    if (answer.status != 0) {
      const auto code = static_cast<ExitCode>(answer.status);
      throw StartupError(code, service.name + " cannot start: " + answer.output);
    }
    configurations_ += answer.output;
  }
}

void Demo::run() {
  while (!over()) {
    loop_->runOnce(50ms);
    watch();
  }
  showProgress(true);
  if (interrupted_) std::cerr << "demo: ends early\n";
  if (!options_.keep || interrupted_) endInOrder();
  write();
}

void Demo::keep() {
  std::cerr << fmt::format("demo: everything goes on{}; Ctrl-C ends it\n",
                           address_.empty() ? "" : " at " + address_);
  while (!interrupted_) {
    loop_->runOnce(50ms);
    supervisor_->watch();
  }
  endInOrder();
}

void Demo::watch() {
  supervisor_->watch();
  const std::int64_t now = monotonicNs();
  const bool terminal = isatty(STDERR_FILENO) == 1;
  if (now - shown_ns_ > (terminal ? kSecond / 4 : 2 * kSecond)) {
    shown_ns_ = now;
    showProgress(false);
  }
}

bool Demo::over() {
  if (interrupted_) return true;
  if (options_.seconds > 0 && reporter_->secondsOfDrive() >= options_.seconds) return true;
  const Health* capture = reporter_->healthOf("capture");
  if (capture == nullptr || capture->message != kEndOfDrive) return false;
  // Detections may still arrive: waits 1 s if all frames have objects, otherwise 5 s.
  const std::int64_t quiet = monotonicNs() - reporter_->lastMessageNs();
  return quiet > (reporter_->drained() ? kSecond : 5 * kSecond);
}

void Demo::showProgress(bool last) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  const std::string line = reporter_->progressLine(frames_);
  std::cerr << (terminal ? "\r\033[K" : "") << "demo: " << line << (terminal && !last ? "" : "\n")
            << std::flush;
}

void Demo::endInOrder() {
  for (const char* service : kServices) endOne(service);
  if (!address_.empty()) endOne(kGateway);
}

void Demo::endOne(const std::string& service) {
  supervisor_->stop(service);
  const std::int64_t end = monotonicNs() + 6 * kSecond;
  while (supervisor_->runs(service) && monotonicNs() < end) loop_->runOnce(50ms);
}

/// Ends the processes that `perdure inference swap` started.
void Demo::endSwappedIn() const {
  const auto isInference = [](pid_t pid) {
    std::error_code gone;
    return fs::read_symlink(fmt::format("/proc/{}/exe", pid), gone).filename() ==
           "perdure-inference";
  };
  std::vector<pid_t> left = reporter_->pidsOf("inference");
  const std::int64_t end = monotonicNs() + 6 * kSecond;
  for (const pid_t pid : left) {
    if (isInference(pid)) kill(pid, SIGTERM);
  }
  while (std::erase_if(left, [&](pid_t pid) { return !isInference(pid); }), !left.empty()) {
    if (monotonicNs() > end) return;
    loop_->runOnce(50ms);
  }
}

/// Sets the ground truth of the pictures. If it cannot be read, the scoring reports the error.
void Demo::setTruthOfPictures() {
  const auto data = dataOptions();
  auto truth = truth_ ? pictureTruthOfLabels(truth_->labels, truth_->calibration, outputs_->poses())
                      : pictureTruth(*replay::Dataset::open(data), data, outputs_->poses());
  if (truth) outputs_->setTruth(*std::move(truth));
}

void Demo::drawOverlay() const {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  auto data = dataOptions();
  data.decode = true;
  const std::string sentence = writeOverlay(
      outputs_->log(), data, folders_.out / "overlay.mp4", [&](std::size_t done, std::size_t all) {
        if (terminal) std::cerr << fmt::format("\r\033[Kdemo: overlay, frame {} of {}", done, all);
      });
  std::cerr << (terminal ? "\r\033[K" : "") << "demo: " << sentence << std::endl;
}

void Demo::write() {
  setTruthOfPictures();
  outputs_->finish();
  outputs_->writeJson("timing.json", reporter_->timing());
  nlohmann::ordered_json report = {{"program", "perdure demo"},
                                   {"version", PERDURE_VERSION},
                                   {"configuration", toHex(digest(configurations_))},
                                   {"data", fs::absolute(options_.data).string()},
                                   {"model", fs::absolute(options_.model).string()},
                                   {"rate", options_.rate},
                                   {"frames", frames_},
                                   {"complete", !interrupted_ && options_.seconds == 0.0}};
  report.update(reporter_->report());
  const Doubts doubts = doubtsOfRun(reporter_->facts(findings_));
  report["data_check"] = {{"findings", toJson(findings_)}};
  report["doubts"] = toJson(doubts);
  printWarnings(doubts);
  end_of_line_ = tools::endOfLine(doubts);
  for (const ServicePlan& service : services_) {
    report["services"][service.name]["restarts"] = supervisor_->starts(service.name) - 1;
  }
  if (truth_ && reporter_->odometryFrames() > 0) {
    report["objects"] = scoreAgainst(*truth_, folders_.out);
  } else if (isSimulated(options_.data) && reporter_->odometryFrames() > 0) {
    report["objects"] = reportSimulated(options_.data, folders_.out);
  }
  outputs_->writeJson("report.json", report);
  drawOverlay();
}

}  // namespace perdure::tools
