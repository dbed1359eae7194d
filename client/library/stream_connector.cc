#include "client/library/stream_connector.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/channel.h"
#include "client/library/phase_attribute.h"
#include "common/address.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

// For a new stream: time limit to connect to one of several addresses; pause between attempts.
constexpr std::chrono::milliseconds kShortConnect(250);
constexpr std::chrono::milliseconds kRest(20);

wire::Coordinates ToWire(Coordinates coordinates) {
  switch (coordinates) {
    case Coordinates::kFloat64:
      return wire::Coordinates::kFloat64;
    case Coordinates::kRelativeFloat32:
      return wire::Coordinates::kRelativeFloat32;
    case Coordinates::kCompact:
      return wire::Coordinates::kCompact;
  }
  return wire::Coordinates::kFloat64;
}

v1::OpenStream OpenMessage(const StreamOptions& options) {
  v1::OpenStream open;
  open.set_stream_name(options.name);
  wire::EncodeParameters(options.parameters, *open.mutable_parameters());
  wire::EncodeOutputs(
      {.mesh = options.outputs.mesh,
       .normals = options.outputs.normals || options.parameters.output == Output::kSurface,
       .coordinates = ToWire(options.outputs.coordinates),
       .echo_particles = options.outputs.echo_particles,
       .attributes = WithPhases(options.parameters, options.outputs.attributes)},
      *open.mutable_outputs());
  open.mutable_labels()->insert(options.labels.begin(), options.labels.end());
  if (options.reconnect.give_up_after.count() > 0) {
    open.set_checkpoint_interval(options.checkpoint_interval);
  }
  open.set_parts(options.parts.parts);
  open.set_part(options.parts.part);
  open.set_parts_token(options.parts.token);
  if (options.parts.parts > 0) {
    open.set_part_timeout_ms(static_cast<std::uint32_t>(options.parts.timeout.count()));
  }
  return open;
}

absl::Status NotOpened(const std::string& address) {
  return absl::DataLossError(absl::StrCat(
      "the server at ", address, " did not begin with StreamOpened: it breaks the protocol"));
}

}  // namespace

// Attempts to open the stream. Releases the monitor's lock while it waits.
class StreamConnector::Calls final : public Attempts {
 public:
  explicit Calls(StreamConnector& connector) : connector_(connector) {}

  // For Clang's thread-safety analysis: this thread holds the connector's mutex. Does nothing.
  void AssertLocked() const ABSL_ASSERT_EXCLUSIVE_LOCK(connector_.monitor_.mutex) {}

  bool Cancelled() override ABSL_EXCLUSIVE_LOCKS_REQUIRED(connector_.monitor_.mutex) {
    return connector_.cancelled_;
  }

  absl::Status Start(const std::string& address) override
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(connector_.monitor_.mutex) {
    absl::StatusOr<std::shared_ptr<grpc::Channel>> channel;
    {
      const MutexUnlock unlock(connector_.monitor_.mutex);
      channel = MakeChannel(address, connector_.options_.credentials);
    }
    if (!channel.ok()) return channel.status();
    connector_.Start(*std::move(channel));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Check(bool& retryable) override
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(connector_.monitor_.mutex) {
    StreamCall& call = *connector_.attempt_;
    call.AssertLocked();
    retryable = false;
    if (const auto response = call.Take()) {
      if (!response->has_opened()) return NotOpened(call.address());
      message_ = response->opened();
      return true;
    }
    if (!call.done()) return false;
    Loss loss = LossOf(call, connector_.Purpose());
    retryable = loss.retryable;
    return std::move(loss.status);
  }

  void Drop() override ABSL_EXCLUSIVE_LOCKS_REQUIRED(connector_.monitor_.mutex) {
    connector_.Drop(std::move(connector_.attempt_));
  }

  void Wait(TimePoint until) override ABSL_EXCLUSIVE_LOCKS_REQUIRED(connector_.monitor_.mutex) {
    connector_.monitor_.WaitUntil(until);
  }

  // Requires: a call is open.
  Opened TakeOpened() ABSL_EXCLUSIVE_LOCKS_REQUIRED(connector_.monitor_.mutex) {
    return {std::move(connector_.attempt_), std::move(message_)};
  }

 private:
  StreamConnector& connector_;
  v1::StreamOpened message_;
};

StreamConnector::StreamConnector(Monitor& monitor, std::vector<std::string> addresses,
                                 const StreamOptions& options)
    : monitor_(monitor),
      options_(options),
      retry_(std::move(addresses), "stream", options.reconnect, options.connect_timeout,
             monitor.surroundings) {}

absl::StatusOr<StreamConnector::Opened> StreamConnector::OpenNew() {
  // The other parts may open before part 0, so they wait for it, up to `deadline`.
  const auto give_up_at =
      monitor_.Now() + (options_.parts.part > 0 ? options_.deadline : options_.connect_timeout);
  for (;; retry_.UseNextAddress()) {
    bool retryable = true;
    auto opened = OpenNewAt(give_up_at, retryable);
    if (opened.ok() || !retryable || monitor_.Now() >= give_up_at) return opened;
    const auto next = monitor_.Now() + kRest;
    while (monitor_.WaitUntil(next)) {
    }
  }
}

absl::StatusOr<StreamConnector::Opened> StreamConnector::OpenNewAt(TimePoint give_up_at,
                                                                   bool& retryable) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(give_up_at - monitor_.Now());
  absl::StatusOr<std::shared_ptr<grpc::Channel>> channel;
  absl::Status reached;
  {
    const MutexUnlock unlock(monitor_.mutex);
    channel = MakeChannel(address(), options_.credentials);
    reached = channel.status();
    if (channel.ok()) {
      reached = Connect(*channel, address(),
                        retry_.addresses().size() == 1 ? left : std::min(left, kShortConnect));
    }
  }
  if (!reached.ok()) return reached;
  Start(*std::move(channel));
  AssertAttemptLocked();
  const auto due = monitor_.Now() + options_.deadline;
  while (attempt_->ready() == 0 && !attempt_->done() && monitor_.WaitUntil(due)) {
  }
  Calls calls(*this);
  calls.AssertLocked();
  const auto opened = calls.Check(retryable);
  if (opened.ok() && *opened) return calls.TakeOpened();
  calls.Drop();
  if (!opened.ok()) return opened.status();
  return NotAccepted(address(), "stream", options_.deadline);
}

void StreamConnector::Learn(const v1::StreamNotice& notice) {
  std::vector<std::string> usable;
  for (const std::string& address : notice.addresses()) {
    // A Unix socket on the server's machine cannot be reached from this machine.
    const auto parsed = ParseAddress(address);
    const bool is_path = parsed.ok() && !parsed->unix_path.empty();
    if (!is_path && CheckAddress(address, options_.credentials).ok()) usable.push_back(address);
  }
  retry_.Learn(usable);
}

void StreamConnector::Lost(const Loss& loss, v1::ResumeStream resume) {
  resume_ = std::move(resume);
  resuming_ = true;
  retry_.Lose(absl::StrCat("lost ", address(), " (", loss.why, ")"));
  retry_.TryNext(loss.status);
}

absl::StatusOr<std::optional<StreamConnector::Opened>> StreamConnector::OpenAgain(
    std::optional<TimePoint> until) {
  Calls calls(*this);
  calls.AssertLocked();
  const auto outcome = retry_.Run(calls, until);
  if (!outcome.ok()) return outcome.status();
  switch (*outcome) {
    case RetryLoop::Outcome::kOpened:
      return calls.TakeOpened();
    case RetryLoop::Outcome::kNotYet:
      return std::nullopt;
    case RetryLoop::Outcome::kCancelled:
      return absl::CancelledError("the stream was cancelled");
    case RetryLoop::Outcome::kGaveUp:
      break;
  }
  return absl::UnavailableError(absl::StrCat("the stream could not continue within ",
                                             Seconds(options_.reconnect.give_up_after), ": ",
                                             retry_.RefusalText()));
}

CallPurpose StreamConnector::Purpose() const {
  if (options_.parts.part > 0) return CallPurpose::kJoin;
  return resuming_ ? CallPurpose::kResume : CallPurpose::kOpen;
}

void StreamConnector::Start(std::shared_ptr<grpc::Channel> channel) {
  v1::OpenStream open = OpenMessage(options_);
  if (Purpose() == CallPurpose::kResume) *open.mutable_resume() = resume_;
  std::unique_ptr<StreamCall> call;
  {
    const MutexUnlock unlock(monitor_.mutex);
    call = std::make_unique<StreamCall>(monitor_, std::move(channel), address());
    call->Start(open);
  }
  attempt_ = std::move(call);
}

// Ends `call`. Unlocks the mutex, because gRPC's threads need it to end a call.
void StreamConnector::Drop(std::unique_ptr<StreamCall> call) {
  const MutexUnlock unlock(monitor_.mutex);
  call.reset();
}

void StreamConnector::Cancel() {
  cancelled_ = true;
  AssertAttemptLocked();
  if (attempt_ != nullptr) attempt_->Cancel();
}

}  // namespace partiemc::client
