// Tests which images of two cameras are paired, by their stamps in simulated time.
#include "services/capture/live/cameras/stereo_pairing.h"

#include <gmock/gmock.h>

#include <random>

#include "tests/services/capture/live/times.h"

namespace perdure::capture {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kInterval = 50 * kMs, kLatency = 20 * kMs;

class Pairing : public ::testing::Test {
 protected:
  static CameraImage image(std::uint64_t number, std::int64_t time_ns) {
    CameraImage result{time_ns, number, {}};
    return result;
  }
  /// An image of cam0 or cam1, with a stamp `number` intervals after the start plus `late_ns`. It
  /// arrives `latency` after its stamp.
  void first(std::uint64_t number, std::int64_t late_ns = 0, std::int64_t latency = kLatency) {
    const std::int64_t t = at(number) + late_ns;
    note(pairing_.first(image(number, t), t + latency));
  }
  void second(std::uint64_t number, std::int64_t late_ns = 0, std::int64_t latency = kLatency) {
    const std::int64_t t = at(number) + late_ns;
    note(pairing_.second(image(1000 + number, t), t + latency));
  }
  void due(std::int64_t now_ns) { note(pairing_.due(now_ns)); }
  static std::int64_t at(std::uint64_t number) {
    return kSecond + kInterval * static_cast<std::int64_t>(number);
  }
  /// Returns the numbers of the published images: "n+" before its partner, otherwise "n". Checks
  /// that partners are within the tolerance.
  std::vector<std::string> taken() { return std::exchange(out_, {}); }
  std::uint64_t counted(const std::string& reason) { return pairing_.reasons().of(reason); }
  StereoPairing pairing_{20.0};

 private:
  void note(const std::vector<CameraImage>& images) {
    for (std::size_t i = 0; i < images.size(); ++i) {
      const bool pair = i + 1 < images.size() && images[i + 1].number == images[i].number;
      out_.push_back(std::to_string(images[i].number) + (pair ? "+" : ""));
      if (!pair) continue;
      EXPECT_LE(std::abs(images[i + 1].time_ns - images[i].time_ns), pairing_.toleranceNs());
      ++i;
    }
  }
  std::vector<std::string> out_;
};

TEST_F(Pairing, OfOneMomentHaveOneNumberWhicheverComesFirst) {
  first(0);
  EXPECT_THAT(taken(), ElementsAre("0")) << "cam1 has given nothing yet: nobody waits for it";
  second(0, 0, kLatency + kMs);
  for (std::uint64_t n = 1; n < 200; ++n) {
    const bool cam1_first = n % 2 == 0;
    if (cam1_first) second(n, kMs / 10);
    first(n, 0, kLatency + kMs);
    if (!cam1_first) {
      EXPECT_THAT(taken(), IsEmpty()) << "waits for its partner";
      second(n, kMs / 10, kLatency + 2 * kMs);
    }
    EXPECT_THAT(taken(), ElementsAre(std::to_string(n) + "+"));
  }
  EXPECT_EQ(counted("stereo_unpaired_cam0"), 1u);
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 1u);
  EXPECT_EQ(pairing_.problem(), "");
  EXPECT_EQ(pairing_.note(), "");
}

/// Free-running cameras of the same rate have a constant phase. Stamps over USB have jitter.
TEST_F(Pairing, AConstantPhaseWithinTheToleranceIsPairedAndTold) {
  std::mt19937 random(7);
  std::uniform_int_distribution<std::int64_t> jitter(-kMs / 2, kMs / 2);
  second(0, -7 * kMs);
  for (std::uint64_t n = 1; n < 200; ++n) {
    second(n, -7 * kMs + jitter(random));
    first(n, jitter(random));
    ASSERT_THAT(taken(), ElementsAre(std::to_string(n) + "+"));
  }
  EXPECT_THAT(pairing_.note(), HasSubstr("typically 7."));
  EXPECT_THAT(pairing_.note(), HasSubstr("vio takes them as one moment"));
  EXPECT_EQ(pairing_.problem(), "");
}

TEST_F(Pairing, TwoMillisecondsAreNotWorthASentence) {
  for (std::uint64_t n = 0; n < 200; ++n) {
    second(n, -19 * kMs / 10);
    first(n);
  }
  EXPECT_EQ(pairing_.note(), "");
}

TEST_F(Pairing, APhaseBeyondTheToleranceIsNotPairedAndIsAProblem) {
  for (std::uint64_t n = 0; n < 200; ++n) {
    first(n);
    due(at(n) + kLatency + pairing_.toleranceNs());
    second(n, 20 * kMs);
  }
  EXPECT_EQ(taken().size(), 200u);
  EXPECT_EQ(counted("stereo_unpaired_cam0"), 200u);
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 199u) << "the last one may be of the next of cam0";
  EXPECT_THAT(pairing_.problem(), HasSubstr("more than 10.0 ms apart"));
  for (std::uint64_t n = 200; n < 400; ++n) {
    first(n);
    second(n);
  }
  EXPECT_EQ(pairing_.problem(), "") << "repaired";
}

TEST_F(Pairing, ACameraWhoseImagesComeTooLateIsAProblemOfItsOwn) {
  for (std::uint64_t n = 0; n < 200; ++n) {
    first(n);
    due(at(n) + kLatency + pairing_.toleranceNs());
    if (n > 0) second(n - 1, kMs, kInterval + kLatency + 15 * kMs);
  }
  EXPECT_THAT(pairing_.problem(), HasSubstr("come more than 10.0 ms later"));
}

TEST_F(Pairing, WaitsForThePartnerNoLongerThanTheTolerance) {
  second(0);
  first(0);
  taken();
  first(1);
  due(at(1) + kLatency + pairing_.toleranceNs() - 1);
  EXPECT_THAT(taken(), IsEmpty());
  due(at(1) + kLatency + pairing_.toleranceNs());
  EXPECT_THAT(taken(), ElementsAre("1"));
  EXPECT_EQ(counted("stereo_unpaired_cam0"), 1u);
}

TEST_F(Pairing, ALaterImageOfCam1SaysThatThePartnerIsLost) {
  second(0);
  first(0);
  taken();
  first(1);
  second(2, 0, -kInterval + kLatency + kMs);
  EXPECT_THAT(taken(), ElementsAre("1")) << "at once";
  first(2);
  EXPECT_THAT(taken(), ElementsAre("2+"));
}

TEST_F(Pairing, FramesLostOnEitherSideCostTheirPartnersOnly) {
  std::vector<std::string> expected;
  second(0);
  first(0);
  for (std::uint64_t n = 1; n < 100; ++n) {
    const bool no_first = n % 7 == 3, no_second = n % 5 == 2;
    if (!no_second) second(n, kMs);
    if (!no_first) first(n);
    due(at(n) + kLatency + pairing_.toleranceNs());
    if (!no_first) expected.push_back(std::to_string(n) + (no_second ? "" : "+"));
  }
  first(100);
  due(at(101));
  auto out = taken();
  out.erase(out.begin());
  out.pop_back();
  EXPECT_EQ(out, expected);
  EXPECT_EQ(counted("stereo_unpaired_cam0"), 17u + 1u);
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 11u);
}

TEST_F(Pairing, OneThatWasUnpluggedIsNotWaitedForAndIsPairedWhenItIsBack) {
  for (std::uint64_t n = 0; n < 20; ++n) {
    second(n);
    first(n);
  }
  taken();
  for (std::uint64_t n = 20; n < 24; ++n) {
    first(n);
    due(at(n) + kLatency + pairing_.toleranceNs());
  }
  taken();
  for (std::uint64_t n = 24; n < 60; ++n) {
    first(n);
    EXPECT_THAT(taken(), ElementsAre(std::to_string(n))) << "at once";
  }
  EXPECT_EQ(pairing_.problem(), "") << "its camera says that itself";
  for (std::uint64_t n = 60; n < 70; ++n) {
    second(n);
    first(n);
    EXPECT_THAT(taken(), ElementsAre(std::to_string(n) + "+"));
  }
  EXPECT_EQ(counted("stereo_unpaired_cam0"), 40u);
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 0u);
}

TEST_F(Pairing, WithoutCam0ThoseOfCam1AreDroppedAndKeepNoMoreThanAFew) {
  for (std::uint64_t n = 0; n < 100; ++n) second(n);
  EXPECT_THAT(taken(), IsEmpty());
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 92u);
  first(99);
  EXPECT_THAT(taken(), ElementsAre("99+"));
  EXPECT_EQ(counted("stereo_unpaired_cam1"), 99u);
}

TEST_F(Pairing, StampsThatGoBackCostThatImageAlone) {
  second(0);
  first(0);
  second(1);
  second(1, -kMs);
  first(1);
  EXPECT_THAT(taken(), ElementsAre("0+", "1+"));
  EXPECT_EQ(counted("camera_out_of_order_cam1"), 1u);
  second(2);
  first(2, -60 * kMs);
  EXPECT_THAT(taken(), ElementsAre("2")) << "it is given on, as that of one camera";
  EXPECT_EQ(counted("camera_out_of_order_cam0"), 1u);
  second(3);
  first(3);
  EXPECT_THAT(taken(), ElementsAre("3+"));
}

TEST_F(Pairing, AStampOfTheFutureSpoilsNoOther) {
  second(0);
  first(0);
  second(1, kSecond, kLatency - kSecond);
  first(2, 3 * kSecond, kLatency - 3 * kSecond);
  EXPECT_THAT(taken(), ElementsAre("0+", "2"));
  EXPECT_EQ(counted("camera_out_of_order_cam1"), 1u);
  EXPECT_EQ(counted("camera_out_of_order_cam0"), 1u);
  second(3);
  first(3);
  EXPECT_THAT(taken(), ElementsAre("3+"));
}

/// Cameras give 100 images per second, although 20 are requested. The next image is only a fifth of
/// the requested interval away.
TEST_F(Pairing, TheToleranceIsOfTheRateThatTheCamerasKeep) {
  EXPECT_EQ(StereoPairing(50.0).toleranceNs(), 6'666'667);
  EXPECT_EQ(pairing_.toleranceNs(), 10 * kMs) << "no more than vio pairs";
  for (std::uint64_t n = 0; n < 100; ++n) {
    const std::int64_t t = kSecond + 10 * kMs * static_cast<std::int64_t>(n);
    (void)pairing_.second(image(n, t + kMs), t + kLatency);
    const auto out = pairing_.first(image(n, t), t + kLatency);
    ASSERT_EQ(out.size(), 2u);
    EXPECT_EQ(out[1].time_ns - out[0].time_ns, kMs);
  }
  EXPECT_EQ(pairing_.toleranceNs(), 3'333'333);
}

TEST_F(Pairing, TheNearestOfSeveralIsTaken) {
  second(0);
  first(0);
  taken();
  second(1, -9 * kMs);
  second(1, 2 * kMs);
  second(1, 9 * kMs);
  const auto out = pairing_.first(image(1, at(1)), at(1) + 2 * kLatency);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[1].time_ns, at(1) + 2 * kMs);
}

}  // namespace
}  // namespace perdure::capture
