#include "server/memory_transport.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "partiemc/status.h"

namespace partiemc::server {

namespace {

MemoryBudget& UnlimitedBudget() {
  static MemoryBudget budget(std::numeric_limits<std::uint64_t>::max());
  return budget;
}

}  // namespace

MemoryTransport::MemoryTransport(ComputePool& pool, std::size_t window,
                                 const ReconstructionParameters& parameters,
                                 const FrameLimits& limits)
    : MemoryTransport(pool, UnlimitedBudget(), window, parameters, limits) {}

MemoryTransport::MemoryTransport(ComputePool& pool, MemoryBudget& budget, std::size_t window,
                                 const ReconstructionParameters& parameters,
                                 const FrameLimits& limits)
    : parameters_(parameters),
      limits_(limits),
      requests_(window),
      answers_(window),
      machine_(std::make_shared<StreamStateMachine>(static_cast<StreamTransport&>(*this),
                                                    static_cast<StreamHandler&>(*this), pool,
                                                    budget, window)),
      reader_([this] { ReadLoop(); }),
      writer_([this] { WriteLoop(); }) {
  machine_->Start();
}

MemoryTransport::~MemoryTransport() {
  Cancel();
  reader_.join();
  writer_.join();
}

void MemoryTransport::Open() {
  SendRequest({.kind = RequestKind::kOpen, .sequence = 0, .positions = {}});
}

void MemoryTransport::Send(std::uint64_t sequence, std::vector<double> positions) {
  SendRequest({RequestKind::kFrame, sequence, std::move(positions)});
}

void MemoryTransport::SendRequest(MemoryRequest request) {
  const std::lock_guard lock(mutex_);
  sent_.push_back(std::move(request));
  changed_.notify_all();
}

void MemoryTransport::HalfClose() {
  const std::lock_guard lock(mutex_);
  half_closed_ = true;
  changed_.notify_all();
}

void MemoryTransport::Cancel() {
  {
    const std::lock_guard lock(mutex_);
    if (cancelled_ || finished_) return;
    cancelled_ = true;
    changed_.notify_all();
  }
  machine_->Cancelled();
}

std::optional<MemoryAnswer> MemoryTransport::Receive() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return to_receive_ || finished_; });
  auto answer = std::exchange(to_receive_, std::nullopt);
  if (answer && answer->what == Outgoing::kAnswer) ++frames_received_;
  changed_.notify_all();
  changed_.wait(lock, [this] { return !telling_; });
  return answer;
}

absl::Status MemoryTransport::status() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return finished_.has_value(); });
  return *finished_;
}

std::size_t MemoryTransport::most_inside() const {
  const std::lock_guard lock(mutex_);
  return most_inside_;
}

void MemoryTransport::WaitUntilRead(std::size_t frames) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return frames_read_ >= frames; });
}

void MemoryTransport::StartRead(std::size_t slot) {
  const std::lock_guard lock(mutex_);
  if (read_slot_ || finished_) throw std::logic_error("two reads at once, or one after the end");
  read_slot_ = slot;
  changed_.notify_all();
}

void MemoryTransport::StartWrite(Outgoing what, std::size_t slot) {
  const std::lock_guard lock(mutex_);
  if (being_written_ || finished_)
    throw std::logic_error("two writes at once, or one after the end");
  being_written_ = what == Outgoing::kAnswer
                       ? answers_[slot]
                       : MemoryAnswer{.what = what, .sequence = 0, .reason = {}, .digests = {}};
  changed_.notify_all();
}

absl::Status MemoryTransport::Open(std::size_t, const StreamStateMachine&) {
  auto session = Session::Open(parameters_, limits_);
  if (session.ok()) session_ = *std::move(session);
  return session.status();
}

Answered MemoryTransport::Answer(std::size_t slot, Worker& worker, const std::atomic<bool>&) {
  when_answering();
  const MemoryRequest& request = requests_[slot];
  MemoryAnswer& answer = answers_[slot];
  Frame frame;
  frame.positions = std::span<const double>(request.positions);
  const auto status =
      session_->Answer(request.sequence, frame, worker, [&](const Result& result, auto&) {
        answer.digests = {DigestRings(result.rings), DigestMesh(result.mesh)};
        return absl::OkStatus();
      });
  answer.sequence = request.sequence;
  answer.reason = status.ok() ? "" : FindViolation(status)->reason;
  if (!status.ok()) answer.digests = {};
  return {.is_result = status.ok(), .last_sequence = session_->next_sequence() - 1, .bytes = 0};
}

void MemoryTransport::Cut() {
  const std::lock_guard lock(mutex_);
  if (finished_) throw std::logic_error("cut after the end");
  cancelled_ = true;
  changed_.notify_all();
}

void MemoryTransport::Finish(const absl::Status& status) {
  const std::lock_guard lock(mutex_);
  if (finished_ || being_written_) throw std::logic_error("finished twice, or while writing");
  finished_ = status;
  changed_.notify_all();
}

void MemoryTransport::ReadLoop() {
  for (;;) {
    std::optional<RequestKind> kind;
    std::uint64_t bytes = 0;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] {
        return finished_ || (read_slot_ && (cancelled_ || half_closed_ || !sent_.empty()));
      });
      if (finished_) return;
      if (!cancelled_ && !sent_.empty()) {
        kind = sent_.front().kind;
        bytes = sent_.front().positions.size() * sizeof(double);
        requests_[*read_slot_] = std::move(sent_.front());
        sent_.pop_front();
        if (kind == RequestKind::kFrame) ++frames_read_;
        most_inside_ = std::max(most_inside_, frames_read_ - frames_received_);
        changed_.notify_all();
      }
      read_slot_.reset();
    }
    if (kind) {
      machine_->ReadDone(*kind, bytes);
    } else {
      machine_->ReadEnded();
    }
  }
}

void MemoryTransport::WriteLoop() {
  for (;;) {
    bool written = false;
    {
      std::unique_lock lock(mutex_);
      // Waits until the client has received the previous answer.
      changed_.wait(
          lock, [this] { return finished_ || (being_written_ && (cancelled_ || !to_receive_)); });
      if (finished_) return;
      written = !cancelled_;
      if (written) to_receive_ = std::move(being_written_);
      being_written_.reset();
      telling_ = true;
      changed_.notify_all();
    }
    machine_->WriteDone(written);
    const std::lock_guard lock(mutex_);
    telling_ = false;
    changed_.notify_all();
  }
}

}  // namespace partiemc::server
