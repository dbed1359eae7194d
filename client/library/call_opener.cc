#include "library/call_opener.h"

#include <algorithm>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "library/channel.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

// How long one of several addresses may take to be reached before the next is tried, and how long
// to rest between two rounds, when a stream is opened.
constexpr std::chrono::milliseconds kShortConnect(250);
constexpr std::chrono::milliseconds kRest(20);

v1::OpenStream OpenMessage(const StreamOptions& options) {
  v1::OpenStream open;
  open.set_stream_name(options.name);
  wire::EncodeParameters(options.parameters, *open.mutable_parameters());
  wire::EncodeOutputs({.mesh = options.outputs.mesh,
                       .normals = options.outputs.normals,
                       .relative_float32 = options.outputs.relative_float32,
                       .echo_particles = options.outputs.echo_particles},
                      *open.mutable_outputs());
  open.mutable_labels()->insert(options.labels.begin(), options.labels.end());
  if (options.reconnect.give_up_after.count() > 0) {
    open.set_checkpoint_interval(options.checkpoint_interval);
  }
  return open;
}

absl::Status NotOpened(const std::string& address) {
  return absl::DataLossError(absl::StrCat(
      "the server at ", address, " did not begin with StreamOpened: it breaks the protocol"));
}

}  // namespace

CallOpener::CallOpener(Monitor& monitor, std::vector<std::string> addresses,
                       const StreamOptions& options)
    : monitor_(monitor), addresses_(std::move(addresses)), options_(options) {}

absl::StatusOr<CallOpener::Opened> CallOpener::OpenNew(Lock& lock) {
  const auto give_up_at = Clock::now() + options_.connect_timeout;
  for (;; address_ = (address_ + 1) % addresses_.size()) {
    bool mendable = true;
    auto opened = OpenNewAt(lock, give_up_at, mendable);
    if (opened.ok() || !mendable || Clock::now() >= give_up_at) return opened;
    monitor_.changed.wait_for(lock, kRest, [] { return false; });
  }
}

absl::StatusOr<CallOpener::Opened> CallOpener::OpenNewAt(Lock& lock, Clock::time_point give_up_at,
                                                         bool& mendable) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(give_up_at - Clock::now());
  lock.unlock();
  auto channel = MakeChannel(address(), options_.credentials);
  absl::Status reached = channel.status();
  if (channel.ok()) {
    reached =
        Connect(*channel, address(), addresses_.size() == 1 ? left : std::min(left, kShortConnect));
  }
  lock.lock();
  if (!reached.ok()) return reached;
  Start(lock, *std::move(channel));
  monitor_.changed.wait_for(lock, options_.deadline,
                            [this] { return attempt_->ready() > 0 || attempt_->done(); });
  if (const auto response = attempt_->Take(lock)) {
    mendable = false;
    if (response->has_opened()) return Opened{std::move(attempt_), response->opened()};
    Drop(lock, std::move(attempt_));
    return NotOpened(address());
  }
  if (!attempt_->done()) {
    mendable = false;
    Drop(lock, std::move(attempt_));
    return NotAccepted(address(), "stream", options_.deadline);
  }
  Loss loss = LossOf(*attempt_, resuming_);
  mendable = loss.mendable;
  Drop(lock, std::move(attempt_));
  return std::move(loss.status);
}

void CallOpener::Lost(const Loss& loss, v1::ResumeStream resume) {
  resume_ = std::move(resume);
  resuming_ = true;
  if (!backoff_) {
    backoff_.emplace(options_.reconnect, addresses_.size(), std::random_device{}());
    lost_at_ = Clock::now();
    lost_ = absl::StrCat("lost ", address(), " (", loss.why, ")");
  }
  TryNext(loss.status);
}

void CallOpener::TryNext(absl::Status refusal) {
  refusal_ = std::move(refusal);
  address_ = (address_ + 1) % addresses_.size();
  attempt_at_ = Clock::now() + backoff_->NextPause();
}

absl::StatusOr<std::optional<CallOpener::Opened>> CallOpener::OpenAgain(
    Lock& lock, std::optional<Clock::time_point> until) {
  const auto give_up_at = lost_at_ + options_.reconnect.give_up_after;
  for (;;) {
    const auto now = Clock::now();
    if (cancelled_) return absl::CancelledError("the stream was cancelled");
    if (attempt_ != nullptr) {
      if (const auto response = attempt_->Take(lock)) {
        if (response->has_opened()) return Opened{std::move(attempt_), response->opened()};
        Drop(lock, std::move(attempt_));
        return NotOpened(address());
      }
      if (attempt_->done()) {
        Loss loss = LossOf(*attempt_, resuming_);
        Drop(lock, std::move(attempt_));
        if (!loss.mendable) return std::move(loss.status);
        TryNext(std::move(loss.status));
        continue;
      }
      if (now >= attempt_until_) {
        Drop(lock, std::move(attempt_));
        // One that was cut short by the end says nothing: what there was before it is told.
        if (attempt_until_ < give_up_at) {
          TryNext(NotAccepted(address(), "stream", options_.connect_timeout));
        }
        continue;
      }
    } else if (now >= give_up_at) {
      return absl::UnavailableError(absl::StrCat("the stream could not go on within ",
                                                 Seconds(options_.reconnect.give_up_after), ": ",
                                                 refusal_.message()));
    } else if (now >= attempt_at_) {
      lock.unlock();
      auto channel = MakeChannel(address(), options_.credentials);
      lock.lock();
      if (!channel.ok()) return channel.status();
      Start(lock, *std::move(channel));
      attempt_until_ = std::min(now + options_.connect_timeout, give_up_at);
      continue;
    }
    if (until && now >= *until) return std::nullopt;
    const auto next = attempt_ != nullptr ? attempt_until_ : std::min(attempt_at_, give_up_at);
    monitor_.changed.wait_until(lock, until ? std::min(next, *until) : next);
  }
}

void CallOpener::Start(Lock& lock, std::shared_ptr<grpc::Channel> channel) {
  v1::OpenStream open = OpenMessage(options_);
  if (resuming_) *open.mutable_resume() = resume_;
  lock.unlock();
  auto call = std::make_unique<StreamCall>(monitor_, std::move(channel), address());
  call->Start(open);
  lock.lock();
  attempt_ = std::move(call);
}

// Without the lock: gRPC's threads need it to end a call.
void CallOpener::Drop(Lock& lock, std::unique_ptr<StreamCall> call) {
  lock.unlock();
  call.reset();
  lock.lock();
}

std::string CallOpener::Story() const {
  return absl::StrCat(lost_, ", went on at ", address(), " after ",
                      Seconds(Clock::now() - lost_at_));
}

void CallOpener::Cancel(Lock& lock) {
  cancelled_ = true;
  if (attempt_ != nullptr) attempt_->Cancel(lock);
}

}  // namespace partiemc::client
