#include "tools/record/files.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <regex>

#include "common/base/errors.h"
#include "common/bus/topics.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/recording_writer.h"
#include "common/replay/recordings/ros_messages.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;

std::string dateOf(std::uint64_t ns) {
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC",
                     fmt::gmtime(static_cast<std::time_t>(ns / 1'000'000'000)),
                     ns / 1'000'000 % 1000);
}

/// Describes a recording of Perdure or ROS.
template <class Messages>
void printHead(const std::string& path, const Messages& recording, const char* what = "") {
  if (recording.endNs() < recording.startNs()) {
    return fmt::print("{}: {}no messages\n", path, what);
  }
  const double seconds = 1e-9 * static_cast<double>(recording.endNs() - recording.startNs());
  fmt::print("{}: {}{:.3f} s from {}\n", path, what, seconds, dateOf(recording.startNs()));
  for (const auto& [topic, counted] : recording.topics()) {
    fmt::print("  {:20} {:9} {:8.2f} Hz  {}\n", topic, counted.messages,
               seconds > 0 ? static_cast<double>(counted.messages) / seconds : 0.0, counted.type);
  }
}

template <class Messages>
void printTable(const std::string& path, const Messages& recording, const char* what = "") {
  printHead(path, recording, what);
  const ReasonCounts reasons = recording.reasons();
  for (const auto& [reason, n] : reasons.all()) fmt::print("  {}: {}\n", reason, n);
  if (!recording.lastProblem().empty()) fmt::print("  {}\n", recording.lastProblem());
  for (const std::string& note : recording.notes()) fmt::print("  {}\n", note);
}

void printInfo(const std::string& path, bool each_chunk) {
  using replay::RecordedMessages;
  if (!RecordedMessages::looksLikeOne(path) && replay::RosMessages::looksLikeOne(path)) {
    printTable(path, replay::RosMessages(path), "a recording of ROS, a drive for --data; ");
  } else {
    using Chunks = RecordedMessages::Chunks;
    printTable(path, RecordedMessages(path, each_chunk ? Chunks::kEach : Chunks::kByIndex));
  }
}

const dds_topic_descriptor_t* typeNamed(const std::string& name) {
  for (const bus::TopicInfo& info : bus::topicTable()) {
    if (info.typeName() == name) return info.type;
  }
  return nullptr;
}

/// Adds the message, encoded as XCDR1, with the IDL for that encoding.
Result<void> addPlain(replay::RecordingWriter& file, const replay::RecordedMessage& message) {
  const dds_topic_descriptor_t* type = typeNamed(message.type);
  if (type == nullptr) return fail("unknown_type", message.type);
  const std::string idl =
      std::regex_replace(wire::idlOf(message.type), std::regex("@appendable"), "@final");
  const replay::RecordingWriter::Kind kind{message.topic, message.type, idl};
  const auto* twin = wire::plainTwinOf(message.type);
  if (twin == nullptr) return file.addBytes(kind, message.data, message.log_ns);
  const auto sample = wire::CdrSample::read(message.data, *type);
  if (!sample) return tl::unexpected(sample.error());
  return file.addBytes(kind, wire::writeCdr(sample->get(), *twin), message.log_ns);
}

}  // namespace

NewFile::~NewFile() {
  std::error_code ignored;
  if (!whole_) fs::remove(file_, ignored);
}

void refuseNothing(const replay::RecordedMessages& recording, const fs::path& path) {
  const std::string& problem = recording.lastProblem();
  throw StartupError(ExitCode::kData, problem.empty()
                                          ? path.string() +
                                                ": none of its messages was wanted; "
                                                "`perdure record info` tells what it holds"
                                          : problem);
}

void refuseForeign(const fs::path& path, const ReasonCounts& reasons) {
  std::string why;
  for (const auto& [reason, n] : reasons.all()) why += fmt::format("; {}: {}", reason, n);
  throw StartupError(ExitCode::kData,
                     "{} holds no message that can be exported{}; recordings of `perdure record` "
                     "are, and `perdure record info` tells what it holds",
                     path.string(), why);
}

ReasonCounts exportPlain(const fs::path& from, const fs::path& to) {
  replay::RecordedMessages recording(from);
  auto message = recording.next();
  if (!message) refuseNothing(recording, from);
  replay::RecordingWriter file(to);
  NewFile made(to);
  ReasonCounts reasons;
  std::uint64_t exported = 0;
  for (; message; message = recording.next()) {
    const auto added = addPlain(file, *message);
    if (added) {
      ++exported;
      continue;
    }
    if (added.error().code == "disk_full" || added.error().code == "file") {
      throw StartupError(ExitCode::kInputOutput, added.error().detail);
    }
    reasons.add(message->topic + "_" + added.error().code);
  }
  reasons.add(recording.reasons());
  if (exported == 0) refuseForeign(from, reasons);
  if (const auto finished = file.finish(); !finished) {
    throw StartupError(ExitCode::kInputOutput, finished.error().detail);
  }
  made.keep();
  return reasons;
}

void addFileCommands(CLI::App& record) {
  struct Options {
    std::vector<std::string> paths;
    std::string from, to;
    bool ros2 = false, check = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* info = record.add_subcommand("info", "what recordings hold");
  info->add_option("paths", options->paths, "files, or folders of them")->required();
  info->callback([options] {
    for (const std::string& path : options->paths) printInfo(path, options->check);
  });
  info->add_flag(
      "--check", options->check,
      "unpack every chunk, which takes as long as reading it all: its counts are of what "
      "can be read, not of what the index says");
  CLI::App* fix = record.add_subcommand("repair", "finish files of a recorder that was killed");
  fix->add_option("paths", options->paths, "files, or folders of them")->required();
  fix->callback([options] { repairAll({options->paths.begin(), options->paths.end()}); });
  CLI::App* plain = record.add_subcommand(
      "export", "copy into one file that readers without XCDR2 understand too");
  plain->add_option("from", options->from, "a file, or a folder of them")->required();
  plain->add_option("to", options->to, "the new file")->required();
  plain->add_flag("--ros2", options->ros2,
                  "as a recording of ROS 2: for ros2 bag play, RViz, Foxglove, Rerun, PlotJuggler");
  plain->callback([options] {
    const auto copy = options->ros2 ? exportRos2 : exportPlain;
    const ReasonCounts reasons = copy(options->from, options->to);
    for (const auto& [reason, n] : reasons.all()) {
      fmt::print(stderr, "{}: {}\n", reason, n);
    }
  });
}

}  // namespace perdure::tools
