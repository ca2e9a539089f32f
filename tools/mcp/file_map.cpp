#include "tools/mcp/file_map.h"

#include <filesystem>

namespace perdure::tools {

FileMap::FileMap(const std::string& path)
    : path_(std::filesystem::is_directory(path) ? path + "/map.sqlite" : path) {
  (void)begin();
}

gateway::mcp::State FileMap::begin() {
  file_.emplace(path_);
  gateway::mcp::State state{file_->time(), file_->cameras(), {}, std::nullopt};
  for (map_store::EndedObject& each : file_->ended()) {
    state.ended.push_back(
        {each.end.kind, each.end.time, each.end.merged_into, std::move(each.last.belief)});
  }
  return state;
}

MapReply FileMap::ask(const MapQuery& query) {
  return query.kind == MapQueryKind::kGraph ? file_->graph(query) : file_->ask(query);
}

}  // namespace perdure::tools
