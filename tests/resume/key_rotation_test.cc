// The key for checkpoints is changed while a stream runs: from A to B and A to B alone. In each
// step the stream loses its server and resumes at the other one.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "partiemc/client/stream.h"
#include "resume/fleet.h"
#include "resume/history.h"
#include "resume/workload.h"
#include "service/service_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::resume {
namespace {

const std::string kKeyA = "key-a-of-test-0123456789\n";
const std::string kKeyB = "key-b-of-test-0123456789\n";
constexpr std::uint64_t kFramesEach = 6;

class KeyRotation : public testing::Test {
 protected:
  // Atomically.
  std::string Write(const std::string& keys) const {
    const std::string next = folder_.Write("next", keys), path = folder_.Path("keys");
    std::filesystem::rename(next, path);
    return path;
  }
  // Changes the keys; returns when every running server has loaded them.
  void Change(const std::string& keys) {
    std::vector<std::size_t> before;
    for (std::size_t k = 0; k < fleet_.size(); ++k) before.push_back(Reloads(k));
    Write(keys);
    for (std::size_t k = 0; k < fleet_.size(); ++k) {
      ASSERT_TRUE(server::Eventually([&] { return Reloads(k) > before[k]; })) << fleet_.Output(k);
    }
  }
  std::size_t Reloads(std::size_t server) const {
    const std::string log = fleet_.Output(server), words = "checkpoint keys reloaded";
    std::size_t count = 0;
    for (std::size_t at = log.find(words); at != log.npos; at = log.find(words, at + 1)) ++count;
    return count;
  }

  // Sends the next frames, each after the answer to the previous one.
  void Exchange(client::Stream& stream, History& history) {
    client::Event event;
    for (std::uint64_t k = 0; k < kFramesEach; ++k) {
      const auto& particles = workload_.at(history.sent);
      const Frame frame{.positions = std::span<const double>(particles.positions),
                        .ids = particles.ids};
      ASSERT_TRUE(stream.Send(frame, 0.01 * static_cast<double>(history.sent)).ok());
      ++history.sent;
      for (;;) {
        const auto received = stream.Receive(event);
        ASSERT_TRUE(received.ok()) << received.status();
        if (event.kind != client::Event::Kind::kReconnected) break;
        history.reconnections.push_back(Clock::now());
      }
      history.answers.push_back(AnswerOf(event));
    }
  }

  const Workload workload_ = Blob();
  const support::TemporaryFolder folder_;
  Fleet fleet_{2, {"--checkpoint-key-file", Write(kKeyA)}};
};

TEST_F(KeyRotation, AStreamIsResumedAcrossEachStepWithTheBitsOfAnUndisturbedOne) {
  client::StreamOptions options{.name = "tank", .parameters = workload_.parameters};
  options.checkpoint_interval = 2;
  options.reconnect.announce = true;
  options.fallback_addresses = {fleet_.addresses()[1]};
  const auto stream = client::Stream::Open(fleet_.addresses()[0], options);
  ASSERT_TRUE(stream.ok()) << stream.status();
  History history;
  Exchange(**stream, history);
  std::size_t at = 0;
  for (const std::string& keys : {kKeyA, kKeyB + kKeyA, kKeyB}) {
    if (keys != kKeyA) Change(keys);
    fleet_.KillAndRestart(
        at);  // The last checkpoint is signed with the first key of the last step.
    at = 1 - at;
    Exchange(**stream, history);
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(history.reconnections.size(), 3u);
  EXPECT_TRUE(Ordered(history) && Unique(history));
  EXPECT_TRUE(Identical(history, RunUndisturbed(workload_, history.sent)));
}

}  // namespace
}  // namespace partiemc::resume
