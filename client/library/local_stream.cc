#include "partiemc/client/local_stream.h"

#include <algorithm>
#include <deque>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/library/frame_request.h"
#include "client/library/gather.h"
#include "client/library/owned_frame.h"
#include "client/library/phase_attribute.h"
#include "common/clock.h"
#include "common/mutex.h"
#include "common/stage_clock.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/state.h"

namespace partiemc::client {
namespace {

class Worker final : public LocalStream {
 public:
  Worker(Reconstructor reconstructor, const LocalStreamOptions& options)
      : reconstructor_(std::move(reconstructor)),
        attributes_(WithPhases(options.parameters, options.attributes)),
        send_timeout_(options.send_timeout),
        arena_(static_cast<unsigned>(std::max(options.threads, 0))) {
    info_ = {.parameters = reconstructor_.parameters(),
             .frames_in_flight = std::max<std::size_t>(1, options.frames_in_flight),
             .limits = {.max_particles_per_frame = options.limits.max_particles,
                        .max_tiles_per_frame = options.limits.max_tiles}};
    thread_ = std::thread([this] { Run(); });
  }

  ~Worker() override {
    Cancel();
    thread_.join();
  }

  const StreamInfo& info() const override { return info_; }
  absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time) override {
    return Submit(frame, time);
  }
  absl::StatusOr<std::uint64_t> SendArrays(const ParticleArrays& particles, double time) override {
    const auto rows = RowsOf(particles, time);
    if (!rows.ok()) return rows.status();
    return Submit(*rows, time);
  }
  absl::Status FinishSending() override;
  absl::StatusOr<Received> Receive(Event& event,
                                   std::optional<std::chrono::milliseconds> wait) override;
  std::size_t InFlight() const override;
  void Cancel() override;

 private:
  template <typename Particles>  // Frame or wire::FrameRows.
  absl::StatusOr<std::uint64_t> Submit(const Particles& frame, double time);
  using OptionalTime = std::optional<Clock::TimePoint>;

  OptionalTime Deadline(std::optional<std::chrono::milliseconds> wait) const {
    return wait ? OptionalTime(clock_.Now() + *wait) : std::nullopt;
  }
  // Waits for a change of the guarded members, at most until `give_up` (absent: no limit). Returns
  // false, without waiting, if `give_up` has already passed.
  bool WaitUntil(OptionalTime give_up) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Run();
  void Process(const OwnedFrame& frame, Event& event);

  const Clock& clock_ = SystemClock();
  const Reconstructor reconstructor_;
  const std::vector<std::string> attributes_;
  const std::optional<std::chrono::milliseconds> send_timeout_;
  StreamInfo info_;
  Arena arena_;
  State state_;                    // Worker's thread only.
  Workspace workspace_;            // Worker's thread only.
  std::vector<Attribute> chosen_;  // Worker's thread only.

  mutable Mutex mutex_;
  CondVar changed_;
  std::deque<OwnedFrame> frames_ ABSL_GUARDED_BY(mutex_);        // Sent, not yet being computed.
  std::vector<OwnedFrame> free_frames_ ABSL_GUARDED_BY(mutex_);  // Buffers for later frames.
  std::deque<Event> events_ ABSL_GUARDED_BY(mutex_);             // Computed, not yet received.
  std::vector<Event> free_events_ ABSL_GUARDED_BY(mutex_);
  std::size_t in_flight_ ABSL_GUARDED_BY(mutex_) = 0;
  std::uint64_t next_sequence_ ABSL_GUARDED_BY(mutex_) = 1;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

bool Worker::WaitUntil(OptionalTime give_up) {
  if (!give_up) {
    changed_.Wait(mutex_);
    return true;
  }
  if (clock_.Now() >= *give_up) return false;
  clock_.WaitUntil(changed_, mutex_, *give_up);
  return true;
}

template <typename Particles>
absl::StatusOr<std::uint64_t> Worker::Submit(const Particles& frame, double time) {
  const auto give_up = Deadline(send_timeout_);
  const MutexLock lock(mutex_);
  while (!cancelled_ && !finished_ && in_flight_ >= info_.frames_in_flight) {
    if (!WaitUntil(give_up)) return SendTimeout(*send_timeout_);
  }
  if (cancelled_) return absl::CancelledError("the stream was cancelled");
  if (finished_) return absl::FailedPreconditionError("Send after FinishSending");
  OwnedFrame owned;
  if (!free_frames_.empty()) {
    owned = std::move(free_frames_.back());
    free_frames_.pop_back();
  }
  const std::uint64_t sequence = next_sequence_++;
  {
    // Unlocking is safe: only this thread sends, so no other frame takes the free slot in the
    // window.
    const MutexUnlock unlock(mutex_);
    owned.Assign(frame, time, sequence);
  }
  ++in_flight_;
  frames_.push_back(std::move(owned));
  changed_.NotifyAll();
  return sequence;
}

absl::Status Worker::FinishSending() {
  const MutexLock lock(mutex_);
  if (cancelled_) return absl::CancelledError("the stream was cancelled");
  finished_ = true;
  changed_.NotifyAll();
  return absl::OkStatus();
}

absl::StatusOr<Received> Worker::Receive(Event& event,
                                         std::optional<std::chrono::milliseconds> wait) {
  const auto give_up = Deadline(wait);
  const MutexLock lock(mutex_);
  while (!cancelled_ && events_.empty() && !(finished_ && in_flight_ == 0)) {
    if (!WaitUntil(give_up)) return Received::kNothingYet;
  }
  if (cancelled_) return absl::CancelledError("the stream was cancelled");
  if (events_.empty()) return Received::kEnd;
  std::swap(event, events_.front());
  free_events_.push_back(std::move(events_.front()));
  events_.pop_front();
  --in_flight_;
  changed_.NotifyAll();
  return Received::kEvent;
}

std::size_t Worker::InFlight() const {
  const MutexLock lock(mutex_);
  return in_flight_;
}

void Worker::Cancel() {
  const MutexLock lock(mutex_);
  cancelled_ = true;
  changed_.NotifyAll();
}

void Worker::Run() {
  const MutexLock lock(mutex_);
  while (true) {
    while (!cancelled_ && frames_.empty() && !finished_) changed_.Wait(mutex_);
    if (cancelled_ || frames_.empty()) return;
    OwnedFrame frame = std::move(frames_.front());
    frames_.pop_front();
    Event event;
    if (!free_events_.empty()) {
      event = std::move(free_events_.back());
      free_events_.pop_back();
    }
    {
      const MutexUnlock unlock(mutex_);
      Process(frame, event);
    }
    free_frames_.push_back(std::move(frame));
    events_.push_back(std::move(event));
    changed_.NotifyAll();
  }
}

void Worker::Process(const OwnedFrame& frame, Event& event) {
  event.sequence = frame.number();
  event.time = frame.time();
  StageClock clock;
  Frame wanted = frame.frame();
  absl::Status status = ChooseAttributes(frame.frame(), attributes_, chosen_);
  wanted.attributes = chosen_;
  if (status.ok()) {
    arena_.Execute([&] {
      status = reconstructor_.Reconstruct(wanted, state_, workspace_, event.frame.result,
                                          {.observer = &clock});
    });
  }
  event.frame.times = {.stages_ms = clock.stages_ms(), .total_ms = clock.TotalMs()};
  if (!status.ok()) {
    event.kind = Event::Kind::kRefusal;
    event.violation = FindViolation(status).value_or(Violation{.reason = "INTERNAL"});
    event.message = std::string(status.message());
    return;
  }
  event.kind = Event::Kind::kResult;
  event.frame.rings_digest = DigestRings(event.frame.result.rings);
  event.frame.mesh_digest = DigestMesh(event.frame.result.mesh);
  event.frame.surface_digest = DigestSurface(event.frame.result.surface);
  event.frame.section_digests = DigestSections(event.frame.result);
}

}  // namespace

absl::StatusOr<std::unique_ptr<LocalStream>> LocalStream::Open(const LocalStreamOptions& options) {
  auto reconstructor = Reconstructor::Create(options.parameters, options.limits);
  if (!reconstructor.ok()) return reconstructor.status();
  return std::make_unique<Worker>(*std::move(reconstructor), options);
}

}  // namespace partiemc::client
