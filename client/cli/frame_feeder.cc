#include "cli/frame_feeder.h"

#include <utility>

#include "cli/console.h"
#include "partiemc/status.h"

namespace partiemc::client {

FrameFeeder::FrameFeeder(Sequence& input, FrameStream& stream,
                         std::optional<double> frames_per_second)
    : input_(input), stream_(stream), frames_per_second_(frames_per_second) {
  reader_ = std::thread([this] { Read(); });
  sender_ = std::thread([this] { SendAll(); });
}

FrameFeeder::~FrameFeeder() {
  if (!reader_.joinable()) return;
  Stop();
  Join().IgnoreError();
}

std::unique_ptr<RecordedFrame> FrameFeeder::TakeAnswered() {
  const std::scoped_lock lock(mutex_);
  FramePointer frame = std::move(unanswered_.front());
  unanswered_.pop_front();
  return frame;
}

void FrameFeeder::Recycle(FramePointer frame) {
  const std::scoped_lock lock(mutex_);
  free_.push_back(std::move(frame));
}

std::vector<FrameFeeder::Refused> FrameFeeder::TakeRefused() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(refused_, {});
}

void FrameFeeder::Stop() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_all();
  read_ahead_.Close();
  stream_.Cancel();
}

absl::Status FrameFeeder::Join() {
  read_ahead_.Close();
  reader_.join();
  sender_.join();
  return input_status_;
}

void FrameFeeder::Read() {
  while (true) {
    FramePointer frame;
    {
      const std::scoped_lock lock(mutex_);
      if (stop_) break;
      if (!free_.empty()) {
        frame = std::move(free_.back());
        free_.pop_back();
      }
    }
    if (frame == nullptr) frame = std::make_unique<RecordedFrame>();
    const auto more = input_.Next(*frame);
    if (!more.ok()) input_status_ = more.status();
    if (!more.ok() || !*more || !read_ahead_.Push(std::move(frame))) break;
  }
  read_ahead_.Close();
}

void FrameFeeder::SendAll() {
  std::size_t sent = 0;
  while (auto frame = read_ahead_.Pop()) {
    if (!Pace(sent++) || !SendOne(*std::move(frame))) {
      read_ahead_.Close();
      return;
    }
  }
  // An error ends the stream, and is told by Receive.
  stream_.FinishSending().IgnoreError();
}

bool FrameFeeder::Pace(std::size_t sent) {
  std::unique_lock lock(mutex_);
  if (!frames_per_second_) return !stop_;
  const auto due =
      start_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                   std::chrono::duration<double>(static_cast<double>(sent) / *frames_per_second_));
  return !stopped_.wait_until(lock, due, [this] { return stop_; });
}

bool FrameFeeder::SendOne(FramePointer owned) {
  const RecordedFrame& recorded = *owned;
  Frame frame{.positions = std::span<const double>(recorded.positions),
              .volumes = recorded.volumes,
              .ids = recorded.ids};
  // Without a time, velocities tell nothing of the way from frame to frame.
  if (recorded.time) frame.velocities = recorded.velocities;
  if (recorded.float32) {  // Half of the bytes, and nothing is lost.
    as_float32_.assign(recorded.positions.size(), 0);
    for (std::size_t k = 0; k < as_float32_.size(); ++k) {
      as_float32_[k] = static_cast<float>(recorded.positions[k]);
    }
    frame.positions = std::span<const float>(as_float32_);
  }
  const double time = recorded.time.value_or(static_cast<double>(recorded.index));
  {
    // Before it is sent: its answer may be there before Send returns.
    const std::scoped_lock lock(mutex_);
    unanswered_.push_back(std::move(owned));
  }
  const auto sequence = stream_.Send(frame, time);
  if (sequence.ok()) return true;
  if (!FindViolation(sequence.status())) return false;
  const std::scoped_lock lock(mutex_);
  refused_.push_back({recorded.source, OneLine(sequence.status())});
  free_.push_back(std::move(unanswered_.back()));
  unanswered_.pop_back();
  return true;
}

}  // namespace partiemc::client
