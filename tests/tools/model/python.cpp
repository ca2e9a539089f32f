#include "tests/tools/model/python.h"

#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

#include "common/base/subprocess.h"

namespace perdure::tools::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPython = "/usr/bin/python3";

fs::path source() {
  const char* folder = std::getenv("PERDURE_SOURCE");
  return folder != nullptr ? folder : ".";
}

}  // namespace

bool pythonHasOnnx() { return runProgram({.command = {kPython, "-c", "import onnx"}}).status == 0; }

fs::path generated(const std::string& script) {
  const fs::path folder =
      fs::temp_directory_path() /
      ("perdure_" + fs::path(script).stem().string() + "_" + std::to_string(getpid()));
  fs::remove_all(folder);
  const auto answer =
      runProgram({.command = {kPython, "-B", (source() / "tests/tools/model" / script).string(),
                              folder.string()},
                  .environment = {{"PYTHONPATH", (source() / "tools/model").string()}}});
  if (answer.status != 0) throw std::runtime_error(script + " failed: " + answer.output);
  return folder;
}

}  // namespace perdure::tools::testing
