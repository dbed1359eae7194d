#include "attack/honest_stream.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <span>
#include <utility>

#include "partiemc/reconstructor.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "support/random.h"
#include "wire/codec.h"

namespace partiemc::attack {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kInterval(50);

ReconstructionParameters Parameters() {
  ReconstructionParameters parameters;
  parameters.spacing = 1;
  return parameters;
}

// A jittered, drifting disc.
std::vector<double> Positions(unsigned seed, std::uint64_t index) {
  constexpr int kRadius = 57;
  support::Random random(seed * 1'000'003ull + index);
  const double drift = 0.3 * static_cast<double>(index % 1'000);
  std::vector<double> positions;
  for (int row = -kRadius; row <= kRadius; ++row) {
    for (int column = -kRadius; column <= kRadius; ++column) {
      if (row * row + column * column > kRadius * kRadius) continue;
      positions.push_back(column + drift + random.Uniform(-0.2, 0.2));
      positions.push_back(row + random.Uniform(-0.2, 0.2));
    }
  }
  return positions;
}

}  // namespace

struct HonestStream::State {
  std::unique_ptr<v1::ReconstructionService::Stub> stub;
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReaderWriter<v1::ReconstructRequest, v1::ReconstructResponse>> stream;
  unsigned seed = 0;
  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> frames = 0;
  std::mutex mutex;
  std::vector<double> latencies;  // Guarded by the mutex.

  bool Open() {
    v1::ReconstructRequest request;
    request.mutable_open()->set_stream_name("honest-" + std::to_string(seed));
    wire::EncodeParameters(Parameters(), *request.mutable_open()->mutable_parameters());
    v1::ReconstructResponse answer;
    return stream->Write(request) && stream->Read(&answer) && answer.has_opened();
  }

  // False after the first wrong answer.
  bool SendFrame(std::uint64_t index, const Reconstructor& reconstructor) {
    const std::vector<double> positions = Positions(seed, index);
    Frame frame;
    frame.positions = std::span<const double>(positions);
    v1::ReconstructRequest request;
    wire::EncodeFrame(frame, *request.mutable_frame());
    request.mutable_frame()->set_sequence(index + 1);
    const auto sent = Clock::now();
    v1::ReconstructResponse answer;
    const bool came = stream->Write(request) && stream->Read(&answer);
    const std::chrono::duration<double, std::milli> took = Clock::now() - sent;
    {
      const std::lock_guard lock(mutex);
      latencies.push_back(took.count());
    }
    const auto status = reconstructor.Reconstruct(frame, expected_state, workspace, expected);
    EXPECT_TRUE(status.ok()) << status;
    const bool right = came && answer.frame().rings_digest() == DigestRings(expected.rings) &&
                       answer.frame().mesh_digest() == DigestMesh(expected.mesh);
    EXPECT_TRUE(right) << "frame " << index + 1 << ": "
                       << (came ? answer.ShortDebugString().substr(0, 200)
                                : "the stream has ended");
    return right;
  }

  void Run() {
    const auto reconstructor = Reconstructor::Create(Parameters());
    auto next = Clock::now();
    while (!stop && SendFrame(frames, *reconstructor)) {
      ++frames;
      next = std::max(next + kInterval, Clock::now());
      std::this_thread::sleep_until(next);
    }
    if (stop) {
      stream->WritesDone();
      const auto status = stream->Finish();
      EXPECT_TRUE(status.ok()) << status.error_message();
    } else {
      context.TryCancel();
      stream->Finish();
    }
  }

  partiemc::State expected_state;
  Workspace workspace;
  Result expected;
};

HonestStream::HonestStream(const std::string& address, const std::string& token, unsigned seed,
                           const std::string& ca)
    : state_(std::make_unique<State>()) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  state_->seed = seed;
  const auto credentials = ca.empty() ? grpc::InsecureChannelCredentials()
                                      : grpc::SslCredentials({.pem_root_certs = ca});
  state_->stub = v1::ReconstructionService::NewStub(
      grpc::CreateCustomChannel(address, credentials, arguments));
  if (!token.empty()) state_->context.AddMetadata("authorization", "Bearer " + token);
  // A timeout for hangs only.
  state_->context.set_deadline(std::chrono::system_clock::now() + std::chrono::hours(3));
  state_->stream = state_->stub->Reconstruct(&state_->context);
  EXPECT_TRUE(state_->Open()) << "an honest stream is not let in";
  thread_ = std::thread([this] { state_->Run(); });
}

HonestStream::~HonestStream() { Stop(); }

void HonestStream::Stop() {
  state_->stop = true;
  if (thread_.joinable()) thread_.join();
}

std::vector<double> HonestStream::TakeLatencies() {
  const std::lock_guard lock(state_->mutex);
  return std::exchange(state_->latencies, {});
}

std::uint64_t HonestStream::frames() const { return state_->frames; }

}  // namespace partiemc::attack
