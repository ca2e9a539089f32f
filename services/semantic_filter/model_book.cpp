#include "services/semantic_filter/model_book.h"

#include <algorithm>

namespace perdure::semantic_filter {
namespace {

constexpr std::size_t kMaxModels = 64;
constexpr std::size_t kMaxNamed = 8;  // largest number of classes in a sentence

/// Returns a text of the classes of `model` that `other` lacks: "; new classes: a, b and 3 more".
std::string beyond(const Model& model, const Model& other, const std::string& title) {
  std::string text;
  std::size_t n = 0;
  for (const auto& name : model.classes) {
    if (other.index.contains(name) || ++n > kMaxNamed) continue;
    text += (text.empty() ? "" : ", ") + name;
  }
  if (n > kMaxNamed) text += " and " + std::to_string(n - kMaxNamed) + " more";
  return n == 0 ? "" : "; " + title + ": " + text;
}

/// Whether `now` is `before` with more classes. The list grows if classes first appear during a
/// file of detections.
bool continues(const ModelInfo& now, const ModelInfo& before) {
  const auto begins = [](const auto& longer, const auto& list) {
    return list.size() <= longer.size() && std::equal(list.begin(), list.end(), longer.begin());
  };
  return now.name == before.name && now.classes.size() > before.classes.size() &&
         begins(now.classes, before.classes) && begins(now.side_insets, before.side_insets) &&
         now.input_width == before.input_width && now.input_height == before.input_height &&
         now.box_sigma == before.box_sigma && now.boxes == before.boxes;
}

}  // namespace

Result<void> ModelBook::add(const ModelInfo& info) {
  if (const auto known = find(info.hash)) {
    if (known->classes == info.classes) return {};
    return fail("model_contradicts_its_hash", info.name);
  }
  Model model = makeModel(info, priors_);
  const auto earlier = std::find_if(order_.rbegin(), order_.rend(), [&](std::uint64_t hash) {
    return entries_.at(hash).info.name == info.name;
  });
  if (earlier != order_.rend()) {
    const Entry& before = entries_.at(*earlier);
    if (continues(info, before.info)) model.network = before.model->network;
  }
  entries_.emplace(info.hash, Entry{info, std::make_shared<const Model>(std::move(model))});
  order_.push_back(info.hash);
  if (order_.size() <= kMaxModels) return {};
  if (order_.front() == used_) {  // keep the model in use
    order_.pop_front();
    order_.push_back(used_);
  }
  entries_.erase(order_.front());
  order_.pop_front();
  return {};
}

std::shared_ptr<const Model> ModelBook::find(std::uint64_t hash) const {
  const auto it = entries_.find(hash);
  return it == entries_.end() ? nullptr : it->second.model;
}

std::optional<std::string> ModelBook::use(std::uint64_t hash, TimePoint time) {
  const bool first = used_ == 0;
  if (!first && time < used_at_) return std::nullopt;
  used_at_ = time;
  if (hash == used_) return std::nullopt;
  const std::uint64_t before = std::exchange(used_, hash);
  const auto from = entries_.find(before);
  if (first || from == entries_.end()) return std::nullopt;
  const Entry& to = entries_.at(hash);
  return to.info.name + " instead of " + from->second.info.name +
         beyond(*to.model, *from->second.model, "new classes") +
         beyond(*from->second.model, *to.model, "kept without new evidence");
}

}  // namespace perdure::semantic_filter
