// Which unopened call is evicted; also under ThreadSanitizer.
#include "server/stream/opening_calls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/stream/intake_guard.h"

namespace partiemc::server {
namespace {

// Calls by number, with their ends.
class Calls : public ::testing::Test {
 protected:
  // Numbers the calls from 0.
  int Begin(const CallerAccount& caller) {
    const int number = static_cast<int>(places_.size());
    places_.push_back(opening_.Enter(caller, [this, number](const absl::Status& status) {
      gone_.push_back(number);
      status_ = status;
    }));
    return number;
  }
  // An open watch that waits for a request.
  int Watch(const CallerAccount& caller) {
    const int number = static_cast<int>(places_.size());
    places_.push_back(opening_.EnterWatcher(caller, [this, number](const absl::Status& status) {
      gone_.push_back(number);
      status_ = status;
    }));
    return number;
  }
  // Its request has arrived, or it has ended.
  void Opens(int number) { places_[static_cast<std::size_t>(number)] = {}; }

  OpeningCalls opening_{4};
  CallerAccount mallory_, alice_, bob_;
  std::vector<int> gone_;
  absl::Status status_;
  std::vector<OpeningCalls::Place> places_;
};

TEST_F(Calls, GiveWayToOthersTheOldestOfWhoHasMostFirst) {
  const int alices = Begin(alice_);
  for (int i = 0; i < 3; ++i) Begin(mallory_);
  EXPECT_TRUE(gone_.empty()) << "there is room for all";
  Begin(bob_);
  EXPECT_EQ(gone_, (std::vector<int>{1})) << "not Alice's, though it is older";
  Begin(bob_);
  EXPECT_EQ(gone_, (std::vector<int>{1, 2}));
  EXPECT_EQ(opening_.count(), 4u);
  Opens(alices);
  EXPECT_EQ(opening_.count(), 3u);
  Begin(alice_);
  EXPECT_EQ(gone_.size(), 2u);
}

TEST_F(Calls, OfOneCallerGiveWayToItsOwn) {
  // As behind a proxy, where all calls have its address.
  for (int i = 0; i < 10; ++i) Begin(mallory_);
  EXPECT_EQ(gone_, (std::vector<int>{0, 1, 2, 3, 4, 5}));
}

TEST_F(Calls, OfCallersWithAsManyEachGiveWayByAge) {
  std::list<CallerAccount> callers(8);
  for (CallerAccount& caller : callers) Begin(caller);
  EXPECT_EQ(gone_, (std::vector<int>{0, 1, 2, 3}));
}

TEST_F(Calls, OfWhoHasMostTheOlderHalfGiveWayWhereMemoryIsShort) {
  Begin(alice_);
  for (int i = 0; i < 3; ++i) Begin(mallory_);
  opening_.GiveWayToAll();
  EXPECT_EQ(gone_, (std::vector<int>{1, 2}));
  opening_.GiveWayToAll();
  EXPECT_EQ(gone_, (std::vector<int>{1, 2, 0})) << "the oldest of those who have one each";
  opening_.GiveWayToAll();
  opening_.GiveWayToAll();
  EXPECT_EQ(gone_, (std::vector<int>{1, 2, 0, 3}));
  EXPECT_EQ(FindViolation(status_)->reason, kReasonTooManyOpening);
  EXPECT_EQ(opening_.count(), 0u);
}

TEST_F(Calls, ThatWatchGiveWayWhereMemoryIsShort) {
  for (int i = 0; i < 5; ++i) Watch(mallory_);
  Watch(alice_);
  Begin(bob_);
  EXPECT_TRUE(gone_.empty()) << "they take no place from those that open";
  EXPECT_EQ(opening_.count(), 1u);
  Opens(0);
  Watch(mallory_);  // Has sent a request and may send another.
  opening_.WatchersGiveWay();
  EXPECT_EQ(gone_, (std::vector<int>{1, 2, 3})) << "the silent ones first";
  EXPECT_EQ(FindViolation(status_)->reason, kReasonTooManyOpening);
  EXPECT_EQ(FindViolation(status_)->field, "watchers");
}

// A process with simulated memory.
class Guarded : public Calls {
 protected:
  static constexpr std::uint64_t kMost = 1000;

  // Waits until the condition holds or a timeout expires.
  template <typename Condition>
  static bool Eventually(Condition condition) {
    for (int k = 0; k < 2'000 && !condition(); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return condition();
  }

  std::atomic<std::uint64_t> resident_ = 0, freed_ = 0, most_ = kMost, more_ = 0;
  std::atomic<int> gave_back_ = 0, looks_ = 0;
  std::optional<IntakeGuard> guard_{
      std::in_place, opening_,
      IntakeGuard::Process{.resident_bytes =
                               [this] {
                                 ++looks_;
                                 return resident_.load();
                               },
                           .most_bytes = [this] { return most_.load(); },
                           .more_bytes = [this] { return more_.load(); },
                           .give_back_freed =
                               [this] {
                                 ++gave_back_;
                                 resident_ -= freed_.exchange(0);
                               }}};
};

TEST_F(Guarded, CallsGiveWayAsLongAsMemoryIsTooMuch) {
  resident_ = kMost;
  Begin(mallory_);
  Begin(mallory_);
  Begin(alice_);
  const int looked = looks_;
  ASSERT_TRUE(Eventually([&] { return looks_ > looked + 3; }));
  EXPECT_EQ(opening_.count(), 3u) << "it is not too much";
  resident_ = kMost + 1;
  EXPECT_TRUE(Eventually([&] { return opening_.count() == 0; }));
}

TEST_F(Guarded, CallsStayWhereStreamsHaveBeenGrantedMore) {
  most_ = 2 * kMost;
  resident_ = 2 * kMost;
  Begin(alice_);
  const int looked = looks_;
  ASSERT_TRUE(Eventually([&] { return looks_ > looked + 3; }));
  EXPECT_EQ(opening_.count(), 1u);
  more_ = kMost;  // Held by watchers.
  most_ = kMost;
  const int looked_again = looks_;
  ASSERT_TRUE(Eventually([&] { return looks_ > looked_again + 3; }));
  EXPECT_EQ(opening_.count(), 1u);
  more_ = kMost - 1;  // Freed by them and taken by another.
  EXPECT_TRUE(Eventually([&] { return opening_.count() == 0; }));
}

TEST_F(Guarded, WatchersGiveWayToo) {
  resident_ = kMost + 1;
  Watch(mallory_);
  // Stops checking when no call is left.
  ASSERT_TRUE(Eventually([&] {
    const int looked = looks_;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return gave_back_ > 0 && looks_ == looked;
  }));
  guard_.reset();
  EXPECT_EQ(gone_, (std::vector<int>{0}));
}

TEST_F(Guarded, CallsStayWhereItIsEnoughToGiveBackWhatIsFree) {
  freed_ = 2;
  resident_ = kMost + 1;
  Begin(mallory_);
  ASSERT_TRUE(Eventually([&] { return gave_back_ == 1; }));
  const int looked = looks_;
  ASSERT_TRUE(Eventually([&] { return looks_ > looked + 3; }));
  EXPECT_EQ(opening_.count(), 1u);
}

TEST_F(Guarded, NobodyLooksWhereNoCallIsOpening) {
  Opens(Begin(alice_));
  ASSERT_TRUE(Eventually([&] {
    const int looked = looks_;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return looks_ == looked;
  }));
}

TEST_F(Calls, ThatHaveOpenedAreNotTakenForOldOnes) {
  for (int i = 0; i < 4; ++i) Begin(mallory_);
  Opens(0);
  Opens(1);
  Begin(bob_);
  Begin(bob_);
  EXPECT_TRUE(gone_.empty());
  Begin(alice_);
  EXPECT_EQ(gone_, (std::vector<int>{2}));
}

TEST_F(Calls, AreToldWhy) {
  for (int i = 0; i < 5; ++i) Begin(mallory_);
  EXPECT_EQ(status_.code(), absl::StatusCode::kResourceExhausted);
  ASSERT_TRUE(FindViolation(status_).has_value());
  EXPECT_EQ(FindViolation(status_)->reason, kReasonTooManyOpening);
  EXPECT_EQ(status_.message(),
            "calls without a request: more than 4; must send the first request at once: of the "
            "caller with most of them the oldest gives way; try again");
}

TEST_F(Calls, ThatAreOverWhileTheyGiveWayAreOverOnce) {
  std::vector<OpeningCalls::Place> places(5);
  for (std::size_t i = 0; i < 5; ++i) {
    places[i] = opening_.Enter(mallory_, [&places, i](const absl::Status&) { places[i] = {}; });
  }
  EXPECT_EQ(opening_.count(), 4u);
  places.clear();
  EXPECT_EQ(opening_.count(), 0u);
}

// Straightforward implementation that searches all calls.
class SlowOpeningCalls {
 public:
  explicit SlowOpeningCalls(std::size_t places) : places_(places) {}

  // The number of the evicted call, or -1.
  int Enter(int caller, int number) {
    int gone = -1;
    if (calls_.size() == places_) {
      std::map<int, std::size_t> counts;
      for (const auto& call : calls_) ++counts[call.first];
      auto goes = calls_.begin();
      for (auto call = calls_.begin(); call != calls_.end(); ++call) {
        if (counts[call->first] > counts[goes->first]) goes = call;
      }
      gone = goes->second;
      calls_.erase(goes);
    }
    calls_.emplace_back(caller, number);
    return gone;
  }
  void Leave(int number) {
    std::erase_if(calls_, [number](const auto& call) { return call.second == number; });
  }

 private:
  const std::size_t places_;
  std::vector<std::pair<int, int>> calls_;  // Caller and number, in the order of arrival.
};

TEST(OpeningCalls, ChooseAsTheirDefinitionSays) {
  std::mt19937 random(11);
  OpeningCalls opening(9);
  SlowOpeningCalls expected(9);
  std::array<CallerAccount, 5> callers;
  std::vector<OpeningCalls::Place> places;
  int gone = -1, gave_way = 0;
  for (int number = 0; number < 5000; ++number) {
    const std::size_t caller = std::min(random() % 5, random() % 5);
    gone = -1;
    places.push_back(
        opening.Enter(callers[caller], [&gone, number](const absl::Status&) { gone = number; }));
    ASSERT_EQ(gone, expected.Enter(static_cast<int>(caller), number)) << "call " << number;
    gave_way += gone >= 0 ? 1 : 0;
    while (random() % 3 == 0) {
      const std::size_t leaves = random() % places.size();
      places[leaves] = {};
      expected.Leave(static_cast<int>(leaves));
    }
  }
  EXPECT_GT(gave_way, 1000);
}

TEST(OpeningCalls, ComeAndGoFromManyThreads) {
  OpeningCalls opening(1);
  std::atomic<int> gave_way = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      const CallerAccount caller;
      std::vector<OpeningCalls::Place> places(2);
      for (std::size_t k = 0; k < 4000; ++k) {
        places[k % 2] = opening.Enter(caller, [&](const absl::Status&) { ++gave_way; });
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_GT(gave_way, 0);
  EXPECT_EQ(opening.count(), 0u);
}

}  // namespace
}  // namespace partiemc::server
