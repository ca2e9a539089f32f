// One run of the demo, from starting the services to the report.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "common/replay/dataset.h"
#include "tools/demo/plan.h"
#include "tools/demo/reporter.h"
#include "tools/demo/supervisor.h"
#include "tools/demo/truth.h"

namespace perdure::tools {

class Demo {
 public:
  /// Checks data, model and configuration, then starts everything. Throws StartupError.
  Demo(const DemoOptions& options, const std::atomic<bool>& interrupted);
  ~Demo() { endSwappedIn(); }
  Demo(const Demo&) = delete;
  Demo& operator=(const Demo&) = delete;

  /// Runs until the drive has ended and all data are processed, --seconds are over, or the demo is
  /// interrupted. Then it ends the services in order (unless --keep is given) and writes the
  /// outputs. Throws StartupError if a service cannot run.
  void run();
  /// Keeps everything running after the drive if --keep is given, until interrupted; then ends it.
  void keep();
  /// Doubts about the run, for the end of the last line.
  const std::string& endOfLine() const { return end_of_line_; }

 private:
  void openData();
  void checkConfigurations();
  void watch();
  bool over();
  void showProgress(bool last);
  void addGateway();
  void endInOrder();
  void endOne(const std::string& service);
  void endSwappedIn() const;
  void write();
  void setTruthOfPictures();
  void drawOverlay() const;
  replay::DatasetOptions dataOptions() const;

  const DemoOptions options_;
  const std::atomic<bool>& interrupted_;
  DemoFolders folders_;
  std::vector<ServicePlan> services_;
  std::optional<TruthFiles> truth_;
  std::size_t frames_ = 0;
  replay::DataFindings findings_;  ///< findings before the run
  std::string configurations_, address_, end_of_line_;
  std::unique_ptr<OutputWriter> outputs_;
  std::unique_ptr<bus::Domain> domain_;
  std::unique_ptr<bus::Participant> participant_;
  std::unique_ptr<bus::WaitLoop> loop_;
  std::unique_ptr<Reporter> reporter_;
  std::unique_ptr<Supervisor> supervisor_;
  std::int64_t shown_ns_ = 0;
};

}  // namespace perdure::tools
