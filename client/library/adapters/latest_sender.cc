#include "partiemc/client/latest_sender.h"

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "client/library/gather.h"
#include "client/library/owned_frame.h"
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
      const std::scoped_lock lock(mutex_);
      Stop(absl::CancelledError("the sender was destroyed"));
    }
    stream_.Cancel();
    thread_.join();
  }

  template <typename Particles>  // Frame or wire::FrameRows.
  absl::Status Offer(const Particles& frame, double time) {
    const std::scoped_lock lock(mutex_);
    if (finishing_) return absl::FailedPreconditionError("frame: offered after Finish");
    if (!status_.ok()) return status_;
    if (std::exchange(is_waiting_, true)) {
      ++counts_.skipped;
      hooks_.skipped(waiting_.number());
    }
    waiting_.Assign(frame, time, ++offers_);
    changed_.notify_all();
    return absl::OkStatus();
  }

  absl::Status Finish() {
    {
      const std::scoped_lock lock(mutex_);
      if (finishing_) return absl::FailedPreconditionError("Finish: called twice");
      finishing_ = true;
      changed_.notify_all();
    }
    thread_.join();
    return status_.ok() ? stream_.FinishSending() : status_;
  }

  OfferCounts counts() const {
    const std::scoped_lock lock(mutex_);
    return counts_;
  }

 private:
  void Run() {
    OwnedFrame in_hand;
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return is_waiting_ || finishing_ || !status_.ok(); });
      if (!status_.ok() || !is_waiting_) return;
      std::swap(in_hand, waiting_);
      is_waiting_ = false;
      ++counts_.sent;
      // Called before the frame is sent: its answer may arrive before Send returns.
      hooks_.sending(in_hand.number());
      lock.unlock();
      const absl::Status sent = stream_.Send(in_hand.frame(), in_hand.time()).status();
      lock.lock();
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

  void Stop(absl::Status status) {
    if (status_.ok()) status_ = std::move(status);
    changed_.notify_all();
  }

  FrameStream& stream_;
  const OfferHooks hooks_;

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  OwnedFrame waiting_;
  bool is_waiting_ = false, finishing_ = false;
  std::uint64_t offers_ = 0;
  OfferCounts counts_;
  absl::Status status_;  // Status that ended the stream.
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
