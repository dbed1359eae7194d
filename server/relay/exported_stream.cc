#include "server/relay/exported_stream.h"

#include <limits>
#include <utility>

#include "partiemc/status.h"
#include "server/relay/watched_result.h"

namespace partiemc::server {
namespace {

// Maximum bytes of the results in the response to one fetch, so that the relay does not send a
// replica a whole history at once. The first result is sent even if it is larger.
constexpr std::size_t kMaxFetchedBytes = std::size_t{4} << 20;

}  // namespace

ExportedStream::ExportedStream(std::string id, std::shared_ptr<ResultBroadcaster> broadcaster,
                               std::size_t max_bytes, RelayPort& port, const Clock& clock)
    : id_(std::move(id)),
      broadcaster_(std::move(broadcaster)),
      port_(port),
      clock_(clock),
      machine_(
          std::make_shared<WatchStateMachine>(static_cast<WatchTransport&>(*this), max_bytes)) {
  broadcaster_->HoldHistory();
}

ExportedStream::~ExportedStream() { broadcaster_->ReleaseHistory(); }

void ExportedStream::Begin() {
  self_ = shared_from_this();
  live_ = true;
  machine_->Start();
}

// Plays the watcher's part: one `open`, whose unlimited credit StartOpen sets.
void ExportedStream::StartRead() {
  if (!opened_.exchange(true)) machine_->ReadDone({WatchRequest::Kind::kOpen, 0});
}

void ExportedStream::StartOpen() {
  machine_->Opened(WatchTerms{.broadcaster = broadcaster_,
                              .mode = WatchMode::kEvery,
                              .credit = std::numeric_limits<std::uint64_t>::max()});
}

void ExportedStream::WriteOpened(const HeldFrames&) {
  port_.Post([self = shared_from_this()] { self->machine_->WriteDone(true); });
}

void ExportedStream::WriteFrame(const Published& published, std::uint64_t,
                                std::uint64_t oldest_sequence) {
  port_.Post([self = shared_from_this(), published, oldest_sequence] {
    self->Try([self = self.get(), published, oldest_sequence] {
      if (!self->SendResult(SubjectOfResults(self->id_), published, {}, oldest_sequence)) {
        return false;
      }
      self->last_published_ = published.number;
      return true;
    });
  });
}

void ExportedStream::WriteEnded(const WatchEnd& end, std::uint64_t dropped) {
  port_.Post([self = shared_from_this(), end, dropped] {
    self->Try([self = self.get(), end, dropped] { return self->PublishEnd(end, dropped); });
  });
}

void ExportedStream::Finish(const absl::Status&) {
  live_ = false;
  const std::shared_ptr<ExportedStream> last = std::move(self_);
}

void ExportedStream::Try(std::function<bool()> send) {
  if (send()) {
    machine_->WriteDone(true);
  } else {
    unsent_ = std::move(send);
  }
}

void ExportedStream::Retry() {
  if (unsent_) Try(std::exchange(unsent_, nullptr));
}

void ExportedStream::End() {
  machine_->Cancelled();
  if (std::exchange(unsent_, nullptr)) machine_->WriteDone(false);
}

bool ExportedStream::PublishEnd(const WatchEnd& end, std::uint64_t dropped) {
  // The stream itself continues; only this export was too slow. Replicas fetch the missed results.
  if (end.reason == kReasonFellBehind) return true;
  relay::v1::StreamEnd& told = *end_.mutable_stream_end();
  told.set_stream_id(id_);
  told.set_last_number(last_published_ + dropped);
  told.set_reason(end.reason);
  told.set_message(end.message);
  told.set_code(static_cast<int>(end.status.code()));
  if (const auto violation = FindViolation(end.status)) {
    told.set_field(violation->field);
    told.set_value(violation->value);
    told.set_rule(violation->rule);
  }
  ended_at_ = clock_.Now();
  return port_.Send(SubjectOfResults(id_), end_);
}

bool ExportedStream::SendResult(const std::string& subject, const Published& published,
                                const Answering& answering, std::uint64_t oldest_sequence) {
  relay::v1::RelayMessage message;
  relay::v1::Result& result = *message.mutable_result();
  result.set_stream_id(id_);
  result.set_number(published.number);
  result.set_sequence(published.sequence);
  result.set_oldest_sequence(oldest_sequence);
  result.set_frame(static_cast<const WatchedResult&>(*published.frame).bytes.ToString());
  result.set_fetch(answering.fetch);
  result.set_first(answering.first);
  return port_.Send(subject, message);
}

Published ExportedStream::First(const relay::v1::Fetch& fetch) const {
  switch (fetch.from_case()) {
    case relay::v1::Fetch::kSequence:
      return broadcaster_->HeldFrom(fetch.sequence());
    case relay::v1::Fetch::kNumber:
      return NextAfter(fetch.number() - 1);
    case relay::v1::Fetch::kNewest:
      return broadcaster_->Newest();
    case relay::v1::Fetch::FROM_NOT_SET:
      break;
  }
  return {};
}

Published ExportedStream::NextAfter(std::uint64_t number) const {
  Published next = broadcaster_->Held(number + 1);
  if (next.frame != nullptr) return next;
  next = broadcaster_->Newest();
  return next.number > number ? next : Published();
}

void ExportedStream::Answer(const relay::v1::Fetch& fetch, const std::string& replica) {
  const std::string subject = SubjectOfAnswers(replica);
  const bool asks_for_frames = fetch.from_case() != relay::v1::Fetch::FROM_NOT_SET;
  relay::v1::RelayMessage message;
  relay::v1::FetchEnd& end = *message.mutable_fetch_end();
  end.set_stream_id(id_);
  end.set_fetch(fetch.fetch());
  // The response covers the results so far. Later ones are published to all replicas.
  end.set_last_number(asks_for_frames ? broadcaster_->LastNumber() : last_published_);
  std::size_t bytes = 0;
  for (Published next = First(fetch); next.frame != nullptr && next.number <= end.last_number();
       next = NextAfter(next.number)) {
    if (bytes > 0 && bytes + next.frame->bytes() > kMaxFetchedBytes) {
      end.set_next_number(next.number);
      break;
    }
    const Answering answering{fetch.fetch(), bytes == 0};
    bytes += next.frame->bytes();
    if (!SendResult(subject, next, answering, broadcaster_->oldest_here())) return;
  }
  end.set_oldest_sequence(broadcaster_->oldest_here());
  port_.Send(subject, message);
  if (ended_at_) port_.Send(subject, end_);
}

}  // namespace partiemc::server
