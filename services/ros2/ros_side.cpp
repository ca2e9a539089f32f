#include "services/ros2/ros_side.h"

#include "common/base/errors.h"

namespace perdure::ros2 {

std::string wireTopic(const std::string& topic) { return "rt" + topic; }

std::string wireType(const std::string& type) {
  const auto slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

bus::Participant RosSide::participantFor(service::Context& context, const Config& config) {
  const bus::Options& bus = context.busOptions();
  if (config.domain < 0 || config.domain == bus.domain) {
    if (context.participant().identity()) {
      throw StartupError(ExitCode::kConfiguration,
                         "bus.security closes the bus, and ROS without SROS2 cannot join it: set "
                         "ros.domain to a domain of its own, as ROS_DOMAIN_ID says it to ROS");
    }
    if (!config.interface.empty() && config.interface != bus.interface) {
      throw StartupError(ExitCode::kConfiguration,
                         "ros.interface is another than bus.interface, but ros.domain is the bus's "
                         "domain, which has one interface; set ros.domain to another one");
    }
    return context.participant();
  }
  bus::Options options = bus;
  options.domain = config.domain;
  options.peers = config.peers;
  if (!config.interface.empty()) options.interface = config.interface;
  return {bus::Domain::foreign(options), "perdure ros2"};
}

RosSide::RosSide(service::Context& context, const Config& config)
    : context_(context), participant_(participantFor(context, config)) {
  context_.countReasons([this](ReasonCounts& counts) {
    for (const auto& [topic, writer] : writers_) writer->report(counts);
    for (const Input& input : inputs_) input.reader->report(counts);
  });
}

void RosSide::advertise(const ros::Outlet& outlet) {
  constexpr int kDepth = 10;
  writers_.emplace(outlet.topic, std::make_unique<bus::ForeignWriter>(
                                     participant_, bus::ForeignTopic{
                                                       .name = wireTopic(outlet.topic),
                                                       .type = wireType(outlet.type),
                                                       .latched = outlet.latched,
                                                       .depth = outlet.latched ? 1 : kDepth,
                                                   }));
}

bool RosSide::wants(const std::string& topic) const {
  const auto writer = writers_.find(topic);
  return writer != writers_.end() && writer->second->matched() > 0;
}

void RosSide::write(const ros::Outlet& outlet, std::vector<std::uint8_t> cdr) {
  const auto writer = writers_.find(outlet.topic);
  if (writer != writers_.end()) (void)writer->second->write(std::move(cdr));
}

void RosSide::read(const std::string& input, const std::string& topic, const std::string& type,
                   bool reliable, bool latched, int depth, bus::ForeignReader::Handler handler) {
  auto reader = std::make_unique<bus::ForeignReader>(
      participant_, bus::ForeignTopic{.name = wireTopic(topic),
                                      .type = wireType(type),
                                      .reliable = reliable || latched,
                                      .latched = latched,
                                      .depth = depth,
                                      .count = input});
  context_.loop().onBytes(*reader, std::move(handler));
  inputs_.push_back({topic, type, std::move(reader)});
}

std::string RosSide::unheard() const {
  for (const auto& [topic, type, reader] : inputs_) {
    if (topic == "/tf_static" || reader->matched() > 0) continue;
    return "nobody writes " + topic + " as " + type +
           ": start the driver, compare `ros2 topic info -v " + topic +
           "`, and ROS_DOMAIN_ID with the domain here";
  }
  return {};
}

}  // namespace perdure::ros2
