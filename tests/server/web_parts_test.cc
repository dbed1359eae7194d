// Parts of the gateway without connections: slots, signs of life, gathered messages, responses.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "server/web/connection_slots.h"
#include "server/web/gathered_message.h"
#include "server/web/responses.h"
#include "server/web/signs_of_life.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

using State = ConnectionSlots::State;

struct Guests {
  explicit Guests(ConnectionSlots::Limits limits) : slots(limits) {}
  // True if the new connection may make all calls.
  bool Come(const std::string& address, const std::string& name) {
    bool evicted = false;
    const std::size_t before = ended.size();
    held[name] = slots.Enter(
        address, [this, name] { ended.push_back(name); }, evicted);
    EXPECT_EQ(evicted, ended.size() > before);
    return !held[name].reserved();
  }

  ConnectionSlots slots;
  std::vector<std::string> ended;
  std::map<std::string, ConnectionSlots::Slot> held;
};

TEST(ConnectionSlots, EvictsOldestIdleOfTheAddressWithMost) {
  Guests guests({.connections = 4, .per_address = 4, .reserved = 1});
  EXPECT_TRUE(guests.Come("a", "a1"));
  EXPECT_TRUE(guests.Come("b", "b1"));
  EXPECT_TRUE(guests.Come("b", "b2"));
  EXPECT_TRUE(guests.Come("b", "b3"));
  EXPECT_TRUE(guests.ended.empty());
  guests.held["b1"].SetState(State::kServed);
  guests.held["b2"].SetState(State::kPending);
  EXPECT_TRUE(guests.Come("c", "c1"));
  EXPECT_EQ(guests.ended, (std::vector<std::string>{"b2"}));
  guests.held.erase("b2");
  EXPECT_TRUE(guests.Come("c", "c2"));  // Each has one: evicts the oldest of all.
  EXPECT_EQ(guests.ended, (std::vector<std::string>{"b2", "a1"}));
  guests.held["b1"].SetState(State::kNoCall);  // Its call has ended.
  EXPECT_TRUE(guests.Come("c", "c3"));
  EXPECT_EQ(guests.ended.back(), "b1");
}

TEST(ConnectionSlots, EvictsOfTheNewcomersAddressAtItsLimit) {
  Guests guests({.connections = 8, .per_address = 2, .reserved = 1});
  guests.Come("a", "a1");
  guests.Come("b", "b1");
  guests.Come("b", "b2");
  EXPECT_TRUE(guests.Come("b", "b3"));
  EXPECT_EQ(guests.ended, (std::vector<std::string>{"b1"}));
  guests.held["b2"].SetState(State::kServed);
  guests.held["b3"].SetState(State::kServed);
  EXPECT_FALSE(guests.Come("b", "b4"));
  EXPECT_TRUE(guests.Come("a", "a2"));
  guests.held.erase("b2");
  EXPECT_TRUE(guests.Come("b", "b5"));
  EXPECT_EQ(guests.ended.size(), 1u);
}

TEST(ConnectionSlots, ReservesSlotsBesideServedConnections) {
  Guests guests({.connections = 2, .per_address = 2, .reserved = 2});
  guests.Come("a", "a1");
  guests.Come("b", "b1");
  for (auto& [name, slot] : guests.held) slot.SetState(State::kServed);
  EXPECT_FALSE(guests.Come("c", "c1"));
  EXPECT_FALSE(guests.Come("d", "d1"));
  EXPECT_TRUE(guests.ended.empty());
  EXPECT_FALSE(guests.Come("d", "d2"));
  EXPECT_EQ(guests.ended, (std::vector<std::string>{"c1"}));
  EXPECT_FALSE(guests.Come("e", "e1"));
  EXPECT_EQ(guests.ended.back(), "d1");
  guests.held.erase("a1");
  EXPECT_TRUE(guests.Come("c", "c2"));
  EXPECT_EQ(guests.ended.size(), 2u);
}

TEST(ConnectionSlots, EndsUnusedOnesThenAllAndWaitsForThem) {
  Guests guests({.connections = 4, .per_address = 4, .reserved = 1});
  guests.Come("a", "a1");
  guests.Come("a", "a2");
  guests.Come("a", "a3");
  guests.held["a1"].SetState(State::kServed);
  guests.held["a3"].SetState(State::kPending);
  guests.slots.EndUnused();
  EXPECT_EQ(guests.ended, (std::vector<std::string>{"a2"}));
  guests.held.erase("a2");
  EXPECT_FALSE(guests.slots.WaitUntilEmpty(std::chrono::steady_clock::now()));
  guests.slots.EndAll();
  EXPECT_EQ(guests.ended.size(), 3u);
  std::thread leaver([&] { guests.held.clear(); });
  guests.slots.WaitUntilEmpty();
  leaver.join();
  EXPECT_EQ(guests.slots.count(), 0u);
}

// Compares with a model with plain counts, for random connections, ends and states.
TEST(ConnectionSlots, KeepsItsLimitsInAnyOrder) {
  std::mt19937 random(7);
  const auto below = [&](std::size_t count) { return random() % count; };
  for (int round = 0; round < 200; ++round) {
    const ConnectionSlots::Limits limits{
        .connections = 1 + below(6), .per_address = 1 + below(4), .reserved = 1 + below(3)};
    Guests guests(limits);
    std::map<std::string, std::string> address_of;
    for (int step = 0; step < 300; ++step) {
      if (!guests.held.empty() && below(3) == 0) {
        auto at = std::next(guests.held.begin(), static_cast<long>(below(guests.held.size())));
        at->second.SetState(static_cast<State>(below(3)));
        if (at->second.reserved()) at->second.SetState(State::kNoCall);
        if (below(2) == 0) guests.held.erase(at);
        continue;
      }
      const std::string name = std::to_string(step), address(1, static_cast<char>('a' + below(3)));
      address_of[name] = address;
      guests.Come(address, name);
      std::map<std::string, std::size_t> ordinary;
      std::size_t all = 0, reserved = 0;
      for (const auto& [held, slot] : guests.held) {
        if (std::ranges::find(guests.ended, held) != guests.ended.end()) continue;
        if (slot.reserved()) {
          ++reserved;
        } else {
          ++all;
          ASSERT_LE(++ordinary[address_of[held]], limits.per_address);
        }
      }
      ASSERT_LE(all, limits.connections);
      ASSERT_LE(reserved, limits.reserved);
    }
  }
}

TEST(SignsOfLife, AsksAfterTheIntervalAndGivesUpAfterTheTimeout) {
  using Next = SignsOfLife::Next;
  const SignsOfLife::TimePoint start{};
  const auto at = [&](int ms) { return start + milliseconds(ms); };
  SignsOfLife signs({milliseconds(100), milliseconds(50)}, milliseconds(1000), start);
  EXPECT_EQ(signs.Check(at(99), true, false, 0), Next::kWait);
  EXPECT_EQ(signs.Check(at(100), true, false, 0), Next::kPing);
  EXPECT_EQ(signs.Check(at(149), true, false, 0), Next::kWait);
  EXPECT_EQ(signs.Check(at(150), true, false, 0), Next::kGiveUp);
  signs.OnSign(at(140));
  EXPECT_EQ(signs.Check(at(239), true, false, 0), Next::kWait);
  EXPECT_EQ(signs.Check(at(240), true, false, 0), Next::kPing);
  // Acknowledged bytes are a sign of life, and silence counts only while the server reads.
  EXPECT_EQ(signs.Check(at(280), true, false, 500), Next::kWait);
  EXPECT_EQ(signs.Check(at(400), false, false, 500), Next::kWait);
  EXPECT_EQ(signs.Check(at(499), true, false, 500), Next::kWait);
  // A message being written extends the time, up to its own limit.
  signs.WriteBegan(at(500));
  EXPECT_EQ(signs.Check(at(1500), true, true, 500), Next::kWait);
  EXPECT_EQ(signs.Check(at(1501), true, true, 500), Next::kGiveUp);
}

TEST(GatheredMessage, IsWhatCameAndTakesMemoryAsItComes) {
  std::mt19937 random(1);
  for (const std::size_t size : {0, 1, 100, 16'384, 16'385, 100'000, 5'000'000}) {
    std::string sent(size, '\0');
    for (char& c : sent) c = static_cast<char>(random());
    GatheredMessage message;
    for (std::size_t at = 0; at < size;) {
      const auto room = message.Room(std::size_t{1} << 40);  // The announced length is ignored.
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

TEST(WebResponse, HasALengthUnlessItsStatusHasNoBody) {
  const auto has_length = [](const WebResponse& response) {
    return response.Text().find("Content-Length:") != std::string::npos;
  };
  EXPECT_FALSE(has_length(ResponseToPreflight()));
  EXPECT_FALSE(has_length({.status = 304}));
  EXPECT_TRUE(has_length({.status = 200}));
}

}  // namespace
}  // namespace partiemc::server
