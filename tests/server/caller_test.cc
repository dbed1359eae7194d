// Permissions and accounts of callers; also under ThreadSanitizer.
#include "server/security/caller.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/security/peer_accounts.h"
#include "support/reason_of.h"

namespace partiemc::server {
namespace {

using support::ReasonOf;

using Kind = CallerAccount::Kind;
using Place = CallerAccount::Place;

TEST(CallerAccount, HasAsManyPlacesOfEachKindAsItsQuotaSays) {
  const auto account =
      std::make_shared<CallerAccount>(CallerQuota{.calls = 3, .streams = 1, .watchers = 2});
  const struct {
    Kind kind;
    std::uint32_t most;
    std::string_view reason;
  } kinds[] = {{Kind::kCall, 3, kReasonCallerCalls},
               {Kind::kStream, 1, kReasonCallerStreams},
               {Kind::kWatcher, 2, kReasonCallerWatchers},
               {Kind::kReflection, 4, kReasonCallerCalls}};
  std::vector<Place> places;
  for (const auto& [kind, most, reason] : kinds) {
    for (std::uint32_t i = 0; i < most; ++i) {
      auto place = account->Take(kind);
      ASSERT_TRUE(place.ok()) << place.status();
      places.push_back(*std::move(place));
    }
    const auto refused = account->Take(kind);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_EQ(ReasonOf(refused.status()), reason);
    EXPECT_EQ(account->held(kind), most);
  }
  places.erase(places.begin());
  EXPECT_TRUE(account->Take(Kind::kCall).ok());
  EXPECT_FALSE(account->Take(Kind::kStream).ok());
  places.clear();
  for (const auto& row : kinds) EXPECT_EQ(account->held(row.kind), 0u);
}

TEST(CallerAccount, SaysWhatIsTooMuchAndTheWayOut) {
  const auto account = std::make_shared<CallerAccount>(CallerQuota{.streams = 1});
  const Place place = *account->Take(Kind::kStream);
  EXPECT_EQ(account->Take(Kind::kStream).status().message(),
            "caller.streams: 1 going on; must be at most 1 of one caller, which is a token or, "
            "without tokens, an address; try again when a call of it has ended");
  EXPECT_EQ(TooManyBytesOfCaller(70).message(),
            "caller.bytes: 70 more; must not make it more than is free, nor more than the `bytes=` "
            "of one caller, which is a token or, without tokens, an address; try again when a call "
            "of it has ended");
}

TEST(CallerAccount, WithANewQuotaKeepsWhatItHoldsAndGetsNoMoreThanThat) {
  const auto account = std::make_shared<CallerAccount>();
  std::vector<Place> places;
  for (int i = 0; i < 5; ++i) places.push_back(*account->Take(Kind::kCall));
  account->SetQuota({.calls = 3});
  EXPECT_EQ(account->held(Kind::kCall), 5u);
  for (std::size_t left = 5; left >= 3; --left) {
    EXPECT_FALSE(account->Take(Kind::kCall).ok()) << left << " are held";
    places.pop_back();
  }
  EXPECT_TRUE(account->Take(Kind::kCall).ok());
}

TEST(CallerAccount, APlaceThatIsMovedIsHeldOnce) {
  const auto account = std::make_shared<CallerAccount>();
  Place first = *account->Take(Kind::kStream);
  Place second = std::move(first);
  EXPECT_EQ(account->held(Kind::kStream), 1u);
  EXPECT_EQ(second.account(), account.get());
  first = *account->Take(Kind::kStream);
  EXPECT_EQ(account->held(Kind::kStream), 2u);
  first = std::move(second);
  second = {};
  EXPECT_EQ(account->held(Kind::kStream), 1u);
  first = {};
  EXPECT_EQ(account->held(Kind::kStream), 0u);
}

TEST(CallerAccount, CountsRightWhereManyThreadsComeAndGo) {
  const auto account = std::make_shared<CallerAccount>(CallerQuota{.calls = 3});
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 2000; ++k) {
        const auto place = account->Take(Kind::kCall);
        EXPECT_LE(account->held(Kind::kCall), 3u);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(account->held(Kind::kCall), 0u);
}

TEST(Caller, MayDoWhatItsTermsSayAndIsToldNothingElse) {
  const auto terms = std::make_shared<const CallerTerms>(
      CallerTerms{.name = "wall", .may_produce = false, .names = {"tank-*"}});
  const Caller caller(terms, std::make_shared<CallerAccount>());
  EXPECT_EQ(caller.name(), "wall");
  EXPECT_TRUE(caller.CheckMayWatch().ok() && caller.CheckMayList().ok());
  EXPECT_EQ(caller.CheckMayProduce().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(ReasonOf(caller.CheckMayProduce()), kReasonNotPermitted);
  EXPECT_EQ(caller.CheckMayProduce().message(),
            "authorization: a token that may not produce; must be one that may produce (`may=` in "
            "the server's --token-file)");
  EXPECT_TRUE(caller.CheckMayUse("tank-1").ok());
  const auto refused = caller.CheckMayUse("dam\n1");
  EXPECT_EQ(ReasonOf(refused), kReasonNotPermitted);
  EXPECT_EQ(
      refused.message(),
      "open.stream_name: \"dam\\n1\"; must be a name that this token may use (`names=` in the "
      "server's --token-file)");
}

TEST(Caller, OfNobodyInParticularMayEverythingOnAnAccountOfItsOwn) {
  const Caller one, other;
  EXPECT_TRUE(one.CheckMayProduce().ok() && one.CheckMayWatch().ok() && one.CheckMayList().ok());
  EXPECT_TRUE(one.CheckMayUse("anything").ok());
  EXPECT_EQ(one.name(), "");
  EXPECT_NE(one.account(), other.account());
}

TEST(PeerAccounts, AreOneForAllAddressesThatAHostOfIpv6HasForTheAsking) {
  EXPECT_EQ(HostOfPeer("ipv6:[2001:db8::1]:80"), "ipv6:2001:db8::");
  EXPECT_EQ(HostOfPeer("ipv6:%5B2001:db8::1%5D:80"), "ipv6:2001:db8::");
  EXPECT_EQ(HostOfPeer("ipv6:%5B2001:db8::ffff:1:2:3%5D:81"), "ipv6:2001:db8::");
  EXPECT_EQ(HostOfPeer("ipv6:%5B2001:db8:0:1::1%5D:80"), "ipv6:2001:db8:0:1::");
  EXPECT_EQ(HostOfPeer("ipv6:%5Bfe80::1%25eth0%5D:80"), "ipv6:fe80::");
  EXPECT_EQ(HostOfPeer("ipv6:%5B::1%5D:80"), "ipv6:::");
  EXPECT_EQ(HostOfPeer("ipv6:%5B::ffff:192.0.2.7%5D:80"), "ipv6:::ffff:192.0.2.7");
}

TEST(PeerAccounts, AreOneForEachAddressWhateverThePort) {
  PeerAccounts peers({.calls = 7});
  const auto account = peers.Of("ipv4:192.0.2.7:5000");
  EXPECT_EQ(account->quota().calls, 7u);
  EXPECT_EQ(peers.Of("ipv4:192.0.2.7:5001"), account);
  EXPECT_NE(peers.Of("ipv4:192.0.2.8:5000"), account);
  EXPECT_EQ(HostOfPeer("unix:"), HostOfPeer("unix:/run/partiemc.sock"));
  EXPECT_EQ(HostOfPeer("inproc"), "inproc");
}

TEST(PeerAccounts, AreForgottenWithTheLastWhoHoldsThem) {
  std::optional<PeerAccounts> peers(std::in_place, CallerQuota());
  auto first = peers->Of("ipv4:192.0.2.7:1");
  std::optional<Place> place = *first->Take(Kind::kCall);
  first.reset();
  EXPECT_EQ(peers->size(), 1u) << "a place holds it";
  EXPECT_EQ(peers->Of("ipv4:192.0.2.7:2")->held(Kind::kCall), 1u);
  place.reset();
  EXPECT_EQ(peers->size(), 0u);
  for (int i = 0; i < 1000; ++i) peers->Of("ipv4:192.0.2." + std::to_string(i) + ":1");
  EXPECT_EQ(peers->size(), 0u);
  place = *peers->Of("ipv4:192.0.2.7:1")->Take(Kind::kCall);
  peers.reset();
  place.reset();  // Slots may be released after their account.
}

TEST(PeerAccounts, ComeAndGoFromManyThreads) {
  PeerAccounts peers({.calls = 2});
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 2000; ++k) {
        const auto place = peers.Of("ipv4:192.0.2.1:" + std::to_string(k))->Take(Kind::kCall);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(peers.size(), 0u);
}

}  // namespace
}  // namespace partiemc::server
