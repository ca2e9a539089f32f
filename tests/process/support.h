// Support for tests of real programs: a separate network, child processes, a temporary folder.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/subprocess.h"
#include "common/bus/domain.h"

namespace perdure::test {

/// Gives this process and its children a separate loopback network if that is permitted. Otherwise
/// it leases a DDS domain that no other test of this machine uses. Later calls return the same
/// result.
const bus::Options& ownNetwork();

/// Gives this process and its children a separate empty /tmp and /dev/shm if that is permitted.
/// Programs that communicate through files there, such as iceoryx, then cannot reach other tests.
bool ownFiles();

/// The folder of the built programs and the root of the sources, as ctest sets them.
std::filesystem::path programs();
std::filesystem::path sources();
/// Returns a file or folder of the test data; empty if it does not exist.
std::filesystem::path data(const std::string& name);

class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// A program that runs beside the test. The destructor kills it and waits for its end.
class Child {
 public:
  /// Writes standard output and error to the file `log`.
  Child(std::vector<std::string> command, std::string log);

  pid_t pid() const { return process_.pid(); }
  void signal(int number) const { process_.signal(number); }
  /// Returns the exit status, or 128 + the signal that ended the program, or -1 if it still runs
  /// after `longest`.
  int wait(std::chrono::milliseconds longest);
  std::string log() const;

 private:
  std::string log_;
  Subprocess process_;
};

/// Calls `so` every 20 ms until it returns true; returns false after `longest`.
bool eventually(std::chrono::milliseconds longest, const std::function<bool()>& so);

std::string contentsOf(const std::filesystem::path& file);

}  // namespace perdure::test
