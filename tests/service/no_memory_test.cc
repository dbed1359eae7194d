// The system has no memory left while a frame is parsed: the frame is refused, and the server
// continues.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "service/service_testing.h"

namespace {

constexpr std::size_t kLarge = std::size_t{1} << 19;

// While set, other threads cannot allocate blocks above kLarge.
std::atomic<bool> nothing_left = false;
std::atomic<std::uint64_t> refused = 0;
const std::thread::id kClient = std::this_thread::get_id();

}  // namespace

// Replaces the library's operator in the whole program.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (nothing_left && size >= kLarge && std::this_thread::get_id() != kClient) {
    ++refused;
    throw std::bad_alloc();
  }
  if (void* const memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

constexpr int kSide = 300;
constexpr std::uint64_t kParticles = kSide * kSide;

// Its positions alone are larger than kLarge.
v1::ParticleFrame LargeFrame() {
  std::vector<float> positions;
  for (int k = 0; k < kSide * kSide; ++k) {
    positions.push_back(static_cast<float>(k % kSide));
    positions.push_back(static_cast<float>(k / kSide));
  }
  v1::ParticleFrame frame;
  frame.set_sequence(1);
  frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  frame.set_positions(positions.data(), positions.size() * sizeof(float));
  return frame;
}

class NoMemory : public ::testing::Test {
 protected:
  void SetUp() override { refused = 0; }

  static ServerOptions Options() {
    ServerOptions options = TestOptions();
    options.limits.frame.max_particles = kParticles;
    return options;
  }

  const std::unique_ptr<Server> server_ = StartServer(Options());
  const std::shared_ptr<grpc::Channel> channel_ = Connect(*server_, Transport::kTcp);
};

TEST_F(NoMemory, AFrameThatCannotBeParsedIsAFrameErrorAndTheStreamGoesOn) {
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest("full")).has_opened());
  v1::ReconstructRequest request;
  *request.mutable_frame() = LargeFrame();

  nothing_left = true;
  const v1::ReconstructResponse full = client.SendAndReceive(request);
  nothing_left = false;
  EXPECT_GT(refused, 0u);
  ASSERT_TRUE(full.has_error()) << full.ShortDebugString();
  EXPECT_EQ(full.error().reason(), "OUT_OF_MEMORY");
  EXPECT_EQ(full.error().field(), "frame");
  EXPECT_THAT(full.error().value(), HasSubstr(" bytes"));

  request.mutable_frame()->set_sequence(full.error().next_sequence());
  const v1::ReconstructResponse answer = client.SendAndReceive(request);
  ASSERT_TRUE(answer.has_frame()) << answer.ShortDebugString();
  EXPECT_EQ(answer.frame().statistics().particles(), kParticles);
}

TEST_F(NoMemory, ACallThatCannotBeParsedEndsWithAReasonAndTheNextIsAnswered) {
  const auto stub = v1::ReconstructionService::NewStub(channel_);
  v1::ReconstructFrameRequest request;
  *request.mutable_frame() = LargeFrame();
  const auto call = [&](v1::ReconstructFrameResponse& response) {
    TimedContext context;
    return stub->ReconstructFrame(&context, request, &response);
  };

  v1::ReconstructFrameResponse response;
  nothing_left = true;
  const grpc::Status full = call(response);
  nothing_left = false;
  EXPECT_GT(refused, 0u);
  EXPECT_EQ(full.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(full.error_message(), HasSubstr("must fit into the server's memory"));

  EXPECT_TRUE(call(response).ok());
  EXPECT_EQ(response.frame().statistics().particles(), kParticles);
}

}  // namespace
}  // namespace partiemc::server
