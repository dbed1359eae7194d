#include "partiemc/client/async_stream.h"

#include <deque>
#include <thread>
#include <utility>

#include "common/mutex.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

using Answer = AsyncStream::Answer;
using Answered = AsyncStream::Answered;

/// Returns a callback that fulfils `promise`. The promise is shared because std::function must be
/// copyable.
Answered FulfilmentOf(const std::shared_ptr<std::promise<Answer>>& promise) {
  return [promise](Answer answer) { promise->set_value(std::move(answer)); };
}

}  // namespace

class AsyncStream::Receiving {
 public:
  Receiving(FrameStream& stream, Told told) : stream_(stream), told_(std::move(told)) {
    thread_ = std::thread([this] { Run(); });
  }
  ~Receiving() {
    if (!thread_.joinable()) return;
    stream_.Cancel();
    thread_.join();
  }

  FrameStream& stream() { return stream_; }

  /// Queues `answered`, then calls `send`, which sends the frame. The callback is queued first,
  /// because the answer may arrive before `send` returns. Frames are answered in order, so the
  /// front of the queue is answered next. If `send` fails, removes the callback and calls it with
  /// the error.
  template <typename Sending>
  void Send(Answered answered, const Sending& send) ABSL_LOCKS_EXCLUDED(mutex_) {
    {
      const MutexLock lock(mutex_);
      waiting_.push_back(std::move(answered));
    }
    const absl::StatusOr<std::uint64_t> sent = send();
    if (sent.ok()) return;
    if (auto refused = TakeNewest()) refused(sent.status());
  }

  absl::Status Finish() {
    if (!thread_.joinable()) return absl::FailedPreconditionError("Finish: called twice");
    const absl::Status finished = stream_.FinishSending();
    thread_.join();
    return ended_.ok() ? finished : ended_;
  }

 private:
  void Run() {
    Event event;
    for (;;) {
      const auto received = stream_.Receive(event);
      if (!received.ok() || *received == Received::kEnd) {
        ended_ = received.status();
        break;
      }
      switch (event.kind) {
        case Event::Kind::kResult:
          Deliver(std::move(event.frame));
          break;
        case Event::Kind::kRefusal:
          Deliver(ViolationError(absl::StatusCode::kInvalidArgument, event.violation));
          break;
        case Event::Kind::kPartTaken:
          Deliver(FrameResult());
          break;
        case Event::Kind::kNotice:
        case Event::Kind::kReconnected:
          if (told_) told_(event);
          break;
      }
    }
    while (auto left = TakeOldest()) {
      left(ended_.ok() ? absl::CancelledError("the stream has ended") : ended_);
    }
  }

  void Deliver(Answer answer) {
    if (const auto answered = TakeOldest()) answered(std::move(answer));
  }

  Answered TakeOldest() ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    if (waiting_.empty()) return nullptr;
    Answered oldest = std::move(waiting_.front());
    waiting_.pop_front();
    return oldest;
  }

  /// Removes and returns the callback of the newest frame; null if Run has already called it at the
  /// end of the stream.
  Answered TakeNewest() ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    if (waiting_.empty()) return nullptr;
    Answered newest = std::move(waiting_.back());
    waiting_.pop_back();
    return newest;
  }

  FrameStream& stream_;
  const Told told_;
  Mutex mutex_;
  // Callbacks of sent frames, in order.
  std::deque<Answered> waiting_ ABSL_GUARDED_BY(mutex_);
  absl::Status ended_;  // Written by the thread; read after it has been joined.
  std::thread thread_;
};

AsyncStream::AsyncStream(FrameStream& stream, Told told)
    : receiving_(std::make_unique<Receiving>(stream, std::move(told))) {}
AsyncStream::~AsyncStream() = default;

void AsyncStream::Send(const Frame& frame, double time, Answered answered) {
  receiving_->Send(std::move(answered), [&] { return receiving_->stream().Send(frame, time); });
}
void AsyncStream::SendArrays(const ParticleArrays& particles, double time, Answered answered) {
  receiving_->Send(std::move(answered),
                   [&] { return receiving_->stream().SendArrays(particles, time); });
}

std::future<AsyncStream::Answer> AsyncStream::Send(const Frame& frame, double time) {
  const auto promise = std::make_shared<std::promise<Answer>>();
  auto answer = promise->get_future();
  Send(frame, time, FulfilmentOf(promise));
  return answer;
}
std::future<AsyncStream::Answer> AsyncStream::SendArrays(const ParticleArrays& particles,
                                                         double time) {
  const auto promise = std::make_shared<std::promise<Answer>>();
  auto answer = promise->get_future();
  SendArrays(particles, time, FulfilmentOf(promise));
  return answer;
}

absl::Status AsyncStream::Finish() { return receiving_->Finish(); }

}  // namespace partiemc::client
