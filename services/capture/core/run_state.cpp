#include "services/capture/core/run_state.h"

#include <sstream>

namespace perdure::capture {

std::string toText(const RunState& s) {
  std::ostringstream text;
  text << "perdure-run 1\n"
       << s.drive << "\n"
       << s.boot << "\n"
       << s.start_ns << " " << s.origin_ns << " " << s.last_ns << " " << s.next_sequence << " "
       << (s.finished ? 1 : 0) << " end\n";
  return text.str();
}

std::optional<RunState> runStateFrom(const std::string& text) {
  std::istringstream in(text);
  std::string head, end;
  RunState s;
  int finished = 0;
  std::getline(in, head);
  std::getline(in, s.drive);
  std::getline(in, s.boot);
  in >> s.start_ns >> s.origin_ns >> s.last_ns >> s.next_sequence >> finished >> end;
  if (!in || head != "perdure-run 1" || end != "end") return std::nullopt;
  s.finished = finished == 1;
  return s;
}

}  // namespace perdure::capture
