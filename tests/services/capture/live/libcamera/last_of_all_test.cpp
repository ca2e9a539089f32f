// Tests the last call to an object of libcamera's thread, with such a thread but without a camera.
#include <dlfcn.h>
#include <gmock/gmock.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "services/capture/live/libcamera/running_camera.h"

namespace perdure::capture {
namespace {

using ::testing::ElementsAre;

/// Like a session: a call from outside queues another call in the thread itself.
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

/// A thread of libcamera. Its header is private, and not packaged from version 0.1 on; its
/// functions are in the library.
class LastOfAll : public ::testing::Test {
 protected:
  LastOfAll() {
    if (!make_ || !start_ || !exit_ || !wait_ || !end_) return;
    thread_ = reinterpret_cast<libcamera::Thread*>(memory_.data());
    make_(thread_);
    start_(thread_);
  }
  ~LastOfAll() override {
    if (!thread_) return;
    exit_(thread_, 0);
    wait_(thread_, INT64_MAX);
    end_(thread_);
  }
  void SetUp() override {
    if (!thread_) GTEST_SKIP() << "skipped: this libcamera has no thread for others";
  }
  template <class... Arguments>
  using Function = void (*)(libcamera::Thread*, Arguments...);
  template <class F>
  static F named(const char* symbol) {
    return reinterpret_cast<F>(dlsym(RTLD_DEFAULT, symbol));
  }

  const Function<> make_ = named<Function<>>("_ZN9libcamera6ThreadC1Ev");
  const Function<> start_ = named<Function<>>("_ZN9libcamera6Thread5startEv");
  const Function<int> exit_ = named<Function<int>>("_ZN9libcamera6Thread4exitEi");
  const Function<std::int64_t> wait_ = named<Function<std::int64_t>>(
      "_ZN9libcamera6Thread4waitENSt6chrono8durationIlSt5ratioILl1ELl1000000000EEEE");
  const Function<> end_ = named<Function<>>("_ZN9libcamera6ThreadD1Ev");
  alignas(std::max_align_t) std::array<std::byte, 4096> memory_{};  // larger than the object
  libcamera::Thread* thread_ = nullptr;
  Asked asked_;
};

TEST_F(LastOfAll, ComesAfterWhatTheThreadAskedOfItself) {
  for (int i = 0; i < 100; ++i) {
    Asked asked;
    asked.moveToThread(thread_);
    asked.invokeMethod(&Asked::ask, libcamera::ConnectionTypeQueued);
    EXPECT_FALSE(lastOfAll(asked, &Asked::leave, &Asked::end));
    EXPECT_THAT(asked.done(), ElementsAre("asked", "answered", "ended"));
  }
}

TEST_F(LastOfAll, ReturnsWhatTheEndDoesAndNothingIsAskedAfterLeaving) {
  asked_.moveToThread(thread_);
  EXPECT_FALSE(lastOfAll(asked_, &Asked::leave, &Asked::end));
  asked_.moveToThread(thread_);
  asked_.invokeMethod(&Asked::ask, libcamera::ConnectionTypeQueued);
  EXPECT_TRUE(lastOfAll(asked_, &Asked::leave, &Asked::end));
  EXPECT_THAT(asked_.done(), ElementsAre("ended", "asked", "ended"));
}

}  // namespace
}  // namespace perdure::capture
