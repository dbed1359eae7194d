#include "partiemc/client/local_stream.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/state.h"

namespace partiemc::client {
namespace {

using Clock = std::chrono::steady_clock;

double Milliseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

class StageClock final : public StageObserver {
 public:
  explicit StageClock(FrameTimes& times) : times_(times) { times_ = {}; }
  void StageBegins(Stage) override { begin_ = Clock::now(); }
  void StageEnds(Stage stage) override {
    times_.stages_ms[static_cast<std::size_t>(stage)] += Milliseconds(Clock::now() - begin_);
  }

 private:
  FrameTimes& times_;
  Clock::time_point begin_;
};

// A frame that owns its arrays, reused from frame to frame.
struct OwnedFrame {
  std::uint64_t sequence = 0;
  double time = 0;
  std::variant<std::vector<float>, std::vector<double>> positions;
  int components = 2;
  std::vector<float> volumes;
  std::vector<std::uint64_t> ids;
  std::vector<float> velocities;

  void Assign(const Frame& frame) {
    std::visit(
        [this](auto view) {
          using Vector = std::vector<typename decltype(view)::value_type>;
          auto* kept = std::get_if<Vector>(&positions);
          if (kept == nullptr) kept = &positions.template emplace<Vector>();
          kept->assign(view.begin(), view.end());
        },
        frame.positions);
    components = frame.components;
    volumes.assign(frame.volumes.begin(), frame.volumes.end());
    ids.assign(frame.ids.begin(), frame.ids.end());
    velocities.assign(frame.velocities.begin(), frame.velocities.end());
  }

  Frame View() const {
    Frame frame{.components = components,
                .volumes = volumes,
                .ids = ids,
                .velocities = velocities,
                .time = time};
    std::visit([&frame](const auto& vector) { frame.positions = std::span(vector); }, positions);
    return frame;
  }
};

}  // namespace

class LocalStream::Worker {
 public:
  Worker(Reconstructor reconstructor, const LocalStreamOptions& options)
      : reconstructor_(std::move(reconstructor)),
        arena_(static_cast<unsigned>(std::max(options.threads, 0))) {
    info_ = {.parameters = reconstructor_.parameters(),
             .frames_in_flight = std::max<std::size_t>(1, options.frames_in_flight),
             .limits = {.max_particles_per_frame = options.limits.max_particles,
                        .max_tiles_per_frame = options.limits.max_tiles}};
    thread_ = std::thread([this] { Run(); });
  }

  ~Worker() {
    Cancel();
    thread_.join();
  }

  const StreamInfo& info() const { return info_; }
  absl::StatusOr<std::uint64_t> Send(const Frame& frame, double time);
  absl::Status FinishSending();
  absl::StatusOr<Received> Receive(Event& event, std::optional<std::chrono::milliseconds> wait);
  std::size_t InFlight() const;
  void Cancel();

 private:
  void Run();
  void Process(const OwnedFrame& frame, Event& event);

  const Reconstructor reconstructor_;
  StreamInfo info_;
  Arena arena_;
  State state_;          // Of the worker's thread alone.
  Workspace workspace_;  // Likewise.

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<OwnedFrame> frames_;        // Sent, not yet in work.
  std::vector<OwnedFrame> free_frames_;  // Their buffers wait for the next ones.
  std::deque<Event> events_;             // Answered, not yet received.
  std::vector<Event> free_events_;
  std::size_t in_flight_ = 0;
  std::uint64_t next_sequence_ = 1;
  bool finished_ = false, cancelled_ = false;
  std::thread thread_;
};

absl::StatusOr<std::uint64_t> LocalStream::Worker::Send(const Frame& frame, double time) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock,
                [this] { return cancelled_ || finished_ || in_flight_ < info_.frames_in_flight; });
  if (cancelled_) return absl::CancelledError("the stream was cancelled");
  if (finished_) return absl::FailedPreconditionError("Send after FinishSending");
  OwnedFrame owned;
  if (!free_frames_.empty()) {
    owned = std::move(free_frames_.back());
    free_frames_.pop_back();
  }
  lock.unlock();  // There is one sender: nobody else takes the place in the window meanwhile.
  owned.Assign(frame);
  owned.time = time;
  lock.lock();
  owned.sequence = next_sequence_++;
  ++in_flight_;
  const std::uint64_t sequence = owned.sequence;
  frames_.push_back(std::move(owned));
  changed_.notify_all();
  return sequence;
}

absl::Status LocalStream::Worker::FinishSending() {
  const std::scoped_lock lock(mutex_);
  if (cancelled_) return absl::CancelledError("the stream was cancelled");
  finished_ = true;
  changed_.notify_all();
  return absl::OkStatus();
}

absl::StatusOr<Received> LocalStream::Worker::Receive(
    Event& event, std::optional<std::chrono::milliseconds> wait) {
  std::unique_lock lock(mutex_);
  const auto ready = [this] {
    return cancelled_ || !events_.empty() || (finished_ && in_flight_ == 0);
  };
  if (!wait) {
    changed_.wait(lock, ready);
  } else if (!changed_.wait_for(lock, *wait, ready)) {
    return Received::kNothingYet;
  }
  if (cancelled_) return absl::CancelledError("the stream was cancelled");
  if (events_.empty()) return Received::kEnd;
  std::swap(event, events_.front());
  free_events_.push_back(std::move(events_.front()));
  events_.pop_front();
  --in_flight_;
  changed_.notify_all();
  return Received::kEvent;
}

std::size_t LocalStream::Worker::InFlight() const {
  const std::scoped_lock lock(mutex_);
  return in_flight_;
}

void LocalStream::Worker::Cancel() {
  const std::scoped_lock lock(mutex_);
  cancelled_ = true;
  changed_.notify_all();
}

void LocalStream::Worker::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return cancelled_ || !frames_.empty() || finished_; });
    if (cancelled_ || frames_.empty()) return;
    OwnedFrame frame = std::move(frames_.front());
    frames_.pop_front();
    Event event;
    if (!free_events_.empty()) {
      event = std::move(free_events_.back());
      free_events_.pop_back();
    }
    lock.unlock();
    Process(frame, event);
    lock.lock();
    free_frames_.push_back(std::move(frame));
    events_.push_back(std::move(event));
    changed_.notify_all();
  }
}

void LocalStream::Worker::Process(const OwnedFrame& frame, Event& event) {
  event.sequence = frame.sequence;
  event.time = frame.time;
  StageClock stages(event.frame.times);
  const Clock::time_point begin = Clock::now();
  absl::Status status;
  arena_.Execute([&] {
    status = reconstructor_.Reconstruct(frame.View(), state_, workspace_, event.frame.result,
                                        {.observer = &stages});
  });
  event.frame.times.total_ms = Milliseconds(Clock::now() - begin);
  if (!status.ok()) {
    event.kind = Event::Kind::kRefusal;
    event.violation = FindViolation(status).value_or(Violation{.reason = "INTERNAL"});
    event.message = std::string(status.message());
    return;
  }
  event.kind = Event::Kind::kResult;
  event.frame.rings_digest = DigestRings(event.frame.result.rings);
  event.frame.mesh_digest = DigestMesh(event.frame.result.mesh);
}

absl::StatusOr<std::unique_ptr<LocalStream>> LocalStream::Open(const LocalStreamOptions& options) {
  auto reconstructor = Reconstructor::Create(options.parameters, options.limits);
  if (!reconstructor.ok()) return reconstructor.status();
  return std::unique_ptr<LocalStream>(
      new LocalStream(std::make_unique<Worker>(*std::move(reconstructor), options)));
}

LocalStream::LocalStream(std::unique_ptr<Worker> worker) : worker_(std::move(worker)) {}
LocalStream::~LocalStream() = default;

const StreamInfo& LocalStream::info() const { return worker_->info(); }
absl::StatusOr<std::uint64_t> LocalStream::Send(const Frame& frame, double time) {
  return worker_->Send(frame, time);
}
absl::Status LocalStream::FinishSending() { return worker_->FinishSending(); }
absl::StatusOr<Received> LocalStream::Receive(Event& event,
                                              std::optional<std::chrono::milliseconds> wait) {
  return worker_->Receive(event, wait);
}
std::size_t LocalStream::InFlight() const { return worker_->InFlight(); }
void LocalStream::Cancel() { worker_->Cancel(); }

}  // namespace partiemc::client
