// A producer's messages from the first of a stream on, into the buffers that stream and worker
// reuse.
#include <spdlog/spdlog.h>

#include <atomic>
#include <memory>
#include <string>

#include "fuzz/choices.h"
#include "fuzz/held_bytes.h"
#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "partiemc/status.h"
#include "server/calls/reconstruct_call.h"
#include "server/relay/finished_streams.h"
#include "server/stream/opening_calls.h"
#include "server/stream/unary_registry.h"
#include "server/watch/level_queue.h"
#include "server/watch/result_history.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_registry.h"
#include "wire/message_bytes.h"

namespace partiemc::fuzz {
namespace {

using server::Outgoing;
using server::RequestKind;

// Number of repetitions of a message; growth during the first ones is not counted.
constexpr int kMostRepeats = 32;
constexpr int kWarmingRepeats = 8;
constexpr std::size_t kMostMessages = 64;
// Allowed growth of the heap for other reasons.
constexpr std::size_t kSlackBytes = 64 << 10;
// Bytes of messages that a worker may keep, besides a few times the largest.
constexpr std::size_t kKeptBytes = 6 << 20;
constexpr std::size_t kKeptPerByte = 4;

const server::ServerLimits& Limits() {
  static const server::ServerLimits limits{
      .frame = {.max_particles = 20'000, .max_tiles = 256},
      .max_frame_bytes = 1 << 20,
      .max_streams = 2,
      .frames_in_flight = 2,
  };
  return limits;
}

// Reads and writes nothing: the target replaces the channel and the state machine.
class NoChannel final : public server::CallChannel {
 public:
  void StartRead(grpc::ByteBuffer*) override {}
  void StartWrite(const grpc::ByteBuffer*) override {}
  void Cancel() override {}
  void Finish(const absl::Status&) override {}
  bool IsCancelled() const override { return false; }
  std::string peer() const override { return "fuzz"; }
};

// Shared by all streams of the process. The pool gets no jobs.
struct Shared {
  server::ComputePool pool{1};
  server::MemoryBudget budget{1 << 30};
  server::StateMemory states{std::uint64_t{16} << 20, std::uint64_t{64} << 10};
  server::WatchDispatcher dispatcher;
  const std::shared_ptr<server::LevelQueue> levels = std::make_shared<server::LevelQueue>(
      dispatcher,
      [](const server::LevelQueue::Frame& exact, const LevelOfDetail&, const std::atomic<bool>&) {
        return server::LevelQueue::Made{.level = exact};
      },
      server::LevelQueue::Limits{});
  server::Worker worker;
};

class Stream {
 public:
  explicit Stream(Shared& shared) : shared_(shared) {}
  ~Stream() {
    call_.OnCancel();
    call_.OnDone();
  }

  void Take(std::string_view bytes) {
    const std::size_t slot = taken_++ % Limits().frames_in_flight;
    const grpc::Slice slice(bytes.data(), bytes.size());
    call_.Request(slot) = grpc::ByteBuffer(&slice, 1);
    const RequestKind kind = call_.OnRequestRead(slot);
    if (!is_open_ && kind == RequestKind::kOpen) {
      Open(slot);
    } else if (is_open_ && kind == RequestKind::kFrame) {
      Answer(slot);
    }
    call_.Request(slot).Clear();
  }

 private:
  void Open(std::size_t slot) {
    const absl::Status opened = call_.Open(slot, call_.machine());
    is_open_ = opened.ok();
    if (!is_open_) {
      RequireViolation(opened);
      return;
    }
    Require(Response(Outgoing::kOpened, slot).opened().frames_in_flight() > 0, "a window is told");
  }

  void Answer(std::size_t slot) {
    const server::Answered answered =
        call_.Answer(slot, shared_.worker, call_.machine().cancelled());
    if (answered.afterwards) answered.afterwards();
    const v1::ReconstructResponse response = Response(Outgoing::kAnswer, slot);
    Require(answered.is_result ? response.has_frame() : response.has_error(), "an answer is told");
    if (response.has_error()) {
      const v1::FrameError& error = response.error();
      Require(!error.reason().empty() && !error.field().empty() && error.next_sequence() > 0,
              "a refusal has reason, field and the next number");
    }
  }

  // Checks the response as the client receives it.
  v1::ReconstructResponse Response(Outgoing what, std::size_t slot) {
    grpc::ByteBuffer bytes;
    bytes.Swap(&call_.Response(what, slot));
    v1::ReconstructResponse response;
    Require(wire::MergeBytes(bytes, response), "an answer reads back");
    return response;
  }

  Shared& shared_;
  server::StreamRegistry registry_{Limits().max_streams};
  server::FinishedStreams finished_;
  server::CurrentCheckpointKeys keys_;
  server::Authentication authentication_;
  server::OpeningCalls opening_{1};
  server::UnaryRegistry unary_calls_{1};
  server::WatchRegistry watchers_{1};
  server::HistoryRoom history_{0, 0};
  const server::ServerContext context_{.limits = Limits(),
                                       .authentication = authentication_,
                                       .checkpoint_keys = keys_,
                                       .history = history_,
                                       .opening = opening_,
                                       .streams = registry_,
                                       .finished = finished_,
                                       .unary_calls = unary_calls_,
                                       .watchers = watchers_,
                                       .dispatcher = shared_.dispatcher,
                                       .levels = *shared_.levels,
                                       .budget = shared_.budget,
                                       .states = shared_.states,
                                       .pool = shared_.pool};
  NoChannel channel_;
  server::ReconstructCall call_{{channel_, nullptr, server::AdmittedCall{}}, context_};
  bool is_open_ = false;
  std::size_t taken_ = 0;
};

}  // namespace

void AttackStreamRequests(Bytes bytes) {
  const SingleThread single_thread;
  static auto* const shared = new Shared;
  spdlog::set_level(spdlog::level::off);  // Opening a stream would write a line.
  shared->worker.message_buffers.reset();
  Stream stream(*shared);
  Choices choices(bytes);
  std::size_t largest = 0, messages = 0;
  while (!choices.empty() && messages < kMostMessages) {
    const int repeats = 1 + static_cast<int>(choices.Below(kMostRepeats));
    const std::string_view message = choices.TakeText(choices.Take<std::uint32_t>() & 0xfffff);
    std::size_t warm = 0;
    for (int k = 0; k < repeats && messages < kMostMessages; ++k, ++messages) {
      if (k == kWarmingRepeats) warm = HeldBytes();
      stream.Take(message);
    }
    largest = std::max(largest, message.size());
    Require(warm == 0 || HeldBytes() <= warm + kSlackBytes,
            "a message that comes again takes no further memory");
  }
  const std::size_t with_messages = HeldBytes();
  shared->worker.message_buffers.reset();
  Require(with_messages <= HeldBytes() + kKeptBytes + kKeptPerByte * largest,
          "a worker keeps no more of messages than they justify");
}

}  // namespace partiemc::fuzz
