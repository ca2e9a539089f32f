// For tests of real programs: a network of their own, child processes, a folder that goes away.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/subprocess.h"
#include "common/bus/domain.h"

namespace perdure::test {

/// Gives this process (and its children) a loopback network of its own, where that is allowed; else
/// leases a DDS domain that no other test of this machine uses. Once a process; later calls agree.
const bus::Options& ownNetwork();

/// Gives this process (and its children) an empty /tmp and /dev/shm of their own, where that is
/// allowed: what speaks through files there, as iceoryx does, meets no other test.
bool ownFiles();

/// The folder of the built programs and the root of the sources, as ctest says.
std::filesystem::path programs();
std::filesystem::path sources();
/// A folder or file below the data that tests may use; empty where it is absent.
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

/// A program that runs beside the test. Killed and waited for at the end of the scope.
class Child {
 public:
  /// Its standard output and error go to the file `log`.
  Child(std::vector<std::string> command, std::string log);

  pid_t pid() const { return process_.pid(); }
  void signal(int number) const { process_.signal(number); }
  /// Exit status, or 128 + the signal that ended it; -1 where it still runs after `longest`.
  int wait(std::chrono::milliseconds longest);
  std::string log() const;

 private:
  std::string log_;
  Subprocess process_;
};

/// Asks every 20 ms until it is so; false after `longest`.
bool eventually(std::chrono::milliseconds longest, const std::function<bool()>& so);

std::string contentsOf(const std::filesystem::path& file);

}  // namespace perdure::test
