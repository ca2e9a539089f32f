// A program on eProsima Fast DDS 2.9, its types made by fastddsgen from idl/: reads `odometry` and
// `objects`, feeds `model` and `detections`, one box for each frame. What it reads goes to standard
// output, a line a message. Used by interop_test: fast_peer DOMAIN X1 Y1 X2 Y2
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

#include "detections.h"
#include "objects.h"
#include "odometryPubSubTypes.h"
#include "tests/interop/xcdr2.h"

namespace {

using namespace eprosima::fastdds::dds;
using namespace perdure::interop;
namespace rtps = eprosima::fastrtps::rtps;
namespace msg = perdure::msg;

constexpr std::uint64_t kHash = 0xfa57, kInstance = 0xfa57dd5;

void write(Xcdr2Writer& out, const msg::Detection& d) {
  out.delimited([&] {
    out.numbers(d.corners());
    out.number(static_cast<std::uint32_t>(d.activations().size()));
    for (const float a : d.activations()) out.number(a);
    out.number(static_cast<std::uint8_t>(d.has_azimuth()));
    out.number(d.azimuth());
    out.number(d.azimuth_sigma());
    out.number(static_cast<std::uint8_t>(d.primed()));
    out.numbers(d.side_sigma());
  });
}

void write(Xcdr2Writer& out, const msg::Detections& m) {
  out.delimited([&] {
    out.number(m.stamp().source());
    out.number(m.stamp().seq());
    out.number(m.stamp().time_ns());
    out.number(m.stamp().captured_ns());
    out.text(m.camera());
    out.number(m.source());
    out.number(m.model_hash());
    out.delimited([&] {
      out.number(static_cast<std::uint32_t>(m.items().size()));
      for (const auto& d : m.items()) write(out, d);
    });
  });
}

void write(Xcdr2Writer& out, const msg::ModelInfo& m) {
  out.delimited([&] {
    out.number(m.model_hash());
    out.number(m.source());
    out.text(m.name());
    out.delimited([&] {
      out.number(static_cast<std::uint32_t>(m.classes().size()));
      for (const auto& name : m.classes()) out.text(name);
    });
    out.number(m.input_width());
    out.number(m.input_height());
    out.number(m.box_sigma());
    out.number(std::uint32_t{0});  // side_insets: none
  });
}

void write(Xcdr2Writer&, const msg::Objects&) {}
void read(Xcdr2Reader&, msg::Detections&) {}
void read(Xcdr2Reader&, msg::ModelInfo&) {}

void read(Xcdr2Reader& in, msg::ObjectBelief& object) {
  in.delimited([&] {
    object.object_id(in.number<std::uint64_t>());
    object.existence(in.number<double>());
    object.confirmed(in.number<std::uint8_t>() != 0);
    in.delimited([&] {
      object.classes().resize(in.number<std::uint32_t>());
      for (auto& c : object.classes()) {
        in.delimited([&] {
          c.name(in.text());
          c.probability(in.number<double>());
          c.mean(in.numbers<double, 7>());
        });
      }
    });
  });
}

void read(Xcdr2Reader& in, msg::Objects& m) {
  in.delimited([&] {
    m.stamp().source(in.number<std::uint64_t>());
    m.stamp().seq(in.number<std::uint64_t>());
    m.stamp().time_ns(in.number<std::int64_t>());
    m.stamp().captured_ns(in.number<std::int64_t>());
    m.source(in.number<std::uint64_t>());
    m.reference().world(in.number<std::uint64_t>());
    m.reference().epoch(in.number<std::uint32_t>());
    m.T_WB().q(in.numbers<double, 4>());
    m.T_WB().p(in.numbers<double, 3>());
    m.up_W(in.numbers<double, 3>());
    m.next_object_id(in.number<std::uint64_t>());
    in.delimited([&] {
      m.items().resize(in.number<std::uint32_t>());
      for (auto& object : m.items()) read(in, object);
    });
  });
}

/// A type of Fast DDS whose bytes are XCDR2.
template <class T>
class DelimitedType : public TopicDataType {
 public:
  explicit DelimitedType(const char* name, bool keyed = false) {
    setName(name);
    m_typeSize = 1 << 16;
    m_isGetKeyDefined = keyed;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    Xcdr2Writer out;
    write(out, *static_cast<T*>(data));
    payload->length = static_cast<std::uint32_t>(out.bytes().size() + 4);
    if (payload->length > payload->max_size) return false;
    std::memcpy(payload->data, kDelimitedLittleEndian, 4);
    std::memcpy(payload->data + 4, out.bytes().data(), out.bytes().size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    if (payload->length < 4 || payload->data[1] != kDelimitedLittleEndian[1]) return false;
    try {
      Xcdr2Reader in(payload->data + 4, payload->length - 4);
      read(in, *static_cast<T*>(data));
    } catch (const std::out_of_range&) {
      return false;
    }
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] {
      Xcdr2Writer out;
      write(out, *static_cast<T*>(data));
      return static_cast<std::uint32_t>(out.bytes().size() + 4);
    };
  }
  void* createData() override { return new T; }
  void deleteData(void* data) override { delete static_cast<T*>(data); }
  /// The model's key is its hash: sixteen bytes, big-endian, the rest zero.
  bool getKey(void* data, rtps::InstanceHandle_t* handle, bool) override {
    if constexpr (std::is_same_v<T, msg::ModelInfo>) {
      for (int i = 0; i < 16; ++i) {
        handle->value[i] =
            i < 8 ? static_cast<std::uint8_t>(static_cast<T*>(data)->model_hash() >> (56 - 8 * i))
                  : 0;
      }
      return true;
    }
    return false;
  }
};

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
      topicOf(peer.participant, "perdure/ego/odometry", new msg::OdometryPubSubType), reader);
  reader.type_consistency().representation.m_value = {XCDR2_DATA_REPRESENTATION};
  peer.objects =
      in->create_datareader(topicOf(peer.participant, "perdure/ego/objects",
                                    new DelimitedType<msg::Objects>("perdure::msg::Objects")),
                            reader);
  DataWriterQos writer = DATAWRITER_QOS_DEFAULT;
  writer.reliability().kind = RELIABLE_RELIABILITY_QOS;
  writer.representation().m_value = {XCDR2_DATA_REPRESENTATION};
  writer.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
  peer.model = out->create_datawriter(
      topicOf(peer.participant, "perdure/ego/model",
              new DelimitedType<msg::ModelInfo>("perdure::msg::ModelInfo", true)),
      writer);
  writer.durability().kind = VOLATILE_DURABILITY_QOS;
  writer.history().depth = 8;
  writer.ownership().kind = EXCLUSIVE_OWNERSHIP_QOS;
  writer.ownership_strength().value = 30;
  writer.liveliness().kind = MANUAL_BY_TOPIC_LIVELINESS_QOS;
  writer.liveliness().lease_duration = {0, 300'000'000};
  writer.liveliness().announcement_period = {0, 100'000'000};
  peer.detections = out->create_datawriter(
      topicOf(peer.participant, "perdure/ego/detections",
              new DelimitedType<msg::Detections>("perdure::msg::Detections")),
      writer);
  return peer;
}

void answer(const Peer& peer, const msg::FrameStamp& stamp, const std::array<double, 4>& corners) {
  msg::Detection box;
  box.corners(corners);
  box.activations({0.0F, 4.0F, -4.0F});
  msg::Detections detections;
  detections.stamp(stamp);
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
  msg::ModelInfo model;
  model.model_hash(kHash);
  model.source(kInstance);
  model.name("fast");
  model.classes({"car", "person"});
  peer.model->write(&model);
  std::printf("ready\n");
  std::fflush(stdout);
  while (true) {
    SampleInfo info;
    msg::Odometry odometry;
    while (peer.odometry->take_next_sample(&odometry, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) answer(peer, odometry.stamp(), corners);
    }
    msg::Objects objects;
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
    peer.detections->assert_liveliness();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}
