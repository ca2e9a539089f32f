// The last call to an object of libcamera's thread, with a thread of libcamera's and no camera.
#include "services/capture/live/libcamera/last_of_all.h"

#include <gmock/gmock.h>
#define LIBCAMERA_BASE_PRIVATE  // a thread of its own, which libcamera otherwise keeps to itself
#include <libcamera/base/thread.h>

#include <string>
#include <vector>

namespace perdure::capture {
namespace {

using ::testing::ElementsAre;

/// As a session: a call from outside makes the thread ask something of itself, which comes later.
class Asked : public libcamera::Object {
 public:
  void ask() {
    done_.push_back("asked");
    if (!left_) invokeMethod(&Asked::answer, libcamera::ConnectionTypeQueued);
  }
  void answer() { done_.push_back("answered"); }
  void leave() { left_ = true; }
  bool end() {
    done_.push_back("ended");
    moveToThread(home_);
    return ++ends_ > 1;
  }
  const std::vector<std::string>& done() const { return done_; }

 private:
  libcamera::Thread* const home_ = thread();
  bool left_ = false;
  int ends_ = 0;
  std::vector<std::string> done_;
};

class LastOfAll : public ::testing::Test {
 protected:
  LastOfAll() { thread_.start(); }
  ~LastOfAll() override {
    thread_.exit();
    thread_.wait();
  }
  libcamera::Thread thread_;
  Asked asked_;
};

TEST_F(LastOfAll, ComesAfterWhatTheThreadAskedOfItself) {
  for (int i = 0; i < 100; ++i) {
    Asked asked;
    asked.moveToThread(&thread_);
    asked.invokeMethod(&Asked::ask, libcamera::ConnectionTypeQueued);
    EXPECT_FALSE(lastOfAll(asked, &Asked::leave, &Asked::end));
    EXPECT_THAT(asked.done(), ElementsAre("asked", "answered", "ended"));
  }
}

TEST_F(LastOfAll, ReturnsWhatTheEndDoesAndNothingIsAskedAfterLeaving) {
  asked_.moveToThread(&thread_);
  EXPECT_FALSE(lastOfAll(asked_, &Asked::leave, &Asked::end));
  asked_.moveToThread(&thread_);
  asked_.invokeMethod(&Asked::ask, libcamera::ConnectionTypeQueued);
  EXPECT_TRUE(lastOfAll(asked_, &Asked::leave, &Asked::end));
  EXPECT_THAT(asked_.done(), ElementsAre("ended", "asked", "ended"));
}

}  // namespace
}  // namespace perdure::capture
