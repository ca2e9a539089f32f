// The `perdure` command. It replaces its own process with the executable of a subcommand. The
// executables are in libexec/perdure beside the folder of this program, both in a build folder and
// in an installation.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/algorithms/nearest_word.h"
#include "common/base/errors.h"
#include "tools/perdure/commands.h"

namespace {

using perdure::ExitCode;
using Words = std::vector<std::string>;

int refuse(ExitCode code, const std::string& why) {
  std::fprintf(stderr, "%s\n", why.c_str());
  return static_cast<int>(code);
}

int flushed() {
  if (std::fflush(stdout) == 0) return static_cast<int>(ExitCode::kOk);
  return refuse(ExitCode::kInputOutput,
                std::string("perdure: standard output could not be written: ") +
                    std::strerror(errno) + "; free space on its disk, or send it to another place");
}

int printVersion() {
  std::puts(PERDURE_VERSION);
  return flushed();
}

int printHelp(const std::string& program) {
  std::printf(
      "Perdure: a persistent, metric map of objects from a camera and an IMU\n"
      "Usage: %s [OPTIONS] SUBCOMMAND\n\n"
      "Options:\n"
      "  -h,--help                   Print this help message and exit\n"
      "  --version                   Display program version information and exit\n\n"
      "Subcommands:\n",
      program.c_str());
  for (const auto& [name, summary] : perdure::tools::commands()) {
    std::printf("  %-28s%s\n", name, summary);
  }
  std::printf("  %-28sThe same as SUBCOMMAND --help\n", "help SUBCOMMAND");
  return flushed();
}

int refuseUnknown(const std::string& word) {
  std::vector<std::string> names;
  for (const auto& command : perdure::tools::commands()) names.emplace_back(command.name);
  const bool option = word.starts_with('-');
  const std::string nearest = option ? "" : perdure::nearestWord(word, names);
  return refuse(ExitCode::kUsage, "'" + word + "' is not " +
                                      (option ? "an option" : "a subcommand") + " of perdure" +
                                      (nearest.empty() ? "" : "; did you mean " + nearest + "?") +
                                      "\nRun with --help for more information.");
}

/// Replaces this process with a subcommand. Returns only if the executable cannot be started.
int start(const std::string& program, const std::string& name, const Words& arguments) {
  // argv[0] of the new process, so that `ps` shows the command line as the user typed it.
  std::string called = program + " " + name;
  std::vector<char*> words{called.data()};
  for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const auto folder = std::filesystem::read_symlink("/proc/self/exe").parent_path().parent_path() /
                      "libexec/perdure";
  const std::string path = folder / name;
  execv(path.c_str(), words.data());
  return refuse(ExitCode::kUnavailable,
                "perdure: " + path + " cannot be started: " + std::strerror(errno) +
                    "; build it: cmake --build --preset release --target perdure-command-" + name +
                    ", or install the package perdure-tools");
}

int run(const std::string& program, Words words) {
  if (words.empty()) {
    return refuse(ExitCode::kUsage,
                  "A subcommand is required\nRun with --help for more information.");
  }
  if (words[0] == "help" && words.size() > 1) words = {words[1], "--help"};
  const std::string word = words[0];
  words.erase(words.begin());
  if (word == "-h" || word == "--help" || word == "help") return printHelp(program);
  if (word == "--version") return printVersion();
  for (const auto& command : perdure::tools::commands()) {
    if (word == command.name) return start(program, word, words);
  }
  return refuseUnknown(word);
}

}  // namespace

int main(int argc, char** argv) {
  return run(argc > 0 ? argv[0] : "perdure", Words(argv + std::min(argc, 1), argv + argc));
}
