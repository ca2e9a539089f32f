// A map's file as the MCP server asks it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "services/gateway/mcp/map.h"
#include "tools/map/correct_file.h"
#include "tools/map/map_source.h"

namespace perdure::tools {

class FileMap : public gateway::mcp::Map {
 public:
  /// `path`: a map's file, or a folder with map.sqlite. Throws StartupError if it is not readable.
  explicit FileMap(const std::string& path, bool takes_corrections = false)
      : takes_corrections_(takes_corrections),
        path_(std::filesystem::is_directory(path) ? path + "/map.sqlite" : path) {
    file_.emplace(path_);
  }

  /// Reads the file again, because a service may write it.
  gateway::mcp::State begin() override {
    file_.emplace(path_);
    gateway::mcp::State state{file_->time(), file_->cameras(), {}, std::nullopt};
    for (auto& [last, end] : file_->ended()) {
      state.ended.push_back({end.kind, end.time, end.merged_into, std::move(last.belief)});
    }
    return state;
  }
  MapReply ask(const MapQuery& query) override {
    return query.kind == MapQueryKind::kGraph ? file_->graph(query) : file_->ask(query);
  }
  bool takesCorrections() const override { return takes_corrections_; }
  Correction correct(const Correction& correction) override {
    file_.reset();  // the file is written alone
    const MapReply reply = correctFile(path_, correction);
    file_.emplace(path_);
    if (!reply.ok) throw gateway::mcp::NoAnswer(reply.error);
    if (reply.corrections.empty()) throw gateway::mcp::NoAnswer("the reply lacks the correction");
    return reply.corrections.front();
  }

 private:
  const bool takes_corrections_;
  std::string path_;
  std::optional<MapFile> file_;
};

}  // namespace perdure::tools
