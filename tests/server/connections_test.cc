// The rules for connections, without a socket: clock and readings are given.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/connections/connection_ledger.h"
#include "server/connections/connection_limits.h"
#include "server/connections/connection_table.h"
#include "server/connections/flood_guard.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = ConnectionLedger::Clock;

constexpr std::uint64_t kMiB = 1 << 20;
constexpr ConnectionRules kRules{
    .unaccounted_bytes = kMiB, .max_message_bytes = 40 * kMiB, .max_streams = 100};

// A connection with simulated clock and counters.
class Ledger : public ::testing::Test {
 protected:
  std::optional<Flood> Examine(milliseconds later = milliseconds(20)) {
    now_ += later;
    const auto counts = ledger_.Take();
    return ledger_.Examine(counts, reading_, now_);
  }
  void Receive(std::uint64_t bytes) {
    reading_.bytes_received += bytes;
    reading_.bytes_read += bytes;
  }
  void Streams(std::uint64_t started, std::uint64_t open) {
    reading_.has_streams = true;
    reading_.streams_started = started;
    reading_.streams_open = open;
  }

  Clock::time_point now_{};
  ConnectionLedger ledger_{kRules, now_};
  ConnectionReading reading_;
};

TEST_F(Ledger, BytesWithoutACallAreAFlood) {
  Receive(kMiB);
  EXPECT_EQ(Examine(), std::nullopt);
  Receive(kMiB / 2);
  EXPECT_EQ(Examine(), Flood::kUnaccountedBytes);
}

TEST_F(Ledger, ASuspectExceedsASixthOfALimit) {
  Receive(kMiB / 6);
  EXPECT_EQ(Examine(), std::nullopt);
  EXPECT_FALSE(ledger_.IsSuspect());
  Receive(1'000);
  EXPECT_EQ(Examine(milliseconds(0)), std::nullopt);
  EXPECT_TRUE(ledger_.IsSuspect());
  EXPECT_EQ(Examine(milliseconds(20'000)), std::nullopt);
  Streams(16, 16);
  EXPECT_EQ(Examine(), std::nullopt);
  EXPECT_FALSE(ledger_.IsSuspect());
  Streams(17, 17);
  EXPECT_EQ(Examine(milliseconds(0)), std::nullopt);
  EXPECT_TRUE(ledger_.IsSuspect());
}

TEST(SmallLedger, TheBytesOfAUsualClientAreNotSuspect) {
  const ConnectionRules rules{.unaccounted_bytes = 128 << 10};
  const Clock::time_point now{};
  ConnectionLedger ledger(rules, now);
  ConnectionReading reading{.bytes_received = 80 << 10, .bytes_read = 80 << 10};
  EXPECT_EQ(ledger.Examine(ledger.Take(), reading, now), std::nullopt);
  EXPECT_FALSE(ledger.IsSuspect());
  ++reading.bytes_received;
  EXPECT_EQ(ledger.Examine(ledger.Take(), reading, now), std::nullopt);
  EXPECT_TRUE(ledger.IsSuspect());
}

TEST_F(Ledger, SlowBytesWithoutACallAreAFloodToo) {
  std::uint64_t received = 0;
  while (received < 3 * kMiB) {
    Receive(20'000);
    received += 20'000;
    if (Examine() == Flood::kUnaccountedBytes) break;
  }
  EXPECT_LT(received, 2 * kMiB);
}

TEST_F(Ledger, PingsOfAnIdleConnectionAreNone) {
  for (int k = 0; k < 100'000; ++k) {
    Receive(17 + 29);
    ASSERT_EQ(Examine(milliseconds(500)), std::nullopt);
  }
}

TEST_F(Ledger, AMessageUnderWayIsAllowedByItsRead) {
  ledger_.OnCallBegun();
  ledger_.OnReadBegun();
  for (int k = 0; k < 80; ++k) {
    Receive(kMiB);
    ASSERT_EQ(Examine(), std::nullopt) << k;
  }
  Receive(20 * kMiB);
  EXPECT_EQ(Examine(), Flood::kUnaccountedBytes) << "more than two of the largest messages";
}

TEST_F(Ledger, MessagesPayForTheirBytes) {
  ledger_.OnCallBegun();
  for (int k = 0; k < 1'000; ++k) {
    ledger_.OnReadBegun();
    Receive(20 * kMiB + 20 * kMiB / 50);  // In frames of a kilobyte.
    ASSERT_EQ(Examine(), std::nullopt) << k;
    ledger_.OnReadDone(20 * kMiB);
    ASSERT_EQ(Examine(), std::nullopt) << k;
  }
  EXPECT_EQ(ledger_.excess(), 0u);
}

TEST_F(Ledger, FortyCallsMayEachHaveAMessageUnderWay) {
  for (int k = 0; k < 40; ++k) {
    ledger_.OnCallBegun();
    ledger_.OnReadBegun();
  }
  Receive(40 * 40 * kMiB);
  EXPECT_EQ(Examine(), std::nullopt);
}

TEST_F(Ledger, WhatAnEndedCallHadUnderWayIsForgiven) {
  ledger_.OnCallBegun();
  ledger_.OnReadBegun();
  Receive(30 * kMiB);
  ASSERT_EQ(Examine(), std::nullopt);
  ledger_.OnCallEnded(/*reading=*/true);
  Receive(5 * kMiB);  // Sent before the client was notified.
  for (int k = 0; k < 2'000; ++k) ASSERT_EQ(Examine(), std::nullopt) << k;
  Receive(2 * kMiB);
  EXPECT_EQ(Examine(), Flood::kUnaccountedBytes) << "it is over";
}

TEST_F(Ledger, EndedCallsDoNotAddUpToALicence) {
  for (int k = 0; k < 10'000; ++k) {
    ledger_.OnCallBegun();
    ledger_.OnReadBegun();
    ledger_.OnCallEnded(/*reading=*/true);
  }
  Receive(200 * kMiB);
  EXPECT_EQ(Examine(), Flood::kUnaccountedBytes);
}

TEST_F(Ledger, RepliesPayForTheirWindowUpdates) {
  ledger_.OnCallBegun();
  for (int k = 0; k < 10'000; ++k) {
    reading_.bytes_sent += 100'000;
    Receive(2'000);
    ASSERT_EQ(Examine(), std::nullopt) << k;
  }
}

TEST_F(Ledger, TooManyStreamsAreAFlood) {
  Streams(100, 100);
  EXPECT_EQ(Examine(), std::nullopt);
  Streams(101, 101);
  EXPECT_EQ(Examine(), Flood::kStreams);
}

TEST_F(Ledger, ResetStreamsCountUntilTheyAreCalls) {
  for (std::uint64_t started = 90; started < 2'000; started += 90) {
    Streams(started, 0);
    ASSERT_EQ(Examine(), std::nullopt) << started;
    for (int k = 0; k < 90; ++k) ledger_.OnCallBegun();
  }
  Streams(reading_.streams_started + 130, 0);
  EXPECT_EQ(Examine(), Flood::kStreams);
}

TEST_F(Ledger, StreamsThatNeverAreCallsAreForgiven) {
  for (std::uint64_t started = 15; started < 2'000; started += 15) {
    Streams(started, 0);
    ASSERT_EQ(Examine(seconds(1)), std::nullopt) << started;
  }
}

TEST_F(Ledger, FewerStreamsThanBeforeAreNoFlood) {
  Streams(50, 0);
  ASSERT_EQ(Examine(), std::nullopt);
  Streams(1, 1);  // The first count was that of an earlier connection from the same port.
  EXPECT_EQ(Examine(), std::nullopt);
}

TEST_F(Ledger, HeadersWithoutAnEndAreNotHiddenByAnOpenCall) {
  ledger_.OnCallBegun();
  ledger_.OnReadBegun();
  Streams(2, 2);  // The second stream never becomes a call.
  ASSERT_EQ(Examine(), std::nullopt);
  std::optional<Flood> flood;
  for (int k = 0; k < 10 && !flood; ++k) {
    Receive(kMiB / 2);
    flood = Examine();
  }
  EXPECT_EQ(flood, Flood::kHeaders);
}

TEST_F(Ledger, AMessageMeanwhileShowsThatHeadersHaveEnded) {
  ledger_.OnCallBegun();
  ledger_.OnReadBegun();
  Streams(2, 2);
  for (int k = 0; k < 60; ++k) {
    Receive(kMiB / 2);
    ++reading_.messages;
    ASSERT_EQ(Examine(), std::nullopt) << k;
  }
}

TEST_F(Ledger, SlowHeadersEndAfterTenSeconds) {
  Streams(1, 1);
  ASSERT_EQ(Examine(), std::nullopt);
  int seconds_passed = 0;
  while (seconds_passed < 30) {
    Receive(100);
    ++seconds_passed;
    if (Examine(seconds(1)) == Flood::kHeaders) break;
  }
  EXPECT_EQ(seconds_passed, 10);
}

TEST_F(Ledger, NoLimitMeansNoLimit) {
  ConnectionLedger free({.unaccounted_bytes = 0, .max_message_bytes = 1, .max_streams = 0}, now_);
  Receive(1'000 * kMiB);
  Streams(100'000, 100'000);
  EXPECT_EQ(free.Examine(free.Take(), reading_, now_ + seconds(20)), std::nullopt);
}

constexpr ConnectionLimits kConnectionLimits{
    .connections = 10, .of_address = 4, .new_of_address = 2};

class Counts : public ::testing::Test {
 protected:
  Admission Add(const std::string& address) { return counts_.Add(address, now_); }

  Clock::time_point now_ = Clock::time_point(seconds(1'000));
  ConnectionCounts counts_{kConnectionLimits};
};

TEST_F(Counts, AnAddressHasSoManyConnections) {
  for (int k = 0; k < 4; ++k) EXPECT_EQ(Add("a"), Admission::kKept);
  now_ += seconds(10);
  EXPECT_EQ(Add("a"), Admission::kHealthOnly);
  EXPECT_EQ(Add("b"), Admission::kKept);
  counts_.Remove("a", Admission::kKept);
  EXPECT_EQ(Add("a"), Admission::kKept);
}

TEST_F(Counts, NewConnectionsAreLimitedInASecond) {
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(Add("a"), Admission::kKept);
    counts_.Remove("a", Admission::kKept);
  }
  EXPECT_EQ(Add("a"), Admission::kHealthOnly);
  now_ += milliseconds(600);
  EXPECT_EQ(Add("a"), Admission::kKept);
}

TEST_F(Counts, AllAddressesTogetherAreLimited) {
  for (int k = 0; k < 10; ++k) EXPECT_EQ(Add(std::to_string(k)), Admission::kKept);
  EXPECT_TRUE(counts_.IsFull());
  EXPECT_EQ(Add("one more"), Admission::kHealthOnly);
}

TEST_F(Counts, AFloodBansItsAddressForTenSeconds) {
  EXPECT_EQ(Add("a"), Admission::kKept);
  counts_.OnFlood("a", Admission::kKept, now_);
  counts_.Remove("a", Admission::kKept);
  now_ += seconds(9);
  EXPECT_EQ(Add("a"), Admission::kHealthOnly);
  EXPECT_EQ(Add("b"), Admission::kKept);
  now_ += seconds(2);
  EXPECT_EQ(Add("a"), Admission::kKept);
}

TEST_F(Counts, AFloodDespiteABanRefusesForASecond) {
  counts_.Remove("a", Add("a"));
  counts_.OnFlood("a", Admission::kKept, now_);
  EXPECT_EQ(Add("a"), Admission::kHealthOnly);
  counts_.OnFlood("a", Admission::kHealthOnly, now_);
  counts_.Remove("a", Admission::kHealthOnly);
  EXPECT_EQ(Add("a"), Admission::kRefused);
  EXPECT_EQ(Add("b"), Admission::kKept);
  now_ += milliseconds(1'001);
  EXPECT_EQ(Add("a"), Admission::kHealthOnly);
}

TEST(CountsWithoutLimits, NothingIsRefusedBehindAProxy) {
  ConnectionCounts counts({.connections = 0, .of_address = 0, .new_of_address = 0});
  counts.Add("proxy", {});
  counts.OnFlood("proxy", Admission::kKept, {});
  for (int k = 0; k < 10'000; ++k) ASSERT_EQ(counts.Add("proxy", {}), Admission::kKept);
}

TEST_F(Counts, AddressesThatAreGoneAreForgotten) {
  for (int k = 0; k < 1'000; ++k) counts_.Remove(std::to_string(k), Add(std::to_string(k)));
  now_ += seconds(30);
  counts_.Forget(now_);
  EXPECT_EQ(counts_.addresses(), 0u);
}

TEST(Table, FindsTheConnectionOfAPeer) {
  ConnectionTable table;
  const auto connection =
      std::make_shared<TrackedConnection>(kRules, Admission::kKept, Clock::time_point{});
  EXPECT_TRUE(table.Add("ipv6:[fe80::1]:5", connection));
  EXPECT_FALSE(table.Add("ipv6:[fe80::1]:5", connection)) << "the peer has one already";
  EXPECT_EQ(table.BeginCall("ipv6:%5Bfe80::1%25eth0%5D:5", CallKind::kOther), connection);
  EXPECT_EQ(table.BeginCall("ipv6:[fe80::1]:6", CallKind::kOther), nullptr);
  EXPECT_EQ(table.BeginCall("unix:", CallKind::kOther), nullptr);
  table.Remove("ipv6:[fe80::1]:5");
  EXPECT_EQ(table.BeginCall("ipv6:[fe80::1]:5", CallKind::kOther), nullptr);
}

TEST(Table, AConnectionForHealthChecksIsMisusedByOtherCalls) {
  ConnectionTable table;
  const auto connection =
      std::make_shared<TrackedConnection>(kRules, Admission::kHealthOnly, Clock::time_point{});
  table.Add("ipv4:192.0.2.7:5", connection);
  table.BeginCall("ipv4:192.0.2.7:5", CallKind::kHealthCheck);
  EXPECT_FALSE(connection->misused);
  table.BeginCall("ipv4:192.0.2.7:5", CallKind::kOther);
  EXPECT_TRUE(connection->misused);
}

TEST(Tally, ReportsCallsAndReads) {
  const auto connection =
      std::make_shared<TrackedConnection>(kRules, Admission::kKept, Clock::time_point{});
  {
    CallTally tally(connection);
    tally.OnReadBegun();
    EXPECT_EQ(connection->ledger.Take().reads_open, 1u);
    tally.OnReadDone(1'000);
    tally.OnReadBegun();
    EXPECT_GT(connection->ledger.Take().credit, 1'000u);
  }
  EXPECT_EQ(connection->ledger.Take().calls_open, 0u);
  EXPECT_EQ(connection->ledger.Take().reads_open, 0u);
}

// Connections with unaccounted bytes, each below the limit of one connection.
class Guard : public ::testing::Test {
 protected:
  void Add(const std::string& address, std::uint64_t bytes, int calls = 0) {
    addresses_.push_back(std::make_unique<std::string>(address));
    connections_.push_back(
        std::make_unique<TrackedConnection>(kRules, Admission::kKept, Clock::time_point{}));
    ConnectionLedger& ledger = connections_.back()->ledger;
    ConnectionReading reading;
    reading.bytes_received = bytes;
    for (int k = 0; k < calls; ++k) ledger.OnCallBegun();
    ledger.Examine(ledger.Take(), reading, Clock::time_point{});
    examined_.push_back({connections_.back().get(), addresses_.back().get()});
    counts_.Add(address, Clock::time_point{});
  }

  std::vector<std::unique_ptr<std::string>> addresses_;
  std::vector<std::unique_ptr<TrackedConnection>> connections_;
  std::vector<ExaminedConnection> examined_;
  ConnectionCounts counts_{ConnectionLimits{}};
};

TEST_F(Guard, CutsTheLargestOfTheAddressWithMost) {
  Add("honest", kMiB / 2);
  Add("hostile", kMiB * 3 / 10);
  Add("hostile", kMiB * 4 / 10);
  Add("hostile", kMiB * 3 / 10);
  EXPECT_FALSE(LargestExcess(examined_, kRules));
  for (int k = 0; k < 3; ++k) Add("hostile", kMiB * 3 / 10);
  const auto excess = LargestExcess(examined_, kRules);
  ASSERT_TRUE(excess);
  EXPECT_EQ(excess->index, 2u);
  EXPECT_EQ(excess->flood, Flood::kUnaccountedBytes);
}

TEST_F(Guard, EvictsAnIdleConnectionOfTheLargestAddress) {
  Add("small", 0);
  Add("large", 0, /*calls=*/1);
  Add("large", 0);
  Add("large", 0);
  EXPECT_EQ(IdleOfLargestAddress(examined_, counts_), 2u);
}

TEST_F(Guard, EvictsNoConnectionThatHasCalls) {
  Add("a", 0, 1);
  Add("b", 0, 1);
  EXPECT_EQ(IdleOfLargestAddress(examined_, counts_), std::nullopt);
}

}  // namespace
}  // namespace partiemc::server
