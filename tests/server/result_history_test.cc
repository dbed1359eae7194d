// A stream's history: limits, order, drops, and shares of several streams.
#include "server/watch/result_history.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <random>
#include <vector>

#include "server/memory_watcher.h"
#include "server/watch_fixture.h"

namespace partiemc::server {
namespace {

Published PublishedFrame(std::uint64_t number, std::size_t bytes = kFrameBytes) {
  return {std::make_shared<NumberedFrame>(number, bytes), number, 10 * number};
}

std::vector<std::uint64_t> NumbersOf(const ResultHistory& history) {
  std::vector<std::uint64_t> numbers;
  for (std::size_t k = 0; k < history.size(); ++k) numbers.push_back(history.at(k).number);
  return numbers;
}

TEST(ResultHistory, KeepsAsManyOfTheNewestAsFitInTheirOrder) {
  std::mt19937 random(1);
  constexpr std::uint64_t kMost = 20'000;
  HistoryRoom room(kMost, 1'000'000);
  ResultHistory history(room);
  std::deque<std::uint64_t> numbers, costs;  // The same as a plain list.
  std::uint64_t sum = 0;
  for (std::uint64_t number = 1; number <= 3000; ++number) {
    const std::size_t bytes = random() % 8 == 0 ? random() % 40'000 : random() % 3000;
    history.Add(PublishedFrame(number, bytes));
    numbers.push_back(number), costs.push_back(bytes + kPublishedBytes);
    sum += costs.back();
    while (sum > kMost) {
      sum -= costs.front();
      numbers.pop_front(), costs.pop_front();
    }
    ASSERT_EQ(NumbersOf(history), std::vector<std::uint64_t>(numbers.begin(), numbers.end()));
    ASSERT_EQ(history.bytes(), sum);
    ASSERT_EQ(room.held(), sum);
  }
}

TEST(ResultHistory, ACopyHasTheNewestThatFitBeforeASequence) {
  HistoryRoom room(8 * kFrameCost, 11 * kFrameCost);
  ResultHistory history(room);
  for (std::uint64_t number = 1; number <= 8; ++number) history.Add(PublishedFrame(number));
  const auto numbers = [&](std::uint64_t sequence) {
    return NumbersOf(*history.CopyBefore(sequence));
  };
  EXPECT_EQ(numbers(1), (std::vector<std::uint64_t>{}));
  EXPECT_EQ(numbers(21), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(numbers(70), (std::vector<std::uint64_t>{4, 5, 6})) << "the room has three";
  {
    ResultHistory others[] = {ResultHistory(room), ResultHistory(room), ResultHistory(room)};
    EXPECT_EQ(numbers(99), (std::vector<std::uint64_t>{7, 8})) << "a share of five has two";
    EXPECT_EQ(room.held(), 8 * kFrameCost);
  }
  const auto copy = history.CopyBefore(31);
  EXPECT_EQ(room.held(), 11 * kFrameCost);
  copy->Add(PublishedFrame(4));
  EXPECT_EQ(NumbersOf(*copy), (std::vector<std::uint64_t>{2, 3, 4}));
}

TEST(ResultHistory, FramesFromASequenceOnAreTaken) {
  HistoryRoom room(8 * kFrameCost, 8 * kFrameCost);
  ResultHistory history(room);
  for (std::uint64_t number = 1; number <= 11; ++number) history.Add(PublishedFrame(number));
  EXPECT_TRUE(history.TakeFrom(999).empty());
  const auto taken = history.TakeFrom(61);
  ASSERT_EQ(taken.size(), 5u);
  EXPECT_EQ(taken.front().number, 7u);
  EXPECT_EQ(NumbersOf(history), (std::vector<std::uint64_t>{4, 5, 6}));
  EXPECT_EQ(room.held(), 3 * kFrameCost);
  for (std::uint64_t number = 7; number <= 11; ++number) history.Add(PublishedFrame(number));
  EXPECT_EQ(NumbersOf(history), (std::vector<std::uint64_t>{4, 5, 6, 7, 8, 9, 10, 11}));
  EXPECT_EQ(history.TakeFrom(0).size(), 8u);
  EXPECT_TRUE(history.empty());
}

TEST(ResultHistory, HasNoHole) {
  HistoryRoom room(100 * kFrameCost, 100 * kFrameCost);
  ResultHistory history(room);
  for (const std::uint64_t number : {1, 2, 3, 5}) history.Add(PublishedFrame(number));
  EXPECT_EQ(NumbersOf(history), (std::vector<std::uint64_t>{5}));
  // Too large, so the next result has a gap before it.
  history.Add(PublishedFrame(6, 101 * kFrameCost));
  EXPECT_TRUE(history.empty());
  history.Add(PublishedFrame(7));
  EXPECT_EQ(NumbersOf(history), (std::vector<std::uint64_t>{7}));
}

TEST(ResultHistory, ManyHaveEqualSharesAndNeverMoreThanThereIs) {
  HistoryRoom room(6 * kFrameCost, 12 * kFrameCost);
  ResultHistory first(room), second(room);
  EXPECT_FALSE(room.is_scarce());
  for (std::uint64_t number = 1; number <= 9; ++number) {
    first.Add(PublishedFrame(number));
    second.Add(PublishedFrame(number));
  }
  EXPECT_EQ(room.held(), 12 * kFrameCost);
  {
    ResultHistory third(room);
    EXPECT_TRUE(room.is_scarce());
    EXPECT_EQ(room.share(), 4 * kFrameCost);
    third.Add(PublishedFrame(1));  // The others have not been notified yet.
    EXPECT_TRUE(third.empty());
    EXPECT_EQ(room.held(), 12 * kFrameCost);
    first.Shrink();
    EXPECT_EQ(NumbersOf(first), (std::vector<std::uint64_t>{6, 7, 8, 9}));
    third.Add(PublishedFrame(2));
    third.Add(PublishedFrame(3));
    // The second still exceeds its share, so one of its results is dropped.
    third.Add(PublishedFrame(4));
    EXPECT_EQ(NumbersOf(third), (std::vector<std::uint64_t>{3, 4}));
    EXPECT_EQ(room.held(), 12 * kFrameCost);
    second.Add(PublishedFrame(10));
    EXPECT_EQ(second.size(), 4u);
  }
  EXPECT_EQ(room.held(), 8 * kFrameCost);
  EXPECT_EQ(room.share(), 6 * kFrameCost);
}

TEST(ResultHistory, FindsTheFirstFromANumberOrASequenceOn) {
  HistoryRoom room(5 * kFrameCost, 5 * kFrameCost);
  ResultHistory history(room);
  EXPECT_EQ(history.FromNumber(0), nullptr);
  EXPECT_EQ(history.FromSequence(0), nullptr);
  for (std::uint64_t number = 1; number <= 23; ++number) history.Add(PublishedFrame(number));
  for (std::uint64_t asked = 0; asked <= 22; ++asked) {
    const std::uint64_t first = std::max<std::uint64_t>(asked, 19);
    EXPECT_EQ(history.FromNumber(asked)->number, first);
    EXPECT_EQ(history.FromSequence(10 * asked)->number, first);
    EXPECT_EQ(history.FromSequence(10 * asked - (asked > 0 ? 3 : 0))->number, first);
  }
  EXPECT_EQ(history.FromNumber(24), nullptr);
  EXPECT_EQ(history.FromSequence(231), nullptr);
}

}  // namespace
}  // namespace partiemc::server
