// Streams over a network that cuts, resets, delays, slows, silently drops and corrupts connections;
// the server itself is healthy.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <functional>
#include <string>
#include <thread>

#include "partiemc/client/stream.h"
#include "resume/history.h"
#include "resume/options.h"
#include "resume/workload.h"
#include "server/server.h"
#include "support/certificates.h"
#include "support/chaos_proxy.h"
#include "support/random.h"
#include "support/temporary_folder.h"

namespace partiemc::resume {
namespace {

using std::chrono::milliseconds;

class Chaos : public testing::Test {
 protected:
  void SetUp() override { Serve({}); }
  void Serve(server::ServerOptions options) {
    proxy_.reset();
    options.address.port = 0;
    auto server = server::Server::Start(options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    proxy_.emplace("127.0.0.1:" + std::to_string(server_->address().port));
  }

  struct Outcome {
    History history, undisturbed;
    std::size_t window = 0;
  };

  // Streams while `disturb` runs.
  Outcome Stream(const Workload& workload, double rate, const std::function<void()>& disturb) {
    client::StreamOptions options{
        .name = workload.name, .parameters = workload.parameters, .credentials = credentials_};
    options.reconnect.announce = true;
    Outcome outcome;
    const auto stream = client::Stream::Open(proxy_->address(), options);
    outcome.history.end = stream.status();
    if (!stream.ok()) return outcome;
    outcome.window = (*stream)->info().frames_in_flight;
    std::atomic<bool> over = false;
    std::thread disturber([&] {
      disturb();
      over = true;
    });
    outcome.history =
        RunThrough(**stream, workload, rate, [&](std::uint64_t) -> bool { return over; });
    disturber.join();
    outcome.undisturbed = RunUndisturbed(workload, outcome.history.sent);
    return outcome;
  }
  void ExpectAll(const Outcome& outcome, const std::string& what) {
    ExpectGuarantees(outcome.history, outcome.undisturbed, outcome.window, what);
  }

  client::Credentials credentials_;
  std::unique_ptr<server::Server> server_;
  std::optional<support::ChaosProxy> proxy_;
};

TEST_F(Chaos, CutsAndResetsAtRandomMomentsAreSeenInNoAnswer) {
  const std::uint64_t faults = GetOptions().faults;
  std::printf("seed %llu\n", static_cast<unsigned long long>(GetOptions().seed));
  for (const Workload& workload : {DamBreak(), Blob(), Leap(), Merge()}) {
    support::Random random(GetOptions().seed);
    const auto outcome = Stream(workload, 0, [&] {
      for (std::uint64_t k = 0; k < faults; ++k) {
        std::this_thread::sleep_for(milliseconds(static_cast<int>(random.Uniform(5, 150))));
        random.Chance(0.5) ? proxy_->Cut() : proxy_->Reset();
      }
    });
    ExpectAll(outcome, workload.name);
    EXPECT_GT(outcome.history.reconnections.size(), 0u);
  }
}

TEST_F(Chaos, ASlowAndLateNetworkOnlyTakesLonger) {
  const auto outcome = Stream(DamBreak(), 0, [&] {
    proxy_->Delay(milliseconds(40));
    proxy_->Limit(1'000'000);
    std::this_thread::sleep_for(milliseconds(1500));
    proxy_->Reset();
    std::this_thread::sleep_for(milliseconds(1500));
    proxy_->Delay(milliseconds(0));
    proxy_->Limit(0);
  });
  ExpectAll(outcome, "delayed by 40 ms, 1 MB/s");
}

TEST_F(Chaos, DetectsASilentlyDeadConnectionAndTakesOverTheStream) {
  const auto outcome = Stream(Blob(), 20, [&] {
    std::this_thread::sleep_for(milliseconds(300));
    proxy_->HalfOpen();
    // Waits until the client has detected the loss and taken over by its token, because the server
    // still holds the name.
    while (proxy_->accepted() < 2) std::this_thread::sleep_for(milliseconds(10));
    std::this_thread::sleep_for(milliseconds(300));
  });
  ExpectAll(outcome, "half open");
  EXPECT_EQ(outcome.history.reconnections.size(), 1u);
}

// Without TLS a corrupted frame may look like another valid frame to the server. But no answer is
// lost, doubled or out of order: the stream continues, or ends with a reported error.
TEST_F(Chaos, FlippedBitsNeverLoseDoubleOrReorderInSilence) {
  const std::uint64_t faults = GetOptions().faults;
  support::Random random(GetOptions().seed);
  for (std::uint64_t k = 0; k < faults; ++k) {
    const auto outcome = Stream(Leap(), 0, [&] {
      std::this_thread::sleep_for(milliseconds(20));
      proxy_->Flip(1 + random.Below(3), random.Chance(0.5));
      std::this_thread::sleep_for(milliseconds(60));
    });
    if (outcome.history.end.ok()) {
      EXPECT_TRUE(Complete(outcome.history));
    }
    EXPECT_TRUE(Ordered(outcome.history));
    EXPECT_TRUE(Unique(outcome.history));
    EXPECT_TRUE(Bounded(outcome.history, std::max<std::size_t>(1, outcome.window)));
  }
  EXPECT_GT(proxy_->flipped(), 0u);
}

// With TLS a corrupted byte ends the connection, and the stream reconnects.
TEST_F(Chaos, FlippedBitsUnderTlsAreSeenInNoAnswer) {
  const CertificateAuthority authority("authority");
  const IssuedCertificate identity = authority.Issue("server");
  const support::TemporaryFolder folder;
  credentials_ = {.tls = true, .ca_file = folder.Write("ca.pem", authority.certificate())};
  const server::TlsFiles files{.certificate = folder.Write("server.pem", identity.certificate),
                               .key = folder.Write("server.key", identity.key)};
  server::ServerOptions options;
  options.tls = files;
  ASSERT_NO_FATAL_FAILURE(Serve(options));
  support::Random random(GetOptions().seed);
  const auto outcome = Stream(Leap(), 0, [&] {
    for (std::uint64_t k = 0; k < GetOptions().faults; ++k) {
      std::this_thread::sleep_for(milliseconds(static_cast<int>(random.Uniform(20, 150))));
      proxy_->Flip(1, random.Chance(0.5));
    }
  });
  ExpectAll(outcome, "under TLS");
  EXPECT_GT(proxy_->flipped(), 0u);
  EXPECT_GT(outcome.history.reconnections.size(), 0u);
  std::printf("%llu bits flipped, %zu reconnections, %zu answers\n",
              static_cast<unsigned long long>(proxy_->flipped()),
              outcome.history.reconnections.size(), outcome.history.answers.size());
}

// Checks that the validators can fail.
TEST(History, TheValidatorsFindWhatTheyAreNamedAfter) {
  const auto answer = [](std::uint64_t sequence, std::uint64_t digest) {
    return Answer{.sequence = sequence, .is_result = true, .rings_digest = digest};
  };
  const History good{.sent = 3, .answers = {answer(1, 10), answer(2, 20), answer(3, 30)}};
  ExpectGuarantees(good, good, 1, "the same");

  History lost = good;
  lost.answers.pop_back();
  EXPECT_FALSE(Complete(lost));
  History broken = good;
  broken.end = absl::UnavailableError("gone");
  EXPECT_FALSE(Complete(broken));
  History swapped = good;
  std::swap(swapped.answers[0], swapped.answers[1]);
  EXPECT_FALSE(Ordered(swapped));
  History doubled = good;
  doubled.answers.push_back(answer(3, 30));
  EXPECT_FALSE(Unique(doubled));
  History other = good;
  other.answers[1].rings_digest = 21;
  EXPECT_FALSE(Identical(other, good));
  History greedy = good;
  greedy.most_in_flight = 2;
  EXPECT_FALSE(Bounded(greedy, 1));
}

}  // namespace
}  // namespace partiemc::resume
