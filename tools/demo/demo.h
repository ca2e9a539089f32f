// One run of the demo, from the start of the services to the report.
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
  /// Checks data, model and configuration, then starts all services. Throws StartupError.
  Demo(const DemoOptions& options, const std::atomic<bool>& interrupted);
  ~Demo() { endSwappedIn(); }
  Demo(const Demo&) = delete;
  Demo& operator=(const Demo&) = delete;

  /// Runs until all data of the drive are processed, --seconds have passed, or the demo is
  /// interrupted. Then ends the services in order (unless --keep is given) and writes the outputs.
  /// Throws StartupError if a service cannot run.
  void run();
  /// If --keep is given, keeps all services running after the drive until interrupted; then ends
  /// them.
  void keep();
  /// Warnings about the run, to be appended to the last line of the output.
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
