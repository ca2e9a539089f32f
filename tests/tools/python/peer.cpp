// The C++ side of the tests of tools/python. `write` publishes and prints one random message of
// each topic. `read` prints the messages of vehicle "back" until it has received one of each topic.
#include <functional>
#include <iostream>
#include <list>
#include <memory>
#include <set>
#include <thread>

#include "common/bus/wait_loop.h"
#include "common/wire/json.h"
#include "tests/common/wire/examples.h"

namespace perdure::bus {
namespace {

using namespace std::chrono_literals;

template <class Visit>
void forEachTopic(Visit visit) {
  for (const TopicInfo& info : topicTable()) {
    withTopic(std::string(info.name) + (info.name.ends_with('/') ? "cam0" : ""), visit);
  }
}

void print(const std::string& topic, const nlohmann::ordered_json& value) {
  std::cout << nlohmann::ordered_json{{"topic", topic}, {"value", value}}.dump() << std::endl;
}

/// Returns 0 if each reader has received all messages.
int writeAll(const Participant& participant, unsigned seed) {
  std::list<std::shared_ptr<RawWriter>> writers;
  std::list<std::function<void()>> writes;
  std::list<std::pair<std::string, nlohmann::ordered_json>> messages;
  forEachTopic([&]<class T>(const Topic<T>& topic) {
    auto writer = std::make_shared<Writer<T>>(participant, topic, WriterOptions{.strength = 3});
    writers.push_back(writer);
    for (int i = 0; i < 500 && writer->matched() == 0; ++i) std::this_thread::sleep_for(20ms);
    writes.push_back([writer, seed, &messages, name = topic.name] {
      T message;
      wire::Examples(seed).fill(message);
      if (const auto written = writer->write(message); !written) {
        std::cerr << name << ": " << written.error().code << ' ' << written.error().detail << '\n';
        std::exit(1);
      }
      messages.emplace_back(name, wire::toJson(message));
    });
  });
  std::this_thread::sleep_for(300ms);  // predictions are best effort: both ends must be matched
  for (const auto& write : writes) write();
  for (const auto& writer : writers) {
    if (!writer->waitForAcknowledgement(5)) return 1;
  }
  std::this_thread::sleep_for(200ms);
  // Printed last: the test does not read the pipe while it waits for the messages.
  for (const auto& [topic, value] : messages) print(topic, value);
  return 0;
}

int readAll(const Participant& participant) {
  WaitLoop loop(participant);
  std::list<std::shared_ptr<RawReader>> readers;
  std::set<std::string> missing;
  forEachTopic([&]<class T>(const Topic<T>& topic) {
    auto reader = std::make_shared<Reader<T>>(participant, topic);
    missing.insert(topic.name);
    loop.on<T>(*reader, [&missing, &loop, name = topic.name](const T& message) {
      print(name, wire::toJson(message));
      missing.erase(name);
      if (missing.empty()) loop.stop();
    });
    readers.push_back(std::move(reader));
  });
  std::cout << "ready" << std::endl;
  loop.every(20s, [&] { loop.stop(); });
  loop.run();
  for (const std::string& name : missing) std::cerr << "nothing came on " << name << '\n';
  ReasonCounts counts;
  for (const auto& reader : readers) {
    reader->report(counts);
    loop.off(*reader);
  }
  for (const auto& [reason, n] : counts.all()) std::cerr << reason << ": " << n << '\n';
  return missing.empty() ? 0 : 1;
}

}  // namespace
}  // namespace perdure::bus

int main(int argc, char** argv) {
  using namespace perdure::bus;
  const std::string what = argc > 1 ? argv[1] : "";
  Options options;
  if (what == "read") options.vehicle = "back";
  const Domain domain(options);
  const Participant participant(domain, "peer");
  if (what == "read") return readAll(participant);
  return what == "write" && argc > 2 ? writeAll(participant, std::stoul(argv[2])) : 64;
}
