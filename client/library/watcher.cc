#include "partiemc/client/watcher.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "library/channel.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

v1::WatchMode ToWire(WatchMode mode) {
  return mode == WatchMode::kEvery ? v1::WATCH_MODE_EVERY : v1::WATCH_MODE_LATEST;
}

// The two coordinates of `plane`, particle by particle.
void ProjectParticles(const Frame& frame, Plane plane, std::vector<double>& xy) {
  const auto components = static_cast<std::size_t>(frame.components);
  const std::size_t first = components == 3 && plane == Plane::kYz ? 1 : 0;
  const std::size_t second = components == 3 && plane != Plane::kXy ? 2 : 1;
  std::visit(
      [&](auto positions) {
        const std::size_t count = positions.size() / components;
        xy.resize(2 * count);
        for (std::size_t i = 0; i < count; ++i) {
          xy[2 * i] = static_cast<double>(positions[i * components + first]);
          xy[2 * i + 1] = static_cast<double>(positions[i * components + second]);
        }
      },
      frame.positions);
}

}  // namespace

// A thread reads; what it has read waits in `ready_`, which credit bounds. The receiver's thread
// decodes and gives the credit back.
class Watcher::Call {
 public:
  Call(const std::shared_ptr<grpc::Channel>& channel, std::string address)
      : address_(std::move(address)), stub_(v1::ReconstructionService::NewStub(channel)) {}

  ~Call() {
    context_.TryCancel();
    if (reader_.joinable()) reader_.join();
  }

  absl::Status Open(std::string_view stream_name, const WatcherOptions& options);
  absl::StatusOr<Received> Receive(WatchedFrame& frame,
                                   std::optional<std::chrono::milliseconds> wait);
  void Cancel();

  const WatchedStream& stream() const { return stream_; }
  const WatchEnd& end() const { return end_; }

 private:
  using Message = std::unique_ptr<v1::WatchStreamResponse>;

  void Read();
  absl::Status Decode(v1::WatchStreamResponse& message, WatchedFrame& frame);
  absl::Status Broken(const char* what) const {
    return absl::DataLossError(
        absl::StrCat("the server at ", address_, " ", what, ": it breaks the protocol"));
  }

  const std::string address_;
  const std::unique_ptr<v1::ReconstructionService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WatchStreamRequest, v1::WatchStreamResponse>> rpc_;
  // Of the receiver's thread:
  WatchedStream stream_;
  WatchEnd end_;
  wire::ReconstructedFrame decoded_;
  v1::ParticleFrame particles_;

  std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  std::deque<Message> ready_;
  std::vector<Message> spare_;
  std::optional<absl::Status> ended_;  // Once nothing more will be read.
  bool cancelled_ = false;
  std::thread reader_;
};

absl::Status Watcher::Call::Open(std::string_view stream_name, const WatcherOptions& options) {
  v1::WatchStreamRequest request;
  request.mutable_open()->set_stream_name(std::string(stream_name));
  request.mutable_open()->set_mode(ToWire(options.mode));
  request.mutable_open()->set_credits(std::max<std::uint32_t>(options.credits, 1));
  rpc_ = stub_->WatchStream(&context_);
  rpc_->Write(request);  // Where it fails, the end of the call says why.
  reader_ = std::thread([this] { Read(); });

  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, options.deadline, [this] { return !ready_.empty() || ended_; });
  if (ready_.empty()) {
    if (ended_ && !ended_->ok()) return *ended_;
    if (ended_) return Broken("ended the watch at once");
    return absl::DeadlineExceededError(
        absl::StrCat("the server at ", address_, " did not accept the watcher within ",
                     static_cast<double>(options.deadline.count()) / 1000,
                     " s: it may be overloaded; try again later"));
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
  return absl::OkStatus();
}

void Watcher::Call::Read() {
  for (;;) {
    Message message;
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        message = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (message == nullptr) message = std::make_unique<v1::WatchStreamResponse>();
    if (!rpc_->Read(message.get())) break;
    const std::lock_guard lock(mutex_);
    ready_.push_back(std::move(message));
    changed_.notify_all();
  }
  const absl::Status status = FromGrpc(rpc_->Finish(), address_);
  const std::lock_guard lock(mutex_);
  ended_ = status;
  changed_.notify_all();
}

absl::StatusOr<Received> Watcher::Call::Receive(WatchedFrame& frame,
                                                std::optional<std::chrono::milliseconds> wait) {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto something = [this] { return cancelled_ || !ready_.empty() || ended_; };
    if (!wait) {
      changed_.wait(lock, something);
    } else if (!changed_.wait_for(lock, *wait, something)) {
      return Received::kNothingYet;
    }
    if (cancelled_) return absl::CancelledError("the watch was cancelled");
    if (ready_.empty()) {
      if (!ended_->ok()) return *ended_;
      if (end_.reason.empty()) return Broken("ended the watch without a word");
      return Received::kEnd;
    }
    Message message = std::move(ready_.front());
    ready_.pop_front();
    lock.unlock();
    if (message->has_ended()) {
      end_ = {message->ended().reason(), message->ended().message(), message->ended().dropped()};
      lock.lock();
      continue;  // The status of the call follows.
    }
    const absl::Status status = Decode(*message, frame);
    if (!status.ok()) {
      context_.TryCancel();
      return status;
    }
    lock.lock();
    spare_.push_back(std::move(message));
    lock.unlock();
    v1::WatchStreamRequest credit;
    credit.mutable_credit()->set_frames(1);
    rpc_->Write(credit);  // Where it fails, the end of the call says why.
    return Received::kEvent;
  }
}

absl::Status Watcher::Call::Decode(v1::WatchStreamResponse& message, WatchedFrame& frame) {
  if (!message.has_frame()) return Broken("sent a message that this client does not know");
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
  frame.dropped = message.frame().dropped();
  frame.particles.clear();
  if (result.particles().empty()) return absl::OkStatus();
  particles_.set_position_format(result.particle_format());
  particles_.mutable_positions()->swap(*result.mutable_particles());
  const auto particles = wire::DecodeFrame(particles_);
  if (!particles.ok()) return Broken("sent particles that cannot be read");
  ProjectParticles(*particles, stream_.parameters.plane, frame.particles);
  return absl::OkStatus();
}

void Watcher::Call::Cancel() {
  context_.TryCancel();
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  changed_.notify_all();
}

absl::StatusOr<std::unique_ptr<Watcher>> Watcher::Open(std::string_view address_text,
                                                       std::string_view stream_name,
                                                       const WatcherOptions& options) {
  const std::string address(address_text);
  const auto channel = MakeChannel(address, options.credentials);
  if (!channel.ok()) return channel.status();
  absl::Status status = Connect(*channel, address, options.connect_timeout);
  if (!status.ok()) return status;
  auto call = std::make_unique<Call>(*channel, address);
  status = call->Open(stream_name, options);
  if (!status.ok()) return status;
  return std::unique_ptr<Watcher>(new Watcher(std::move(call)));
}

Watcher::Watcher(std::unique_ptr<Call> call) : call_(std::move(call)) {}
Watcher::~Watcher() = default;

const WatchedStream& Watcher::stream() const { return call_->stream(); }
absl::StatusOr<Received> Watcher::Receive(WatchedFrame& frame,
                                          std::optional<std::chrono::milliseconds> wait) {
  return call_->Receive(frame, wait);
}
const WatchEnd& Watcher::end() const { return call_->end(); }
void Watcher::Cancel() { call_->Cancel(); }

}  // namespace partiemc::client
