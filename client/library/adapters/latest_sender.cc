#include "partiemc/client/latest_sender.h"

#include <thread>
#include <utility>

#include "client/library/gather.h"
#include "client/library/owned_frame.h"
#include "common/mutex.h"
#include "partiemc/status.h"

namespace partiemc::client {
class LatestSender::Sending {
 public:
  Sending(FrameStream& stream, OfferHooks hooks) : stream_(stream), hooks_(std::move(hooks)) {
    thread_ = std::thread([this] { Run(); });
  }
  ~Sending() {
    if (!thread_.joinable()) return;
    {
      const MutexLock lock(mutex_);
      Stop(absl::CancelledError("the sender was destroyed"));
    }
    stream_.Cancel();
    thread_.join();
  }

  template <typename Particles>  // Frame or wire::FrameRows.
  absl::Status Offer(const Particles& frame, double time) ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    if (finishing_) return absl::FailedPreconditionError("frame: offered after Finish");
    if (!status_.ok()) return status_;
    if (std::exchange(is_waiting_, true)) {
      ++counts_.skipped;
      hooks_.skipped(waiting_.number());
    }
    waiting_.Assign(frame, time, ++offers_);
    changed_.NotifyAll();
    return absl::OkStatus();
  }

  absl::Status Finish() ABSL_LOCKS_EXCLUDED(mutex_) {
    {
      const MutexLock lock(mutex_);
      if (finishing_) return absl::FailedPreconditionError("Finish: called twice");
      finishing_ = true;
      changed_.NotifyAll();
    }
    thread_.join();
    absl::Status ended;
    {
      const MutexLock lock(mutex_);
      ended = status_;
    }
    return ended.ok() ? stream_.FinishSending() : ended;
  }

  OfferCounts counts() const ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    return counts_;
  }

 private:
  void Run() ABSL_LOCKS_EXCLUDED(mutex_) {
    OwnedFrame in_hand;
    const MutexLock lock(mutex_);
    for (;;) {
      while (!is_waiting_ && !finishing_ && status_.ok()) changed_.Wait(mutex_);
      if (!status_.ok() || !is_waiting_) return;
      std::swap(in_hand, waiting_);
      is_waiting_ = false;
      ++counts_.sent;
      // The hook is called before the frame is sent, because the answer may arrive before Send
      // returns.
      hooks_.sending(in_hand.number());
      absl::Status sent;
      {
        const MutexUnlock unlock(mutex_);
        sent = stream_.Send(in_hand.frame(), in_hand.time()).status();
      }
      if (sent.ok()) continue;
      --counts_.sent;
      if (FindViolation(sent)) {
        ++counts_.refused;
        hooks_.refused(in_hand.number(), sent);
      } else {
        Stop(sent);
      }
    }
  }

  void Stop(absl::Status status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (status_.ok()) status_ = std::move(status);
    changed_.NotifyAll();
  }

  FrameStream& stream_;
  const OfferHooks hooks_;

  mutable Mutex mutex_;
  CondVar changed_;
  OwnedFrame waiting_ ABSL_GUARDED_BY(mutex_);
  bool is_waiting_ ABSL_GUARDED_BY(mutex_) = false;
  bool finishing_ ABSL_GUARDED_BY(mutex_) = false;
  std::uint64_t offers_ ABSL_GUARDED_BY(mutex_) = 0;
  OfferCounts counts_ ABSL_GUARDED_BY(mutex_);
  absl::Status status_ ABSL_GUARDED_BY(mutex_);  // Status that ended the stream.
  std::thread thread_;
};

LatestSender::LatestSender(FrameStream& stream, OfferHooks hooks)
    : sending_(std::make_unique<Sending>(stream, std::move(hooks))) {}
LatestSender::~LatestSender() = default;

absl::Status LatestSender::Offer(const Frame& frame, double time) {
  return sending_->Offer(frame, time);
}
absl::Status LatestSender::OfferArrays(const ParticleArrays& particles, double time) {
  const auto rows = RowsOf(particles, time);
  return rows.ok() ? sending_->Offer(*rows, time) : rows.status();
}
absl::Status LatestSender::Finish() { return sending_->Finish(); }
OfferCounts LatestSender::counts() const { return sending_->counts(); }

}  // namespace partiemc::client
