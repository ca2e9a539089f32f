#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "common/base/bounded_queue.h"
#include "common/base/ids.h"
#include "common/base/result.h"

namespace perdure {
namespace {

TEST(BoundedQueue, DropOldestKeepsTheNewestAndCountsWhatItLost) {
  BoundedQueue<int> queue(2, Overflow::kDropOldest);
  for (int i = 1; i <= 5; ++i) EXPECT_TRUE(queue.push(i));
  EXPECT_EQ(queue.pop(), 4);
  EXPECT_EQ(queue.pop(), 5);
  EXPECT_EQ(queue.dropped(), 3u);
}

TEST(BoundedQueue, BlockLosesNothingBetweenTwoThreads) {
  BoundedQueue<int> queue(3, Overflow::kBlock);
  std::vector<int> received;
  std::thread consumer([&] {
    while (const auto value = queue.pop()) received.push_back(*value);
  });
  for (int i = 0; i < 1000; ++i) queue.push(i);
  queue.close();
  consumer.join();
  ASSERT_EQ(received.size(), 1000u);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(received[static_cast<std::size_t>(i)], i);
  EXPECT_EQ(queue.dropped(), 0u);
}

TEST(BoundedQueue, CloseReleasesAWaitingConsumerAndRefusesMore) {
  BoundedQueue<int> queue(1, Overflow::kDropOldest);
  std::thread consumer([&] { EXPECT_FALSE(queue.pop().has_value()); });
  queue.close();
  consumer.join();
  EXPECT_FALSE(queue.push(1));
}

TEST(Ids, DigestIsFnv1aAndHexIsSixteenDigits) {
  EXPECT_EQ(digest(""), 0xcbf29ce484222325ULL);
  EXPECT_EQ(digest("a"), 0xaf63dc4c8601ec8cULL);
  EXPECT_EQ(toHex(0xaf63dc4c8601ec8cULL), "af63dc4c8601ec8c");
}

TEST(Ids, AFrameIsTheSameOnlyWithTheSameSourceAndSequence) {
  const FrameStamp a{7, 3, {}, 0}, later_copy{7, 3, fromNanoseconds(5), 9}, restarted{8, 3, {}, 0};
  EXPECT_TRUE(a.sameFrame(later_copy));
  EXPECT_FALSE(a.sameFrame(restarted));
}

TEST(ReasonCounts, CountsEachCodeApart) {
  ReasonCounts counts;
  counts.add(Reason{"late", "by 3 s"});
  counts.add("late");
  counts.add("malformed", 4);
  EXPECT_EQ(counts.of("late"), 2u);
  EXPECT_EQ(counts.of("malformed"), 4u);
  EXPECT_EQ(counts.of("never"), 0u);
}

}  // namespace
}  // namespace perdure
