// A draining replica sends its streams the addresses of the others; clients that knew only this
// replica resume there.
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "relay/nats_process.h"
#include "resume/history.h"
#include "resume/workload.h"
#include "service/server_process.h"
#include "service/service_testing.h"

namespace partiemc::resume {
namespace {

constexpr std::size_t kStreams = 4, kReplicas = 3;

class SentAway : public testing::Test {
 protected:
  SentAway() {
    for (std::size_t k = 0; k < kReplicas; ++k) {
      // A port that was just released.
      addresses_.push_back(server::ServingProcess().address());
      replicas_.push_back(std::make_unique<server::ServerProcess>(std::vector<std::string>{
          "--address", addresses_[k], "--nats", nats_.url(), "--advertise", addresses_[k]}));
    }
  }

  std::unique_ptr<client::Stream> Open(const std::string& name, std::size_t replica) {
    client::StreamOptions options{.name = name, .parameters = workload_.parameters};
    options.reconnect.announce = true;
    auto stream = client::Stream::Open(addresses_[replica], options);
    EXPECT_TRUE(stream.ok()) << stream.status();
    return stream.ok() ? *std::move(stream) : nullptr;
  }
  bool Knows(std::size_t replica, const std::string& stream) {
    return client::Watcher::Open(addresses_[replica], stream, {}).ok();
  }

  // Number of streams opened at a replica.
  std::size_t Opened(std::size_t replica) const {
    std::istringstream log(replicas_[replica]->Output());
    std::size_t count = 0;
    for (std::string line; std::getline(log, line);) {
      count += line.find("stream opened") != line.npos && line.find("name=tank-") != line.npos;
    }
    return count;
  }

  const Workload workload_ = Blob();
  server::NatsProcess nats_;
  std::vector<std::string> addresses_;
  std::vector<std::unique_ptr<server::ServerProcess>> replicas_;
};

TEST_F(SentAway, StreamsGoOnAtTheOtherReplicasNotAllAtTheSame) {
  const auto one = Open("one", 1), two = Open("two", 2);
  ASSERT_TRUE(server::Eventually([&] { return Knows(0, "one") && Knows(0, "two"); }));
  std::vector<std::unique_ptr<client::Stream>> streams;
  for (std::size_t k = 0; k < kStreams; ++k) {
    streams.push_back(Open("tank-" + std::to_string(k), 0));
    ASSERT_NE(streams.back(), nullptr);
  }
  std::atomic<bool> over = false;
  std::vector<History> histories(kStreams);
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < kStreams; ++k) {
    threads.emplace_back([&, k] {
      histories[k] =
          RunThrough(*streams[k], workload_, 60, [&](std::uint64_t) -> bool { return over; });
    });
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  replicas_[0]->Signal(SIGTERM);
  EXPECT_EQ(replicas_[0]->WaitFor(std::chrono::seconds(20)), std::optional(0));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  over = true;
  for (std::thread& thread : threads) thread.join();
  for (const History& history : histories) {
    EXPECT_EQ(history.reconnections.size(), 1u);
    EXPECT_TRUE(history.end.ok()) << history.end;
    EXPECT_TRUE(Complete(history) && Ordered(history) && Unique(history));
    EXPECT_TRUE(Identical(history, RunUndisturbed(workload_, history.sent)));
  }
  EXPECT_EQ(Opened(1), kStreams / 2);
  EXPECT_EQ(Opened(2), kStreams / 2);
}

}  // namespace
}  // namespace partiemc::resume
