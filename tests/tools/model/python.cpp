#include "tests/tools/model/python.h"

#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

namespace perdure::tools::testing {
namespace {

namespace fs = std::filesystem;

fs::path source() {
  const char* folder = std::getenv("PERDURE_SOURCE");
  return folder != nullptr ? folder : ".";
}

}  // namespace

bool pythonHasOnnx() { return std::system("/usr/bin/python3 -c 'import onnx' 2> /dev/null") == 0; }

fs::path generated(const std::string& script) {
  const fs::path folder =
      fs::temp_directory_path() /
      ("perdure_" + fs::path(script).stem().string() + "_" + std::to_string(getpid()));
  fs::remove_all(folder);
  const std::string command =
      "PYTHONPATH='" + (source() / "tools/model").string() + "' /usr/bin/python3 -B '" +
      (source() / "tests/tools/model" / script).string() + "' '" + folder.string() + "'";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command + " failed");
  return folder;
}

}  // namespace perdure::tools::testing
