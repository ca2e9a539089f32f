// A ROS 2 node as rmw_fastrtps makes it: a participant of Fast DDS with its default transports,
// names by ROS' rules, and rclcpp's default qualities of service.
#pragma once

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <string>

#include "ros2PubSubTypes.h"

namespace perdure::test {

namespace fast = eprosima::fastdds::dds;

/// rclcpp's SensorDataQoS, its default for publishers and subscribers, and tf2's QoS of static
/// transforms.
enum class Quality { kSensor, kDefault, kLatched };

class RosNode {
 public:
  explicit RosNode(std::uint32_t domain)
      : participant_(fast::DomainParticipantFactory::get_instance()->create_participant(
            domain, fast::PARTICIPANT_QOS_DEFAULT)) {
    if (participant_ == nullptr) return;
    publisher_ = participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  }
  /// Announces its departure to the other participants.
  ~RosNode() {
    if (participant_ == nullptr) return;
    participant_->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  RosNode(const RosNode&) = delete;
  RosNode& operator=(const RosNode&) = delete;

  template <class PubSubType>
  fast::DataReader* reader(const std::string& topic, Quality quality) {
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    set(qos, quality);
    return subscriber_->create_datareader(topicOf<PubSubType>(topic), qos);
  }
  template <class PubSubType>
  fast::DataWriter* writer(const std::string& topic, Quality quality) {
    fast::DataWriterQos qos = fast::DATAWRITER_QOS_DEFAULT;
    set(qos, quality);
    qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;
    return publisher_->create_datawriter(topicOf<PubSubType>(topic), qos);
  }

 private:
  template <class Qos>
  static void set(Qos& qos, Quality quality) {
    const bool sensor = quality == Quality::kSensor, latched = quality == Quality::kLatched;
    qos.reliability().kind =
        sensor ? fast::BEST_EFFORT_RELIABILITY_QOS : fast::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind =
        latched ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = latched ? 1 : sensor ? 5 : 10;
    qos.endpoint().history_memory_policy =
        eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  }
  template <class PubSubType>
  fast::Topic* topicOf(const std::string& name) {
    fast::TypeSupport support(new PubSubType);
    support.register_type(participant_);
    auto& topic = topics_[name];
    if (topic == nullptr)
      topic =
          participant_->create_topic("rt" + name, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    return topic;
  }

  fast::DomainParticipant* participant_;
  fast::Publisher* publisher_ = nullptr;
  fast::Subscriber* subscriber_ = nullptr;
  std::map<std::string, fast::Topic*> topics_;
};

}  // namespace perdure::test
