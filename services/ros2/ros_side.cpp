#include "services/ros2/ros_side.h"

#include "common/base/errors.h"
#include "common/bus/interfaces.h"

namespace perdure::ros2 {

std::string wireTopic(const std::string& topic) { return "rt" + topic; }

std::string wireType(const std::string& type) {
  const auto slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

bus::Domain RosSide::domainFor(service::Context& context, const Config& config) {
  bus::Options options = context.busOptions();
  const bool same = config.domain < 0 || config.domain == options.domain;
  if (same && context.participant().identity()) {
    throw StartupError(ExitCode::kConfiguration,
                       "bus.security closes the bus, and ROS without SROS2 cannot join it: set "
                       "ros.domain to a domain of its own, as ROS_DOMAIN_ID says it to ROS");
  }
  if (!same) options.domain = config.domain;
  options.peers = config.peers;
  options.interface = config.interface;
  bus::Domain domain = bus::Domain::foreign(options);
  context.log().info(
      "meets ROS nodes with ROS_DOMAIN_ID={} (ros.domain) on {} (ros.interface), {}",
      options.domain, domain.options().interface,
      options.peers.empty() ? "found by multicast; without it set ros.peers" : "at ros.peers");
  return domain;
}

RosSide::RosSide(service::Context& context, const Config& config)
    : context_(context),
      all_interfaces_(config.interface.empty()),
      domain_(domainFor(context, config)),
      participant_(domain_, "perdure ros2") {
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

std::string RosSide::trouble() const {
  const std::string interfaces = bus::interfacesUp(), &joined = domain_.options().interface;
  if (all_interfaces_ && joined.starts_with("lo") && interfaces != joined) {
    return "the network interfaces were " + joined + " at the start and are " + interfaces +
           ": restart perdure-ros2, or set ros.interface";
  }
  for (const auto& [topic, type, reader] : inputs_) {
    if (topic == "/tf_static" || reader->matched() > 0) continue;
    return "nobody writes " + topic + " as " + type +
           ": start the driver, compare `ros2 topic info -v " + topic +
           "`, and ROS_DOMAIN_ID with the domain here";
  }
  return {};
}

}  // namespace perdure::ros2
