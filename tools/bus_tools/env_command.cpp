#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "common/base/errors.h"
#include "tools/bus_tools/common.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

std::string singleQuoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

void printEnvironment(const bus::Options& given) {
  const bus::Options options = bus::withEnvironment(given);
  if (!options.security.empty() && options.identity.empty()) {
    throw StartupError(ExitCode::kUsage,
                       "bus.security is set: --identity NAME says whose identity other programs "
                       "take; `perdure security list` shows those there are");
  }
  std::cout << "export CYCLONEDDS_URI=" << singleQuoted(bus::foreignXml(options)) << '\n';
  if (options.domain != 0) std::cout << "export PERDURE_DOMAIN=" << options.domain << '\n';
}

}  // namespace

void setUpEnv(CLI::App& command) {
  auto options = std::make_shared<bus::Options>();
  addBusOptions(command, *options);
  command.callback([options] { printEnvironment(*options); });
}

}  // namespace perdure::tools
