#include "common/base/subprocess.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <thread>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "common/base/process/descriptor.h"

namespace perdure {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kStep{10};

[[noreturn]] void refuse(const std::string& program, const std::string& why) {
  throw StartupError(ExitCode::kUnavailable, program + " cannot be started: " + why);
}

struct Pipe {
  Descriptor read_end, write_end;
  Pipe() {
    int ends[2];
    check(pipe2(ends, O_CLOEXEC) == 0, "a pipe can be made");
    read_end = Descriptor(ends[0]), write_end = Descriptor(ends[1]);
  }
};

/// Returns the environment of this process, with the variables of `more` added or replaced, as
/// "NAME=value" strings.
std::vector<std::string> environmentWith(const std::map<std::string, std::string>& more) {
  std::vector<std::string> words;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string word = *entry;
    if (!more.contains(word.substr(0, word.find('=')))) words.push_back(word);
  }
  for (const auto& [name, value] : more) words.push_back(name + "=" + value);
  return words;
}

std::vector<char*> pointersTo(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// Data of the child. They are prepared before fork(), because after it only system calls are safe.
struct Start {
  const ProgramOptions& options;
  std::string program;
  int output;  ///< -1: the output of this process
  int report;  ///< pipe that receives errno if the program cannot be run
  std::vector<std::string> words = options.command,
                           variables = environmentWith(options.environment);
  std::vector<char*> arguments = pointersTo(words), environment = pointersTo(variables);
  pid_t parent = getpid();
};

[[noreturn]] void becomeProgram(const Start& start) {
  if (start.options.own_session) {
    setsid();
    dup2(open("/dev/null", O_RDONLY), STDIN_FILENO);
  }
  if (start.options.ends_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != start.parent) _exit(127);
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  if (start.output >= 0) {
    dup2(start.output, STDOUT_FILENO);
    dup2(start.output, STDERR_FILENO);
  }
  if (start.options.folder.empty() || chdir(start.options.folder.c_str()) == 0) {
    execve(start.program.c_str(), start.arguments.data(), start.environment.data());
  }
  const int why = errno;
  (void)!write(start.report, &why, sizeof why);
  _exit(127);
}

/// Starts the program and returns its process id. Throws StartupError if it cannot be started.
pid_t launch(const ProgramOptions& options, int output) {
  check(!options.command.empty(), "a command names its program");
  const auto program = findProgram(options.command[0]);
  if (!program) refuse(options.command[0], "it is not in PATH");
  Pipe report;
  const Start start{options, program->string(), output, report.write_end.get()};
  const pid_t pid = fork();
  if (pid < 0) refuse(options.command[0], std::strerror(errno));
  if (pid == 0) becomeProgram(start);
  report.write_end.close();
  int why = 0;
  ssize_t n = 0;
  do n = read(report.read_end.get(), &why, sizeof why);
  while (n < 0 && errno == EINTR);
  if (n != static_cast<ssize_t>(sizeof why)) return pid;  // execve closed the pipe
  waitpid(pid, nullptr, 0);
  refuse(options.command[0], std::strerror(why));
}

int statusOf(int wait_status) {
  return WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
}

/// Reads until the other end of `fd` is closed. Returns false if it is still open at `end`.
bool readAll(int fd, std::string& text, Clock::time_point end) {
  char buffer[4096];
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    pollfd ready{.fd = fd, .events = POLLIN, .revents = 0};
    const int state = left.count() > 0 ? poll(&ready, 1, static_cast<int>(left.count())) : 0;
    if (state == 0) return false;
    if (state < 0) continue;  // a signal arrived
    const ssize_t n = read(fd, buffer, sizeof buffer);
    if (n == 0) return true;
    if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
  }
}

}  // namespace

std::optional<std::filesystem::path> findProgram(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const char* folders = std::getenv("PATH");
  std::istringstream list(folders != nullptr ? folders : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(list, folder, ':');) {
    const auto path = std::filesystem::path(folder.empty() ? "." : folder) / name;
    std::error_code ignored;
    if (access(path.c_str(), X_OK) == 0 && !std::filesystem::is_directory(path, ignored)) {
      return path;
    }
  }
  return std::nullopt;
}

Subprocess::Subprocess(const ProgramOptions& options) {
  Descriptor log;
  if (!options.log.empty()) {
    log = Descriptor(open(options.log.c_str(), O_CREAT | O_APPEND | O_WRONLY | O_CLOEXEC, 0644));
    if (!log.open()) {
      refuse(options.command[0],
             options.log.string() + " cannot be written: " + std::strerror(errno));
    }
  }
  pid_ = launch(options, log.get());
}

Subprocess::~Subprocess() {
  if (left_alone_ || ended()) return;
  signal(SIGKILL);
  waitForEnd();
}

void Subprocess::signal(int number) const {
  if (!status_) kill(pid_, number);
}

std::optional<int> Subprocess::ended() {
  int status = 0;
  if (!status_ && waitpid(pid_, &status, WNOHANG) == pid_) status_ = statusOf(status);
  return status_;
}

int Subprocess::waitForEnd() {
  int status = 0;
  while (!status_) {
    if (waitpid(pid_, &status, 0) == pid_) status_ = statusOf(status);
  }
  return *status_;
}

std::optional<int> Subprocess::wait(std::chrono::milliseconds longest) {
  const auto end = Clock::now() + longest;
  while (!ended() && Clock::now() < end) std::this_thread::sleep_for(kStep);
  return status_;
}

void Subprocess::stop(std::chrono::milliseconds patience) {
  if (ended()) return;
  signal(SIGTERM);
  if (wait(patience)) return;
  signal(SIGKILL);
  waitForEnd();
}

ProgramAnswer runProgram(const ProgramOptions& options, std::chrono::milliseconds longest) {
  check(options.log.empty(), "what it prints is kept, not logged");
  const auto end = Clock::now() + longest;
  Pipe output;
  const pid_t pid = launch(options, output.write_end.get());
  output.write_end.close();
  ProgramAnswer answer;
  answer.too_late = !readAll(output.read_end.get(), answer.output, end);
  int status = 0;
  // The process may run on after it has closed its output.
  while (!answer.too_late && waitpid(pid, &status, WNOHANG) == 0) {
    answer.too_late = Clock::now() >= end;
    std::this_thread::sleep_for(kStep);
  }
  if (answer.too_late) {
    kill(pid, SIGKILL);
    waitpid(pid, &status, 0);
  }
  answer.status = statusOf(status);
  return answer;
}

}  // namespace perdure
