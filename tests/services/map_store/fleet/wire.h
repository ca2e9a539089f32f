// What lies between a vehicle and its server, in tests: a relay on 127.0.0.1 that can be slow, cut,
// or deaf (what the server answers is lost); and a port that accepts and says nothing.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

namespace perdure::map_store::test {

class SilentPort {
 public:
  SilentPort();
  ~SilentPort();
  int port() const { return port_; }

 private:
  int port_ = 0, file_ = -1;  // in this order: who listens says the port
};

class Relay {
 public:
  explicit Relay(int to_port);
  ~Relay();
  int port() const { return port_; }
  /// Each piece of up to 16 kB takes so long from here on.
  void slowTo(int microseconds) { delay_us_ = microseconds; }
  /// What the server answers to the next COMMIT is lost, and the connection with it.
  void loseAnswerToCommit() { lose_answer_ = true; }
  bool lostAnAnswer() const { return lost_an_answer_; }
  void cut() { cut_ = true; }  ///< ends what is connected now
  /// While it is set nothing is carried, and connections stay open: a server that hangs.
  void hang(bool set) { hanging_ = set; }

 private:
  void run();
  void carry(int client);
  int port_ = 0, listener_ = -1, to_port_ = 0;
  std::atomic<int> delay_us_{0};
  std::atomic<bool> lose_answer_{false}, lost_an_answer_{false}, cut_{false}, hanging_{false},
      ending_{false};
  std::thread thread_;
};

}  // namespace perdure::map_store::test
