// The parts of the gateway that know no connection: places, signs of life, messages in pieces.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "server/web/gathered_message.h"
#include "server/web/places.h"
#include "server/web/signs_of_life.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

struct Guests {
  explicit Guests(std::size_t most) : places(most) {}
  // Whether the one that comes gets a place; which others were told to go, by their names.
  bool Come(const std::string& host, const std::string& name) {
    bool gave_way = false;
    auto place = places.Enter(
        host, [this, name] { told.push_back(name); }, gave_way);
    if (place) held[name] = *std::move(place);
    return place.has_value();
  }

  ConnectionPlaces places;
  std::vector<std::string> told;
  std::map<std::string, ConnectionPlaces::Place> held;
};

TEST(ConnectionPlaces, TheOldestOfTheHostThatHasMostGivesWayOfThoseThatWait) {
  Guests guests(4);
  EXPECT_TRUE(guests.Come("a", "a1"));
  EXPECT_TRUE(guests.Come("b", "b1"));
  EXPECT_TRUE(guests.Come("b", "b2"));
  EXPECT_TRUE(guests.Come("b", "b3"));
  EXPECT_TRUE(guests.told.empty());
  guests.held["b1"].SetWaiting(false);
  EXPECT_TRUE(guests.Come("c", "c1"));
  EXPECT_EQ(guests.told, (std::vector<std::string>{"b2"}));
  guests.held.erase("b2");
  EXPECT_TRUE(guests.Come("c", "c2"));  // Each has one: the oldest of all.
  EXPECT_EQ(guests.told, (std::vector<std::string>{"b2", "a1"}));
  guests.held["b1"].SetWaiting(true);  // Its call is over.
  EXPECT_TRUE(guests.Come("c", "c3"));
  EXPECT_EQ(guests.told.back(), "b1");
}

TEST(ConnectionPlaces, WhereAllHaveCallsNobodyComesInUntilOneLeaves) {
  Guests guests(2);
  guests.Come("a", "a1");
  guests.Come("a", "a2");
  for (auto& [name, place] : guests.held) place.SetWaiting(false);
  EXPECT_FALSE(guests.Come("b", "b1"));
  EXPECT_TRUE(guests.told.empty());
  guests.held.erase("a1");
  EXPECT_TRUE(guests.Come("b", "b1"));
}

TEST(ConnectionPlaces, EndsThoseThatWaitAndThenAllAndWaitsForThem) {
  Guests guests(4);
  guests.Come("a", "a1");
  guests.Come("a", "a2");
  guests.held["a1"].SetWaiting(false);
  guests.places.EndWaiting();
  EXPECT_EQ(guests.told, (std::vector<std::string>{"a2"}));
  guests.held.erase("a2");
  EXPECT_FALSE(guests.places.WaitUntilEmpty(std::chrono::steady_clock::now()));
  guests.places.EndAll();
  EXPECT_EQ(guests.told.back(), "a1");
  std::thread leaver([&] { guests.held.clear(); });
  guests.places.WaitUntilEmpty();
  leaver.join();
  EXPECT_EQ(guests.places.count(), 0u);
}

TEST(SignsOfLife, AsksAfterTheIntervalAndGivesUpAfterTheTimeout) {
  using Next = SignsOfLife::Next;
  const SignsOfLife::TimePoint start{};
  const auto at = [&](int ms) { return start + milliseconds(ms); };
  SignsOfLife signs({milliseconds(100), milliseconds(50)}, milliseconds(1000), start);
  EXPECT_EQ(signs.Look(at(99), true, false, 0), Next::kWait);
  EXPECT_EQ(signs.Look(at(100), true, false, 0), Next::kPing);
  EXPECT_EQ(signs.Look(at(149), true, false, 0), Next::kWait);
  EXPECT_EQ(signs.Look(at(150), true, false, 0), Next::kGiveUp);
  signs.Heard(at(140));
  EXPECT_EQ(signs.Look(at(239), true, false, 0), Next::kWait);
  EXPECT_EQ(signs.Look(at(240), true, false, 0), Next::kPing);
  // Whoever takes what was sent is there, and whoever is not read from cannot be heard.
  EXPECT_EQ(signs.Look(at(280), true, false, 500), Next::kWait);
  EXPECT_EQ(signs.Look(at(400), false, false, 500), Next::kWait);
  EXPECT_EQ(signs.Look(at(499), true, false, 500), Next::kWait);
  // One that takes a message has more time, but no more than that.
  signs.WriteBegan(at(500));
  EXPECT_EQ(signs.Look(at(1500), true, true, 500), Next::kWait);
  EXPECT_EQ(signs.Look(at(1501), true, true, 500), Next::kGiveUp);
}

TEST(GatheredMessage, IsWhatCameAndTakesMemoryAsItComes) {
  std::mt19937 random(1);
  for (const std::size_t size : {0, 1, 100, 16'384, 16'385, 100'000, 5'000'000}) {
    std::string sent(size, '\0');
    for (char& c : sent) c = static_cast<char>(random());
    GatheredMessage message;
    for (std::size_t at = 0; at < size;) {
      const auto room = message.Room(std::size_t{1} << 40);  // What is announced does not matter.
      ASSERT_LE(room.size(), std::max<std::size_t>(message.size(), 16'384));
      const std::size_t count =
          std::min({room.size(), size - at, 1 + random() % (1 + room.size())});
      std::copy_n(sent.begin() + static_cast<std::ptrdiff_t>(at), count, room.begin());
      message.Filled(count);
      at += count;
    }
    EXPECT_EQ(message.size(), size);
    const grpc::ByteBuffer taken = message.Take();
    EXPECT_EQ(message.size(), 0u);
    std::vector<grpc::Slice> slices;
    ASSERT_TRUE(taken.Dump(&slices).ok());
    std::string got;
    for (const auto& slice : slices) got.append(slice.begin(), slice.end());
    EXPECT_EQ(got, sent);
  }
}

}  // namespace
}  // namespace partiemc::server
