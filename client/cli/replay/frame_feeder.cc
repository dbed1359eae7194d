#include "client/cli/replay/frame_feeder.h"

#include <utility>

#include "client/cli/console.h"
#include "client/cli/replay/refusal_text.h"
#include "client/output/text.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

double TimeOf(const RecordedFrame& recorded) {
  return recorded.time.value_or(recorded.step.value_or(static_cast<double>(recorded.index)));
}

// The recorded box along the periodic axes of the stream, if it differs from the box of the stream.
std::optional<PeriodicBox> BoxOf(const RecordedFrame& recorded,
                                 const std::optional<PeriodicBox>& of_stream) {
  if (!of_stream || !recorded.box) return std::nullopt;
  PeriodicBox box = *of_stream;
  for (std::size_t k = 0; k < box.axes.size(); ++k) {
    if (box.axes[k]) box.axes[k] = PeriodicAxis{recorded.box->low[k], recorded.box->length[k]};
  }
  return box == *of_stream ? std::nullopt : std::optional(box);
}

}  // namespace

absl::Status CheckBox(const RecordedFrame& frame, const std::optional<PeriodicBox>& of_stream) {
  const auto refuse = [&](std::string_view fault) {
    return absl::FailedPreconditionError(Concat(frame.source, ": ", fault));
  };
  if (!frame.box) return refuse("has no box for --periodic; give --box");
  if (frame.box->is_tilted) {
    return refuse("its box is triclinic; --periodic requires an orthogonal box");
  }
  for (std::size_t k = 0; of_stream && k < of_stream->axes.size(); ++k) {
    if (of_stream->axes[k] && !frame.box->is_periodic[k]) {
      return refuse("its box is periodic along other axes than that of the first frame");
    }
  }
  return absl::OkStatus();
}

FrameFeeder::FrameFeeder(Sequence& input, FrameStream& stream,
                         std::optional<double> frames_per_second, SendPolicy policy,
                         std::vector<std::string> attributes, std::optional<PeriodicBox> box)
    : input_(input),
      stream_(stream),
      frames_per_second_(frames_per_second),
      policy_(policy),
      attribute_names_(std::move(attributes)),
      box_(box) {
  reader_ = std::thread([this] { Read(); });
  sender_ = std::thread([this] { SendAll(); });
}

FrameFeeder::~FrameFeeder() {
  if (!reader_.joinable()) return;
  Stop();
  Join().IgnoreError();
}

std::unique_ptr<RecordedFrame> FrameFeeder::TakeAnswered() {
  const MutexLock lock(mutex_);
  FramePointer frame = std::move(unanswered_.front());
  unanswered_.pop_front();
  return frame;
}

void FrameFeeder::Recycle(FramePointer frame) {
  const MutexLock lock(mutex_);
  free_.push_back(std::move(frame));
}

std::vector<FrameFeeder::Refused> FrameFeeder::TakeRefused() {
  const MutexLock lock(mutex_);
  return std::exchange(refused_, {});
}

std::uint64_t FrameFeeder::skipped_count() const {
  const MutexLock lock(mutex_);
  return skipped_;
}

void FrameFeeder::Stop() {
  {
    const MutexLock lock(mutex_);
    stop_ = true;
  }
  stopped_.NotifyAll();
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
      const MutexLock lock(mutex_);
      if (stop_) break;
      if (!free_.empty()) {
        frame = std::move(free_.back());
        free_.pop_back();
      }
    }
    if (frame == nullptr) frame = std::make_unique<RecordedFrame>();
    const auto more = input_.Next(*frame);
    input_status_ = more.status();
    if (more.ok() && *more && box_) input_status_ = CheckBox(*frame, box_);
    if (!input_status_.ok() || !*more || !read_ahead_.Push(std::move(frame))) break;
  }
  read_ahead_.Close();
}

void FrameFeeder::SendAll() {
  std::optional<LatestSender> latest;
  if (policy_ == SendPolicy::kLatest) latest.emplace(stream_, Hooks());
  std::size_t sent = 0;
  while (auto frame = read_ahead_.Pop()) {
    if (!Pace(sent++) ||
        !(latest ? Offer(*latest, *std::move(frame)) : SendOne(*std::move(frame)))) {
      read_ahead_.Close();
      return;
    }
  }
  // If this fails, the stream has ended with an error, and Receive reports it.
  (latest ? latest->Finish() : stream_.FinishSending()).IgnoreError();
}

bool FrameFeeder::Pace(std::size_t sent) {
  const MutexLock lock(mutex_);
  if (!frames_per_second_) return !stop_;
  const auto due =
      start_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                   std::chrono::duration<double>(static_cast<double>(sent) / *frames_per_second_));
  while (!stop_ && stopped_.WaitUntil(mutex_, due)) {
  }
  return !stop_;
}

Frame FrameFeeder::View(const RecordedFrame& recorded) {
  Frame frame{.positions = std::span<const double>(recorded.positions),
              .components = recorded.components,
              .volumes = recorded.volumes,
              .ids = recorded.ids,
              .box = BoxOf(recorded, box_)};
  // Velocities are sent only with times. Without times the interval between two frames is unknown.
  if (recorded.time) frame.velocities = recorded.velocities;
  ViewAttributes(recorded);
  frame.attributes = attributes_;
  if (recorded.float32) {  // Half of the bytes, without loss.
    as_float32_.assign(recorded.positions.size(), 0);
    for (std::size_t k = 0; k < as_float32_.size(); ++k) {
      as_float32_[k] = static_cast<float>(recorded.positions[k]);
    }
    frame.positions = std::span<const float>(as_float32_);
  }
  return frame;
}

// Sets `attributes_` to views of the requested attributes that the frame has. The stream refuses a
// frame that lacks one.
void FrameFeeder::ViewAttributes(const RecordedFrame& recorded) {
  attributes_.clear();
  for (const std::string& name : attribute_names_) {
    for (const ParticleAttribute& one : recorded.attributes) {
      if (one.name != name) continue;
      attributes_.push_back({one.name, one.components, one.values});
      break;  // A recording may hold a name twice.
    }
    // The core takes this attribute from Frame::velocities, which View leaves out without times.
    if (name == kVelocityAttribute && !recorded.time && !recorded.velocities.empty()) {
      attributes_.push_back({kVelocityAttribute, recorded.components, recorded.velocities});
    }
  }
}

bool FrameFeeder::SendOne(FramePointer owned) {
  const RecordedFrame& recorded = *owned;
  const Frame frame = View(recorded);
  {
    // The frame is queued before Send, because its response may arrive before Send returns.
    const MutexLock lock(mutex_);
    unanswered_.push_back(std::move(owned));
  }
  const auto sequence = stream_.Send(frame, TimeOf(recorded));
  if (sequence.ok()) return true;
  if (!FindViolation(sequence.status())) return false;
  RefuseLast(sequence.status());
  return true;
}

bool FrameFeeder::Offer(LatestSender& sender, FramePointer owned) {
  const RecordedFrame& recorded = *owned;
  const Frame frame = View(recorded);
  const double time = TimeOf(recorded);
  {
    const MutexLock lock(mutex_);
    offered_.push_back(std::move(owned));
  }
  return sender.Offer(frame, time).ok();
}

// LatestSender sends or skips frames in the order of Offer, so the first two hooks concern the
// front of `offered_`.
OfferHooks FrameFeeder::Hooks() {
  return {.sending =
              [this](std::uint64_t) {
                const MutexLock lock(mutex_);
                unanswered_.push_back(std::move(offered_.front()));
                offered_.pop_front();
              },
          .skipped =
              [this](std::uint64_t) {
                const MutexLock lock(mutex_);
                ++skipped_;
                free_.push_back(std::move(offered_.front()));
                offered_.pop_front();
              },
          .refused = [this](std::uint64_t, const absl::Status& status) { RefuseLast(status); }};
}

void FrameFeeder::RefuseLast(const absl::Status& status) {
  const MutexLock lock(mutex_);
  const RecordedFrame& frame = *unanswered_.back();
  refused_.push_back({frame.source, RefusalText(frame, attribute_names_, OneLine(status))});
  free_.push_back(std::move(unanswered_.back()));
  unanswered_.pop_back();
}

}  // namespace partiemc::client
