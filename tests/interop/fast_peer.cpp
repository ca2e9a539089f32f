// A program on eProsima Fast DDS 2.9 with types that fastddsgen generated from idl/. It reads
// `odometry` directly and `objects` through the gateway. It writes `model` and `detections` to the
// gateway, one box for each frame. It prints one line for each message. interop_test uses it.
// usage: fast_peer DOMAIN X1 Y1 X2 Y2
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <thread>

#include "final/detectionsPubSubTypes.h"
#include "final/objectsPubSubTypes.h"
#include "odometryPubSubTypes.h"

namespace {

using namespace eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace fin = perdure::fin;

constexpr std::uint64_t kHash = 0xfa57, kInstance = 0xfa57dd5;

/// Loopback without multicast, as Perdure's processes use it.
DomainParticipant* joinLoopback(std::uint32_t domain) {
  DomainParticipantQos qos;
  qos.name("fast_peer");
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back("127.0.0.1");
  udp->maxInitialPeersRange = 60;
  qos.transport().user_transports.push_back(udp);
  rtps::Locator_t peer;
  rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
  qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  rtps::Locator_t own;
  rtps::IPLocator::setIPv4(own, 127, 0, 0, 1);
  qos.wire_protocol().builtin.metatrafficUnicastLocatorList.push_back(own);
  return DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

template <class Type>
Topic* topicOf(DomainParticipant* participant, const char* name, Type* type) {
  TypeSupport support(type);
  support.register_type(participant);
  return participant->create_topic(name, support.get_type_name(), TOPIC_QOS_DEFAULT);
}

struct Peer {
  DomainParticipant* participant;
  DataReader *odometry, *objects;
  DataWriter *model, *detections;
};

Peer join(std::uint32_t domain) {
  Peer peer{};
  peer.participant = joinLoopback(domain);
  if (!peer.participant) return peer;
  auto* in = peer.participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  auto* out = peer.participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  DataReaderQos reader = DATAREADER_QOS_DEFAULT;
  reader.reliability().kind = RELIABLE_RELIABILITY_QOS;
  reader.history().depth = 64;
  peer.odometry = in->create_datareader(
      topicOf(peer.participant, "perdure/ego/odometry", new perdure::msg::OdometryPubSubType),
      reader);
  peer.objects = in->create_datareader(
      topicOf(peer.participant, "perdure/ego/final/objects", new fin::ObjectsPubSubType), reader);
  DataWriterQos writer = DATAWRITER_QOS_DEFAULT;
  writer.reliability().kind = RELIABLE_RELIABILITY_QOS;
  writer.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
  peer.model = out->create_datawriter(
      topicOf(peer.participant, "perdure/ego/final/model", new fin::ModelInfoPubSubType), writer);
  writer.durability().kind = VOLATILE_DURABILITY_QOS;
  writer.history().depth = 8;
  peer.detections = out->create_datawriter(
      topicOf(peer.participant, "perdure/ego/final/detections", new fin::DetectionsPubSubType),
      writer);
  return peer;
}

void answer(const Peer& peer, const perdure::msg::FrameStamp& stamp,
            const std::array<double, 4>& corners) {
  fin::Detection box;
  box.corners(corners);
  box.activations({0.0F, 4.0F, -4.0F});
  fin::Detections detections;
  detections.stamp().source(stamp.source());
  detections.stamp().seq(stamp.seq());
  detections.stamp().time_ns(stamp.time_ns());
  detections.stamp().captured_ns(stamp.captured_ns());
  detections.camera("cam0");
  detections.source(kInstance);
  detections.model_hash(kHash);
  detections.items().push_back(box);
  peer.detections->write(&detections);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) return 64;
  std::array<double, 4> corners;
  for (int i = 0; i < 4; ++i) corners[static_cast<std::size_t>(i)] = std::atof(argv[2 + i]);
  const Peer peer = join(static_cast<std::uint32_t>(std::atoi(argv[1])));
  if (!peer.odometry || !peer.objects || !peer.model || !peer.detections) return 69;
  fin::ModelInfo model;
  model.model_hash(kHash);
  model.source(kInstance);
  model.name("fast");
  model.classes({"car", "person"});
  peer.model->write(&model);
  std::printf("ready\n");
  std::fflush(stdout);
  while (true) {
    SampleInfo info;
    perdure::msg::Odometry odometry;
    while (peer.odometry->take_next_sample(&odometry, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) answer(peer, odometry.stamp(), corners);
    }
    fin::Objects objects;
    while (peer.objects->take_next_sample(&objects, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      std::printf("frame %lu next %lu objects %zu", objects.stamp().seq(), objects.next_object_id(),
                  objects.items().size());
      for (const auto& o : objects.items()) {
        const auto& best = o.classes().front();
        std::printf(" | %lu %s %.3f %.2f %.2f %.2f", o.object_id(), best.name().c_str(),
                    o.existence(), best.mean()[0], best.mean()[1], best.mean()[2]);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}
