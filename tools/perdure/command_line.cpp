#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <system_error>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "tools/perdure/commands.h"

namespace perdure::tools {
namespace {

int refuseOutput(const std::string& why) {
  std::cerr << "perdure: standard output could not be written whole"
            << (why.empty() ? "" : " (" + why + ")") << "; free space, or send it elsewhere"
            << std::endl;
  return static_cast<int>(ExitCode::kInputOutput);
}

/// Returns `status`, or an error status if output was lost because of a full disk or a closed file.
int checkedOutput(int status) {
  errno = 0;
  std::cout.flush();
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
  if (written || status != static_cast<int>(ExitCode::kOk)) return status;
  return refuseOutput(errno != 0 ? std::strerror(errno) : "");
}

int run(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = app.exit(error) == 0;
    return static_cast<int>(asked_for_help ? ExitCode::kOk : ExitCode::kUsage);
  } catch (const StartupError& error) {
    std::cerr << "perdure: " << error.what() << std::endl;
    return static_cast<int>(error.code());
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string forbidden = whyUnreadable(error.path1());
    std::cerr << "perdure: " << (forbidden.empty() ? error.what() : forbidden) << std::endl;
    return static_cast<int>(ExitCode::kUnavailable);
  } catch (const std::system_error& error) {
    if (std::ferror(stdout) != 0) return refuseOutput(error.code().message());  // by fmt::print
    std::cerr << "perdure: " << error.what() << std::endl;
    return static_cast<int>(ExitCode::kFailure);
  } catch (const std::exception& error) {
    std::cerr << "perdure: " << error.what() << std::endl;
    return static_cast<int>(ExitCode::kFailure);
  }
  return static_cast<int>(ExitCode::kOk);
}

/// Refuses numbers that are not finite, because CLI11's range checks accept "nan".
void refuseInfinite(CLI::App& app) {
  const CLI::Validator finite(
      [](std::string& text) {
        const double value = std::strtod(text.c_str(), nullptr);
        return std::isfinite(value) ? std::string() : text + " is no finite number";
      },
      "", "finite");
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name().starts_with("FLOAT")) option->check(finite);
  }
  for (CLI::App* nested : app.get_subcommands({})) refuseInfinite(*nested);
}

}  // namespace

int runCommand(const char* name, void (*set_up)(CLI::App&), int argc, char** argv) {
  const auto entry = std::ranges::find(commands(), std::string(name), &CommandEntry::name);
  check(entry != commands().end(), "a subcommand has a line in tools/perdure/commands.cpp");
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the file size limit fails like on a full disk
  CLI::App app(entry->summary, std::string("perdure ") + name);
  set_up(app);
  refuseInfinite(app);
  return checkedOutput(run(app, argc, argv));
}

}  // namespace perdure::tools
