#include "services/capture/vehicle/socket_stream.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <vector>

#include "services/capture/live/clocks.h"

namespace perdure::capture {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

bool waitFor(const std::function<bool()>& done, std::chrono::milliseconds most = 5000ms) {
  for (const auto end = std::chrono::steady_clock::now() + most;
       std::chrono::steady_clock::now() < end;) {
    if (done()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return false;
}

/// A UDP socket of this test, and a port that no other program uses.
struct Sender {
  Sender() : socket(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int probe = ::socket(AF_INET, SOCK_DGRAM, 0);
    (void)::bind(probe, reinterpret_cast<sockaddr*>(&any), sizeof any);
    socklen_t size = sizeof to;
    (void)::getsockname(probe, reinterpret_cast<sockaddr*>(&to), &size);
    ::close(probe);
  }
  ~Sender() { ::close(socket); }
  void send(const std::string& text) const {
    (void)::sendto(socket, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                   sizeof to);
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(ntohs(to.sin_port)); }
  int socket;
  sockaddr_in to{};
};

TEST(SocketStream, GivesDatagramsWithTheTimeOfTheirArrival) {
  const Sender sender;
  std::mutex mutex;
  std::vector<std::string> heard;
  std::int64_t time_ns = 0;
  SocketStream stream("speed", "speed at test", 1500ms, udpSocket(sender.address()),
                      [&](const Packet& packet) {
                        const std::lock_guard lock(mutex);
                        heard.emplace_back(packet.bytes.begin(), packet.bytes.end());
                        time_ns = packet.time_ns;
                      });
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return heard.size();
  };
  ASSERT_TRUE(waitFor([&] {
    sender.send("12.5");
    return count() > 0;
  }));
  EXPECT_LT(std::abs(HostClock::nowNs() - time_ns), 5'000'000'000);
  EXPECT_EQ(stream.state().problem(), "");
  EXPECT_EQ(stream.state().name(), "speed at test");
  sender.send("");  // an empty datagram does not end the stream
  ASSERT_TRUE(waitFor([&] { return stream.state().reasons().of("speed_silent") == 1; }));
  EXPECT_THAT(stream.state().problem(), HasSubstr("says nothing"));
  EXPECT_EQ(stream.state().reasons().of("speed_lost"), 0U);
  const auto before = count();
  ASSERT_TRUE(waitFor([&] {
    sender.send("12.5");
    return count() > before && stream.state().problem().empty();
  }));
}

TEST(SocketStream, OpensAgainWhatWasClosed) {
  std::atomic<int> opened{0}, other{-1};
  SocketStream stream(
      "gnss", "gpsd at test", 5000ms,
      [&]() -> Result<int> {
        if (++opened == 2) return fail("socket", "nobody is there");
        int pair[2];
        (void)::socketpair(AF_UNIX, SOCK_STREAM, 0, pair);
        other = pair[1];
        return pair[0];
      },
      [&](const Packet&) { ::close(other); });
  ASSERT_TRUE(waitFor([&] { return other >= 0; }));
  (void)!::write(other, "x", 1);
  ASSERT_TRUE(waitFor([&] { return stream.state().reasons().of("gnss_lost") == 1; }));
  ASSERT_TRUE(waitFor([&] { return stream.state().reasons().of("gnss_absent") == 1; }));
  EXPECT_THAT(stream.state().problem(), HasSubstr("nobody is there"));
  ASSERT_TRUE(waitFor([&] { return opened == 3; }));
}

TEST(SocketStream, SaysTheFixWhereItCannotBeOpened) {
  const auto why = [](const OpenSocket& open) {
    const auto opened = open();
    if (opened) ::close(*opened);
    return opened ? std::string("it opened") : opened.error().detail;
  };
  EXPECT_THAT(why(udpSocket("127.0.0.1")), HasSubstr("HOST:PORT"));
  EXPECT_THAT(why(udpSocket("192.0.2.1:7")), HasSubstr("cannot be listened to"));
  EXPECT_THAT(why(tcpSocket("127.0.0.1:1", "")), HasSubstr("is gpsd running there?"));
  EXPECT_THAT(why(canSocket("no-such-bus", {0x1a0})),
              ::testing::AnyOf(HasSubstr("`ip link` lists them"), HasSubstr("modprobe can_raw")));
}

TEST(Lines, AreWholeHoweverTheyCome) {
  std::vector<std::string> lines;
  const auto take = [&](std::string_view line, std::int64_t) { lines.emplace_back(line); };
  Lines reader;
  const auto add = [&](const std::string& text) {
    reader.add({{reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, 0}, take);
  };
  add("fir");
  add("st\r\nsecond\n\nthi");
  EXPECT_THAT(lines, ElementsAre("first", "second"));
  reader.end(0, take);
  add(std::string(5000, 'x') + "\nlast\n");
  EXPECT_THAT(lines, ElementsAre("first", "second", "thi", "last")) << "one too long is none";
}

}  // namespace
}  // namespace perdure::capture
