#include "partiemc/client/stream.h"

#include <utility>

#include "library/channel.h"
#include "library/stream_call.h"

namespace partiemc::client {

absl::StatusOr<std::unique_ptr<Stream>> Stream::Open(std::string_view address_text,
                                                     const StreamOptions& options) {
  const absl::Status valid = Validate(options.parameters);
  if (!valid.ok()) return valid;
  const std::string address(address_text);
  auto channel = MakeChannel(address, options.credentials);
  if (!channel.ok()) return channel.status();
  absl::Status status = Connect(*channel, address, options.connect_timeout);
  if (!status.ok()) return status;
  auto call = std::make_unique<Call>(*std::move(channel), address, options.deadline);
  status = call->Open(options);
  if (!status.ok()) return status;
  return std::unique_ptr<Stream>(new Stream(std::move(call)));
}

Stream::Stream(std::unique_ptr<Call> call) : call_(std::move(call)) {}
Stream::~Stream() = default;

const StreamInfo& Stream::info() const { return call_->info(); }
absl::StatusOr<std::uint64_t> Stream::Send(const Frame& frame, double time) {
  return call_->Send(frame, time);
}
absl::Status Stream::FinishSending() { return call_->FinishSending(); }
absl::StatusOr<Received> Stream::Receive(Event& event,
                                         std::optional<std::chrono::milliseconds> wait) {
  return call_->Receive(event, wait);
}
std::size_t Stream::InFlight() const { return call_->InFlight(); }
void Stream::Cancel() { call_->Cancel(); }

}  // namespace partiemc::client
