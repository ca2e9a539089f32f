#include <pybind11/stl.h>

#include <condition_variable>
#include <mutex>
#include <thread>

#include "common/bus/once.h"
#include "common/service/service.h"
#include "tools/python/bindings.h"
#include "tools/python/bus.h"
#include "tools/python/messages/convert.h"
#include "tools/python/messages/raise.h"

namespace perdure::python {
namespace {

namespace py = pybind11;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kHangs{10};  // no network needs longer for a frame

struct ServiceOptions {
  std::string process, camera;
  std::int32_t strength = 1;
  double lease_s = 0.0;
  bool expects = false;  ///< evaluates the filter's predictions
};

/// Runs the service's loop in a thread, so that Health is sent continuously. Stores the newest
/// frame.
class InferenceService {
 public:
  InferenceService(const BusSettings& settings, const ServiceOptions& options,
                   const ModelInfo& model)
      : options_(options),
        context_(options.process, openDomain(serviceOptionsOf(settings, options.process)),
                 service::makeLog(options.process)),
        detections_(context_.writer(bus::kTopic<Detections>,
                                    {.strength = options.strength, .lease_s = options.lease_s})),
        frames_(context_.needs("frames", "fix the camera, or start capture")) {
    model_ = model;
    model_.instance = context_.instance();
    const auto told = context_.writer(bus::kTopic<ModelInfo>).write(model_);
    if (!told) throw StartupError(ExitCode::kConfiguration, sentenceOf("the model", told.error()));
    wire();
    thread_ = std::thread([this] { run(); });
  }

  ~InferenceService() { close(); }

  void close() {
    context_.stop();
    if (thread_.joinable()) thread_.join();
  }

  /// Returns the newest frame, or nothing after the time `longest`. Throws the error that ended the
  /// loop.
  std::optional<Frame> next(std::chrono::nanoseconds longest) {
    std::unique_lock lock(mutex_);
    came_.wait_for(lock, longest, [this] { return newest_ || ended_; });
    if (ended_ && !failure_.empty()) throw std::runtime_error(failure_);
    if (!newest_) return std::nullopt;
    busy_since_ = Clock::now();
    return std::exchange(newest_, std::nullopt);
  }

  Result<void> answer(Detections detections) {
    detections.instance = context_.instance();
    detections.model_hash = model_.hash;
    const std::lock_guard lock(mutex_);
    busy_since_.reset();
    if (detections_.livelinessLost() > lost_) {  // lease expired: not the owner any more
      lost_ = detections_.livelinessLost();
      if (detections_.strength() == options_.strength) {
        detections_.setStrength(options_.strength - 1);
      }
    }
    const auto written = detections_.write(detections);
    if (!written) return written;
    context_.health().frameOut();
    say(HealthState::kOk, "");
    return {};
  }

  void failed(const std::string& why) {
    const std::lock_guard lock(mutex_);
    busy_since_.reset();
    reasons_.add("detect_failed");
    say(HealthState::kDegraded, why);
  }

  /// Returns the newest predictions of the filter; each only once.
  std::optional<Predictions> predictions() {
    const std::lock_guard lock(mutex_);
    return std::exchange(expected_, std::nullopt);
  }
  void count(const std::string& reason) {
    const std::lock_guard lock(mutex_);
    reasons_.add(reason);
  }

  bool ended() const { return ended_; }
  std::uint64_t framesOut() { return context_.health().framesOut(); }

  static std::string sentenceOf(const std::string& what, const Reason& reason) {
    return what + " was not written: " + reason.code +
           (reason.detail.empty() ? "" : " of " + reason.detail);
  }

 private:
  void wire() {
    say(HealthState::kStarting, "waits for frames");
    context_.on(bus::frameTopic(options_.camera), [this](const Frame& frame) { offer(frame); });
    if (options_.expects) {
      context_.on(bus::kTopic<Predictions>, [this](const Predictions& predictions) {
        const std::lock_guard lock(mutex_);
        expected_ = predictions;
      });
    }
    context_.countReasons([this](ReasonCounts& counts) {
      const std::lock_guard lock(mutex_);
      counts.add(reasons_);
    });
    context_.every(durationFromSeconds(options_.lease_s / 5), [this] { assertAlive(); });
    context_.watch([this] { return !busyFor(kHangs); });
    context_.onHealth([this] {
      const std::lock_guard lock(mutex_);
      context_.health().state(state_, message_);
    });
  }

  void run() {
    try {
      context_.run();
      detections_.waitForAcknowledgement(0.2);
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      failure_ = error.what();
    }
    ended_ = true;
    came_.notify_all();
  }

  void offer(const Frame& frame) {
    frames_.heard();
    context_.health().frameIn();
    {
      const std::lock_guard lock(mutex_);
      const auto missed = gaps_.before(frame.stamp.source, frame.stamp.sequence);
      if (missed > 0) reasons_.add("frames_missed", missed);
      if (newest_) context_.health().dropped();
      newest_ = frame;
    }
    came_.notify_one();
  }

  bool busyFor(std::chrono::nanoseconds longest) {
    const std::lock_guard lock(mutex_);
    return busy_since_ && Clock::now() - *busy_since_ > longest;
  }

  void assertAlive() {
    if (busyFor(durationFromSeconds(options_.lease_s))) return;
    const std::lock_guard lock(mutex_);
    detections_.assertLiveliness();
  }

  void say(HealthState state, const std::string& message) {
    state_ = state;
    message_ = message;
  }

  const ServiceOptions options_;
  service::Context context_;
  bus::Writer<Detections>& detections_;
  service::Input& frames_;
  ModelInfo model_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::optional<Frame> newest_;
  std::optional<Predictions> expected_;
  std::optional<Clock::time_point> busy_since_;
  bus::Gaps gaps_;
  ReasonCounts reasons_;
  HealthState state_ = HealthState::kStarting;
  std::string message_, failure_;
  std::uint64_t lost_ = 0;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

py::object nextFrame(InferenceService& service, double seconds) {
  constexpr double kSlice = 0.05;
  const auto end = Clock::now() + std::chrono::duration<double>(std::clamp(seconds, 0.0, 1e8));
  for (;;) {
    std::optional<Frame> frame;
    {
      const py::gil_scoped_release waits;
      frame = service.next(durationFromSeconds(std::min(kSlice, seconds)));
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (frame) return toPython(*frame);
    if (service.ended() || Clock::now() >= end) return py::none();
  }
}

void answer(InferenceService& service, py::handle message) {
  Result<void> written;
  auto detections = fromPython<Detections>(message);
  {
    const py::gil_scoped_release writes;
    written = service.answer(std::move(detections));
  }
  if (!written) raise("Refused", InferenceService::sentenceOf("detections", written.error()));
}

std::unique_ptr<InferenceService> start(const BusSettings& settings, const std::string& process,
                                        const std::string& camera, py::handle model,
                                        std::int32_t strength, double lease_s, bool expects) {
  auto info = fromPython<ModelInfo>(model);
  const py::gil_scoped_release opens;
  return std::make_unique<InferenceService>(
      settings, ServiceOptions{process, camera, strength, lease_s, expects}, info);
}

}  // namespace

void bindInferenceService(py::module_& module) {
  py::class_<InferenceService>(module, "InferenceService")
      .def(py::init(&start), py::arg("settings"), py::arg("process"), py::arg("camera"),
           py::arg("model"), py::arg("strength"), py::arg("lease_s"), py::arg("expects"))
      .def("next", &nextFrame, py::arg("seconds"))
      .def("predictions",
           [](InferenceService& service) -> py::object {
             const auto predictions = service.predictions();
             return predictions ? toPython(*predictions) : py::none();
           })
      .def("count", &InferenceService::count, py::arg("reason"))
      .def("answer", &answer)
      .def("failed", &InferenceService::failed)
      .def("close", &InferenceService::close, py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("ended", &InferenceService::ended)
      .def_property_readonly("frames_out", &InferenceService::framesOut);
  module.def("digest", [](const std::string& text) { return digest(text); });
}

}  // namespace perdure::python
