// The network between a vehicle and its server, in tests: a relay on 127.0.0.1 that can be slow,
// cut, or lose the server's answers; and a port that accepts connections and never answers.
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
  int port_ = 0, file_ = -1;  // the order matters, because the listener determines the port
};

class Relay {
 public:
  explicit Relay(int to_port);
  ~Relay();
  int port() const { return port_; }
  /// From now on, each piece of up to 16 kB takes this long.
  void slowTo(int microseconds) { delay_us_ = microseconds; }
  /// Loses the server's answer to the next COMMIT and closes the connection.
  void loseAnswerToCommit() { lose_answer_ = true; }
  bool lostAnAnswer() const { return lost_an_answer_; }
  void cut() { cut_ = true; }  ///< closes the present connections
  /// While set, no data is relayed and connections stay open, as with a server that hangs.
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
