#include "client/library/watch_call.h"

#include <algorithm>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "client/library/channel.h"
#include "client/library/retry_policy.h"
#include "wire/bytes.h"
#include "wire/surface_level.h"

namespace partiemc::client {
namespace {

// Messages that need no credit: WatchOpened and WatchEnded.
constexpr std::size_t kMessagesWithoutCredit = 2;

v1::WatchMode ToWire(WatchMode mode) {
  return mode == WatchMode::kEvery ? v1::WATCH_MODE_EVERY : v1::WATCH_MODE_LATEST;
}

// Sets `values` to the components `axes` of each vector; a vector has `components` components.
template <typename From, typename To>
void Project(std::span<const From> vectors, std::size_t components,
             std::span<const std::size_t> axes, std::vector<To>& values) {
  const std::size_t count = vectors.size() / components;
  values.resize(axes.size() * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < axes.size(); ++k) {
      values[axes.size() * i + k] = static_cast<To>(vectors[i * components + axes[k]]);
    }
  }
}

// Indices of the coordinates that a watcher receives, of particles with `components` coordinates.
std::vector<std::size_t> AxesOf(const ReconstructionParameters& parameters,
                                std::size_t components) {
  if (components == 2) return {0, 1};
  if (parameters.output == Output::kSurface) return {0, 1, 2};
  switch (parameters.plane) {
    case Plane::kXy:
      return {0, 1};
    case Plane::kXz:
      return {0, 2};
    case Plane::kYz:
      return {1, 2};
  }
  return {0, 1};
}

// Whether a stream that ended with this reason may go on, here or elsewhere.
bool MayReturn(const std::string& reason) {
  return reason == "TAKEN_OVER" || reason == "PRODUCER_LOST";
}

void TakeParticles(const Frame& echoed, const ReconstructionParameters& parameters,
                   WatchedFrame& frame) {
  const auto components = static_cast<std::size_t>(echoed.components);
  const std::vector<std::size_t> axes = AxesOf(parameters, components);
  std::visit([&](auto positions) { Project(positions, components, axes, frame.particles); },
             echoed.positions);
  Project(echoed.velocities, components, axes, frame.particle_velocities);
  frame.particle_ids.assign(echoed.ids.begin(), echoed.ids.end());
  frame.particle_volumes.assign(echoed.volumes.begin(), echoed.volumes.end());
  const std::optional<PeriodicBox>& box = echoed.box ? echoed.box : parameters.box;
  if (!box) return;
  frame.particle_box.emplace().wraps = parameters.box && parameters.box->wraps;
  for (std::size_t k = 0; k < axes.size(); ++k) frame.particle_box->axes[k] = box->axes[axes[k]];
}

// Copies the attributes of particles that have values; of several with the same name the first.
// Returns false if the number of values does not fit the number of particles.
bool TakeScalars(const v1::ReconstructedFrame& result, std::size_t particles, WatchedFrame& frame) {
  std::set<std::string_view> names;
  for (const v1::NamedScalar& from : result.particle_scalars()) {
    if (from.values().empty() || !names.insert(from.name()).second) continue;
    const std::uint32_t components = std::max(from.components(), 1u);
    if (components > 3 || from.values().size() != components * sizeof(float) * particles) {
      return false;
    }
    AttributeValues& to = frame.particle_attributes.emplace_back();
    to.name = from.name();
    to.components = static_cast<int>(components);
    wire::CopyBytes(from.values(), to.values);
  }
  return true;
}

}  // namespace

WatchCall::~WatchCall() {
  context_.TryCancel();
  if (thread_.joinable()) thread_.join();
}

void WatchCall::Start(std::string_view stream_name, const WatcherOptions& options,
                      std::optional<std::uint64_t> from_sequence, const std::string& lineage) {
  v1::WatchStreamRequest open;
  open.mutable_open()->set_stream_name(std::string(stream_name));
  open.mutable_open()->set_mode(ToWire(options.mode));
  open.mutable_open()->set_credits(std::max<std::uint32_t>(options.credits, 1));
  open.mutable_open()->set_lineage(lineage);
  if (from_sequence) open.mutable_open()->set_from_sequence(*from_sequence);
  if (options.level_of_detail) {
    wire::EncodeLevelOfDetail(*options.level_of_detail,
                              *open.mutable_open()->mutable_level_of_detail());
  }
  thread_ = std::thread([this, open = std::move(open)]() mutable { Run(std::move(open)); });
}

void WatchCall::Run(v1::WatchStreamRequest open) {
  rpc_ = stub_->WatchStream(&context_);
  rpc_->Write(open);  // If it fails, the end of the call reports the reason.
  const std::size_t most_ready = std::size_t{open.open().credits()} + kMessagesWithoutCredit;
  bool exceeded = false;
  while (!exceeded) {
    Message message;
    {
      const MutexLock lock(mutex_);
      if (!spare_.empty()) {
        message = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (message == nullptr) message = std::make_unique<v1::WatchStreamResponse>();
    if (!rpc_->Read(message.get())) break;
    const MutexLock lock(mutex_);
    exceeded = ready_.size() >= most_ready;  // A frame returns its credit when it leaves `ready_`.
    if (exceeded) {
      context_.TryCancel();
    } else {
      ready_.push_back(std::move(message));
      changed_.NotifyAll();
    }
  }
  const grpc::Status status = rpc_->Finish();
  const MutexLock lock(mutex_);
  exceeded_credit_ = exceeded;
  status_ =
      exceeded ? grpc::Status(grpc::StatusCode::DATA_LOSS, "sent frames without credit") : status;
  reason_ = ReasonOf(context_);
  changed_.NotifyAll();
}

absl::StatusOr<bool> WatchCall::WaitUntilOpened(TimePoint until) {
  const MutexLock lock(mutex_);
  while (!HasNews() && clock_.WaitUntil(changed_, mutex_, until)) {
  }
  if (cancelled_) return absl::CancelledError("the watch was cancelled");
  if (ready_.empty() && !status_) return false;
  if (ready_.empty()) {
    if (exceeded_credit_) return ExceededCredit();
    if (status_->ok()) return Broken("ended the watch at once");
    return FromGrpc(*status_, address_);
  }
  const Message message = std::move(ready_.front());
  ready_.pop_front();
  if (!message->has_opened()) return Broken("did not begin with WatchOpened");
  const v1::WatchOpened& opened = message->opened();
  const auto parameters = wire::DecodeParameters(opened.parameters());
  if (!parameters.ok()) return parameters.status();
  stream_ = {.stream_id = opened.stream_id(),
             .parameters = *parameters,
             .labels = {opened.labels().begin(), opened.labels().end()}};
  if (opened.has_frames()) stream_.held = {opened.oldest_sequence(), opened.newest_sequence()};
  lineage_ = opened.lineage();
  return true;
}

absl::StatusOr<Received> WatchCall::Receive(WatchedFrame& frame,
                                            std::optional<std::chrono::milliseconds> wait) {
  std::optional<TimePoint> until;
  if (wait) until = clock_.Now() + *wait;
  absl::StatusOr<Received> received = Received::kNothingYet;
  Message message = TakeNext(until, received);
  while (message != nullptr && message->has_ended()) {
    end_ = {message->ended().reason(), message->ended().message(), message->ended().dropped()};
    message = TakeNext(until, received);  // The status of the call follows.
  }
  if (message == nullptr) return received;
  const absl::Status status = Decode(*message, frame);
  if (!status.ok()) {
    context_.TryCancel();
    return status;
  }
  {
    const MutexLock lock(mutex_);
    spare_.push_back(std::move(message));
  }
  v1::WatchStreamRequest credit;
  credit.mutable_credit()->set_frames(1);
  rpc_->Write(credit);  // If it fails, the end of the call reports the reason.
  return Received::kEvent;
}

WatchCall::Message WatchCall::TakeNext(std::optional<TimePoint> until,
                                       absl::StatusOr<Received>& received) {
  const MutexLock lock(mutex_);
  while (!HasNews()) {
    if (!until) {
      changed_.Wait(mutex_);
    } else if (!clock_.WaitUntil(changed_, mutex_, *until) && !HasNews()) {
      received = Received::kNothingYet;
      return nullptr;
    }
  }
  if (cancelled_) {
    received = absl::CancelledError("the watch was cancelled");
  } else if (!ready_.empty()) {
    Message message = std::move(ready_.front());
    ready_.pop_front();
    return message;
  } else if (exceeded_credit_) {
    received = ExceededCredit();
  } else if (HasEnd()) {
    received = Received::kEnd;
  } else if (!status_->ok()) {
    received = FromGrpc(*status_, address_);
  } else {
    received = absl::UnavailableError(
        absl::StrCat("the server at ", address_, " ended the watch without a reason"));
  }
  return nullptr;
}

bool WatchCall::HasEnd() const {
  if (status_->ok()) return !end_.reason.empty();
  return !end_.reason.empty() && !MayReturn(end_.reason) && end_.reason != "DRAINING" &&
         IsLostConnection(status_->error_code(), reason_);
}

absl::Status WatchCall::Decode(v1::WatchStreamResponse& message, WatchedFrame& frame) {
  if (!message.has_frame()) return Broken("sent a message that this client does not support");
  v1::ReconstructedFrame& result = *message.mutable_frame()->mutable_frame();
  std::swap(decoded_.result, frame.frame.result);  // The caller's buffers are used again.
  const absl::Status status = wire::DecodeResult(result, decoded_);
  std::swap(decoded_.result, frame.frame.result);
  if (!status.ok()) return status;
  frame.sequence = decoded_.sequence;
  frame.time = decoded_.time;
  frame.frame.times = {.stages_ms = decoded_.times.stages_ms, .total_ms = decoded_.times.total_ms};
  frame.frame.rings_digest = decoded_.rings_digest;
  frame.frame.mesh_digest = decoded_.mesh_digest;
  frame.frame.surface_digest = decoded_.surface_digest;
  frame.level = wire::LevelOf(result);
  std::swap(frame.frame.section_digests, decoded_.section_digests);
  frame.dropped = message.frame().dropped();
  frame.oldest_sequence = message.frame().oldest_sequence();
  frame.particles.clear();
  frame.particle_ids.clear();
  frame.particle_volumes.clear();
  frame.particle_velocities.clear();
  frame.particle_attributes.clear();
  frame.particle_box.reset();
  if (result.particles().empty()) return absl::OkStatus();
  particles_.set_position_format(result.particle_format());
  particles_.mutable_positions()->swap(*result.mutable_particles());
  particles_.mutable_ids()->swap(*result.mutable_particle_ids());
  particles_.mutable_volumes()->swap(*result.mutable_particle_volumes());
  particles_.mutable_velocities()->swap(*result.mutable_particle_velocities());
  particles_.clear_box();
  if (result.has_particle_box()) particles_.mutable_box()->Swap(result.mutable_particle_box());
  const auto particles = wire::DecodeFrame(particles_);
  if (!particles.ok() || !TakeScalars(result, particles->ParticleCount(), frame)) {
    return Broken("sent particles that cannot be read");
  }
  TakeParticles(*particles, stream_.parameters, frame);
  return absl::OkStatus();
}

void WatchCall::Cancel() {
  context_.TryCancel();
  const MutexLock lock(mutex_);
  cancelled_ = true;
  changed_.NotifyAll();
}

std::string WatchCall::reason() {
  const MutexLock lock(mutex_);
  return reason_;
}

bool WatchCall::lost() {
  const MutexLock lock(mutex_);
  if (!status_ || cancelled_) return false;
  if (!status_->ok() && !HasEnd()) {
    // TOO_MANY_OPENING counts as a loss, because it is temporary: the server was short of memory.
    return IsLostConnection(status_->error_code(), reason_) || reason_ == "TOO_MANY_OPENING";
  }
  return end_.reason.empty() || MayReturn(end_.reason);
}

std::string WatchCall::why() {
  const MutexLock lock(mutex_);
  if (status_ && !status_->ok()) return Reason(*status_);
  return end_.message.empty() ? "ended without a reason" : end_.message;
}

absl::Status WatchCall::ExceededCredit() const { return Broken("sent frames without credit"); }

absl::Status WatchCall::Broken(const char* what) const {
  return absl::DataLossError(
      absl::StrCat("the server at ", address_, " ", what, ": it breaks the protocol"));
}

}  // namespace partiemc::client
