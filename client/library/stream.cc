#include "partiemc/client/stream.h"

#include <utility>

#include "library/resuming_stream.h"

namespace partiemc::client {

absl::StatusOr<std::unique_ptr<Stream>> Stream::Open(std::string_view address,
                                                     const StreamOptions& options) {
  const absl::Status valid = Validate(options.parameters);
  if (!valid.ok()) return valid;
  auto stream = ResumingStream::Open(address, options);
  if (!stream.ok()) return stream.status();
  return std::unique_ptr<Stream>(new Stream(*std::move(stream)));
}

Stream::Stream(std::unique_ptr<ResumingStream> stream) : stream_(std::move(stream)) {}
Stream::~Stream() = default;

const StreamInfo& Stream::info() const { return stream_->info(); }
absl::StatusOr<std::uint64_t> Stream::Send(const Frame& frame, double time) {
  return stream_->Send(frame, time);
}
absl::Status Stream::FinishSending() { return stream_->FinishSending(); }
absl::StatusOr<Received> Stream::Receive(Event& event,
                                         std::optional<std::chrono::milliseconds> wait) {
  return stream_->Receive(event, wait);
}
std::size_t Stream::InFlight() const { return stream_->InFlight(); }
void Stream::Cancel() { stream_->Cancel(); }

}  // namespace partiemc::client
