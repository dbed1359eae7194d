// Many watchers that ask for different levels of detail: the server refuses all beyond its limit,
// and its memory stays bounded while the producer goes on.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "server/merging_balls.h"
#include "service/server_process.h"
#include "service/service_testing.h"
#include "wire/codec.h"

namespace partiemc::attack {
namespace {

constexpr int kWatchers = 100, kLevels = 8, kRounds = 6;
constexpr std::uint64_t kFramesOfRound = 20;
constexpr double kMaxGrowthMib = 32;

class ManyLevels : public ::testing::Test {
 protected:
  // A connection of its own, so that no flow control of other watchers matters.
  std::shared_ptr<grpc::Channel> Channel(int number) const {
    grpc::ChannelArguments arguments;
    arguments.SetInt("number", number);
    return grpc::CreateCustomChannel(server_.address(), grpc::InsecureChannelCredentials(),
                                     arguments);
  }
  void OpenStream() {
    v1::ReconstructRequest open = server::OpenRequest("balls");
    wire::EncodeParameters(server::MergingBallsParameters(),
                           *open.mutable_open()->mutable_parameters());
    ASSERT_TRUE(producer_.SendAndReceive(open).has_opened());
  }
  // The producer gets the result of each frame.
  void SendFrames() {
    for (std::uint64_t k = 0; k < kFramesOfRound; ++k) {
      v1::ReconstructRequest request;
      wire::EncodeFrame(server::MergingBalls(k).AsFrame(static_cast<double>(++sequence_)),
                        *request.mutable_frame());
      request.mutable_frame()->set_sequence(sequence_);
      ASSERT_TRUE(producer_.SendAndReceive(request).has_frame()) << sequence_;
    }
  }
  static std::unique_ptr<server::WatchClient> Watch(const std::shared_ptr<grpc::Channel>& channel,
                                                    double error) {
    auto watcher = std::make_unique<server::WatchClient>(channel);
    v1::WatchStreamRequest request;
    v1::OpenWatch& open = *request.mutable_open();
    open.set_stream_name("balls");
    open.set_mode(v1::WATCH_MODE_EVERY);
    open.set_credits(1'000'000);
    open.set_from_sequence(0);
    open.mutable_level_of_detail()->set_max_error(error);
    watcher->Send(request);
    return watcher;
  }

  // The largest resident memory so far.
  double PeakMib() {
    const std::string status =
        server::FileText("/proc/" + std::to_string(server_.process().process()) + "/status");
    return std::stod(status.substr(status.find("VmHWM:") + 6)) / 1024;
  }
  std::uint32_t WatcherCount() {
    grpc::ClientContext context;
    server::SetDeadline(context);
    v1::GetServerInfoResponse info;
    const auto stub = v1::ReconstructionService::NewStub(Channel(-2));
    EXPECT_TRUE(stub->GetServerInfo(&context, {}, &info).ok());
    return info.load().watchers();
  }

  server::ServingProcess server_{{"--memory-budget", "64MB", "--max-watchers", "128"}};
  const double before_ = server_.process().ResidentMib();
  server::StreamClient producer_{Channel(-1)};
  std::uint64_t sequence_ = 0;
};

TEST_F(ManyLevels, AreRefusedBeyondTheLimitWithBoundedMemory) {
  OpenStream();
  SendFrames();
  int accepted = 0, refused = 0;
  for (int round = 0; round < kRounds; ++round) {
    const auto channel = Channel(round);
    std::vector<std::unique_ptr<server::WatchClient>> watchers;
    int taken = 0;
    for (int k = 1; k <= kWatchers; ++k) {
      auto watcher = Watch(channel, .1 + .001 * (k + kWatchers * round));
      if (watcher->Receive().has_opened()) {
        ++taken;
        watchers.push_back(std::move(watcher));
        continue;
      }
      ++refused;
      EXPECT_EQ(watcher->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
      EXPECT_EQ(watcher->reason(), "TOO_MANY_LEVELS");
    }
    EXPECT_EQ(taken, kLevels);
    accepted += taken;
    SendFrames();
    EXPECT_TRUE(watchers.front()->Receive().frame().frame().surface().has_level());
    // Half of them cancel, the others lose their connection.
    for (std::size_t k = 0; k < watchers.size(); k += 2) watchers[k]->Cancel();
    watchers.clear();
    EXPECT_TRUE(server::Eventually([&] { return WatcherCount() == 0; }));
  }
  const double peak = PeakMib();
  std::printf("levels: %d accepted, %d refused, %.1f -> at most %.1f MiB\n", accepted, refused,
              before_, peak);
  EXPECT_LE(peak - before_, kMaxGrowthMib);
  producer_.HalfClose();
  EXPECT_TRUE(producer_.Finish().ok());
  server_.process().Signal(SIGTERM);
  EXPECT_EQ(server_.process().Wait(), 0);
}

}  // namespace
}  // namespace partiemc::attack
