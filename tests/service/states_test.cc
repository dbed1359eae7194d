// Streams whose states take much memory between their frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/client/stream.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using client::Event;
using client::Stream;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A square of `side` x `side` particles.
struct Square {
  explicit Square(int side) {
    for (int k = 0; k < side * side; ++k) {
      positions.push_back(static_cast<float>(k % side));
      positions.push_back(static_cast<float>(k / side));
      ids.push_back(static_cast<std::uint64_t>(k));
    }
  }
  Frame AsFrame() const { return {.positions = std::span(positions), .ids = ids}; }

  std::vector<float> positions;
  std::vector<std::uint64_t> ids;
};

class States : public ::testing::Test {
 protected:
  // A quarter of the budget is for states. One caller may have half of it: 8 MiB.
  static ServerOptions Options() {
    ServerOptions options = TestOptions();
    options.limits.memory_budget = std::uint64_t{64} << 20;
    options.limits.frame.max_particles = 200'000;
    options.limits.max_frame_bytes = 4'000'000;
    return options;
  }

  std::unique_ptr<Stream> Open(const std::string& name) const {
    auto stream = Stream::Open(server_->address().ToString(),
                               {.name = name, .parameters = {.spacing = 1, .noise_filter = .5}});
    EXPECT_TRUE(stream.ok()) << stream.status();
    return *std::move(stream);
  }

  static Event Answer(Stream& stream, const Square& square) {
    Event event;
    const auto sent = stream.Send(square.AsFrame(), 0);
    EXPECT_TRUE(sent.ok()) << sent.status();
    const auto received = stream.Receive(event);
    EXPECT_TRUE(received.ok()) << received.status();
    return event;
  }

  static bool IsTooLarge(const Event& event) {
    return event.kind == Event::Kind::kRefusal && event.violation.reason == "MEMORY_BUDGET";
  }

  const std::unique_ptr<Server> server_ = StartServer(Options());
  const Square small_{20}, large_{400};  // The noise filter keeps 32 bytes per particle.
};

TEST_F(States, OfIdleStreamsAreBounded) {
  auto first = Open("first");
  const auto second = Open("second");
  EXPECT_EQ(Answer(*first, large_).kind, Event::Kind::kResult);
  const Event refused = Answer(*second, large_);
  ASSERT_TRUE(IsTooLarge(refused)) << refused.message;
  EXPECT_THAT(refused.message, AllOf(HasSubstr("noise_filter"), HasSubstr("--memory-budget")));
  EXPECT_EQ(Answer(*second, small_).kind, Event::Kind::kResult) << "the stream continues";
  EXPECT_EQ(Answer(*first, large_).kind, Event::Kind::kResult) << "its own state has room";

  first.reset();  // Its memory is free as soon as the server has ended the call.
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  Event event;
  do {
    event = Answer(*second, large_);
  } while (IsTooLarge(event) && std::chrono::steady_clock::now() < until);
  EXPECT_EQ(event.kind, Event::Kind::kResult) << event.message;
}

TEST_F(States, MayShrink) {
  const auto first = Open("first"), second = Open("second");
  EXPECT_EQ(Answer(*first, large_).kind, Event::Kind::kResult);
  EXPECT_EQ(Answer(*first, small_).kind, Event::Kind::kResult);
  EXPECT_EQ(Answer(*second, large_).kind, Event::Kind::kResult);
}

}  // namespace
}  // namespace partiemc::server
