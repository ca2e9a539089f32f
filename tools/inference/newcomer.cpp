#include "tools/inference/newcomer.h"

#include <fstream>

namespace perdure::tools {

Newcomer::Newcomer(const std::vector<std::string>& command, const std::string& log)
    : log_(log), process_({.command = command, .log = log, .own_session = true}) {
  process_.leaveAlone();
}

std::string Newcomer::lastLine() const {
  std::ifstream file(log_);
  std::string last;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

}  // namespace perdure::tools
