#include "server/relay/imported_stream.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/relay/watched_result.h"
#include "server/stream/stream_registry.h"

namespace partiemc::server {
namespace {

using std::chrono::seconds;

// Interval between fetches that ask for no earlier result: the owner publishes new results only
// while it receives fetches.
constexpr seconds kWantEvery(1);
// A fetch fails after this time without a message of its response.
constexpr seconds kFetchPatience(2);
// Time for which an import without watchers is kept, so that watchers can reconnect.
constexpr seconds kLinger(5);

// Largest number of a result, so that each one has a successor. Messages with a larger number are
// ignored.
constexpr std::uint64_t kLargestNumber = std::numeric_limits<std::uint64_t>::max() - 1;

constexpr char kNoAnswer[] =
    "must be a stream that its replica shows: that one does not answer; "
    "try again";

}  // namespace

ImportedStream::ImportedStream(RemoteStream stream, std::optional<std::uint64_t> from_sequence,
                               WatchDispatcher& dispatcher, const Limits& limits, RelayPort& port,
                               TimePoint now)
    : stream_(std::move(stream)),
      from_sequence_(from_sequence),
      limits_(limits),
      port_(port),
      broadcaster_(std::make_shared<ResultBroadcaster>(dispatcher, limits.broadcaster)),
      began_(now),
      watched_(now) {
  if (limits_.history != nullptr) broadcaster_->BeginHistory(*limits_.history, nullptr, 1);
  if (from_sequence_ && limits_.history != nullptr) {
    fetch_.set_sequence(*from_sequence_);
  } else {
    fetch_.set_newest(true);
  }
  Fetch(now);
}

bool ImportedStream::IsIdle(TimePoint now) const {
  return await_.empty() && broadcaster_->watcher_count() == 0 &&
         (ended_ || now - watched_ > kLinger);
}

bool ImportedStream::Covers(std::optional<std::uint64_t> from_sequence, TimePoint now) const {
  if (ended_) return false;
  if (!from_sequence || limits_.history == nullptr) return true;
  // This import began recently from the same frame or an earlier one. A second import could not get
  // more history.
  if (from_sequence_ && *from_sequence_ <= *from_sequence && now - began_ < kLinger) return true;
  const std::uint64_t here = broadcaster_->oldest_here();
  return ready_ &&
         ((here != 0 && here <= *from_sequence) || broadcaster_->oldest_sequence() == here);
}

void ImportedStream::Await(Ready ready) {
  if (ready_) return ready(absl::OkStatus());
  await_.push_back(std::move(ready));
}

// Sends a fetch. Each fetch has its own number, and its responses repeat the number.
void ImportedStream::Fetch(TimePoint now) {
  fetching_ = true;
  heard_ = wanted_ = now;
  fetch_.set_stream_id(stream_.id());
  fetch_.set_fetch(fetch_.fetch() + 1);
  relay::v1::RelayMessage message;
  *message.mutable_fetch() = fetch_;
  port_.Send(SubjectOfAsking(stream_.replica), message);
}

void ImportedStream::FetchFrom(std::uint64_t number, TimePoint now) {
  fetch_.set_number(number);
  Fetch(now);
}

void ImportedStream::SetOldest(std::uint64_t sequence) {
  if (limits_.history != nullptr) broadcaster_->SetOldestElsewhere(sequence);
}

void ImportedStream::OnMessage(relay::v1::Result& result, TimePoint now) {
  if (ended_ || result.number() == 0 || result.number() > kLargestNumber) return;
  if (result.fetch() == fetch_.fetch()) heard_ = now;
  SetOldest(result.oldest_sequence());
  if (result.first() && result.fetch() == fetch_.fetch()) DeliverUpTo(result.number() - 1);
  if (next_number_ != 0 && result.number() < next_number_) return;
  const Published published{std::make_shared<WatchedResult>(wire::WatchedBytes(result.frame()),
                                                            WatchedResult::Origin::kOtherReplica),
                            result.number(), result.sequence()};
  if (result.number() == next_number_) {
    Deliver(published);
    return DeliverWaiting(now);
  }
  const std::size_t bytes = published.frame->bytes() + kPublishedBytes;
  // A result that does not fit is dropped here, counts as missing and is fetched later.
  if (waiting_bytes_ + bytes <= limits_.waiting_bytes &&
      waiting_.emplace(published.number, published).second) {
    waiting_bytes_ += bytes;
  }
  if (!fetching_) FetchFrom(next_number_, now);
}

void ImportedStream::OnMessage(const relay::v1::FetchEnd& end, TimePoint now) {
  if (ended_ || end.last_number() > kLargestNumber) return;
  if (end.gone()) {
    return Lost({std::string(kReasonProducerLost), "the producer has gone", {}}, now);
  }
  if (end.fetch() == 0) {
    if (!fetching_ && next_number_ != 0 && end.last_number() >= next_number_) {
      FetchFrom(next_number_, now);
    }
    return;
  }
  if (!fetching_ || end.fetch() != fetch_.fetch()) return;
  SetOldest(end.oldest_sequence());
  const std::uint64_t last = end.next_number() == 0 ? end.last_number() : end.next_number() - 1;
  // A part of the response was lost.
  if (next_number_ != 0 && next_number_ <= last && fetch_.number() != next_number_) {
    return FetchFrom(next_number_, now);
  }
  if (end.next_number() == 0) return FetchEnded(last, now);
  DeliverUpTo(last);
  FetchFrom(end.next_number(), now);
}

// The fetches have ended: missing results up to `last_number` are no longer available.
void ImportedStream::FetchEnded(std::uint64_t last_number, TimePoint now) {
  fetching_ = false;
  DeliverUpTo(last_number);
  DeliverWaiting(now);
  if (end_ && !fetching_) {
    const relay::v1::StreamEnd told = *std::exchange(end_, std::nullopt);
    return OnMessage(told, now);
  }
  if (ready_ || fetching_) return;
  ready_ = true;
  AnswerWaiting(absl::OkStatus());
}

void ImportedStream::DeliverUpTo(std::uint64_t number) {
  while (!waiting_.empty() && waiting_.begin()->first <= number) {
    auto first = waiting_.extract(waiting_.begin());
    waiting_bytes_ -= first.mapped().frame->bytes() + kPublishedBytes;
    Deliver(std::move(first.mapped()));
  }
  next_number_ = std::max(next_number_, number + 1);
}

void ImportedStream::Deliver(Published published) {
  if (published.number < next_number_) return;
  next_number_ = published.number + 1;
  if (delivered_ != 0 && published.number != delivered_ + 1) last_loss_ = published.number;
  published.last_loss = last_loss_;
  delivered_ = published.number;
  broadcaster_->PublishNumbered(std::move(published));
}

void ImportedStream::DeliverWaiting(TimePoint now) {
  while (!waiting_.empty() && waiting_.begin()->first <= next_number_) {
    DeliverUpTo(waiting_.begin()->first);
  }
  if (!waiting_.empty() && !fetching_) FetchFrom(next_number_, now);
}

void ImportedStream::OnMessage(const relay::v1::StreamEnd& end, TimePoint now) {
  if (ended_ || end.last_number() > kLargestNumber) return;
  if (fetching_ || next_number_ <= end.last_number()) {
    const bool asked = fetching_;
    end_ = end;
    if (!asked) FetchFrom(next_number_, now);
    return;
  }
  WatchEnd told{.reason = end.reason(),
                .message = end.message(),
                .status = {},
                .last_number = end.last_number()};
  // The owner drains, not this server, so the watchers here receive another reason.
  if (end.reason() == kReasonDraining) {
    told.reason = kReasonProducerLost;
    told.message = "the server of the stream drains";
  } else if (end.code() != 0) {
    told.status = ViolationError(static_cast<absl::StatusCode>(end.code()),
                                 {end.reason(), end.field(), end.value(), end.rule()});
  }
  End(told);
}

void ImportedStream::FetchAgain(TimePoint now) {
  if (ended_) return;
  if (!fetching_) return FetchFrom(next_number_, now);
  Fetch(now);
}

void ImportedStream::End(const WatchEnd& end) {
  if (ended_) return;
  ended_ = true;
  if (limits_.finished != nullptr) {
    if (end.reason == kReasonFinished) {
      limits_.finished->Add(stream_.stream, std::max(stream_.stream.summary().last_sequence(),
                                                     broadcaster_->last_sequence()));
    } else {
      limits_.finished->Forget(stream_.stream.lineage());
    }
  }
  broadcaster_->End(end);
  AnswerWaiting(NoSuchStream(stream_.name()));
}

void ImportedStream::Lost(const WatchEnd& otherwise, TimePoint now) {
  if (ended_) return;
  if (end_) FetchEnded(end_->last_number(), now);
  End(otherwise);
}

void ImportedStream::Fail(const absl::Status& status) {
  ended_ = true;
  broadcaster_->End({std::string(kReasonProducerLost), "its replica cannot be reached", {}});
  AnswerWaiting(status);
}

void ImportedStream::AnswerWaiting(const absl::Status& status) {
  for (const Ready& ready : std::exchange(await_, {})) ready(status);
}

void ImportedStream::Tick(TimePoint now, bool connected) {
  if (!await_.empty() || broadcaster_->watcher_count() > 0) watched_ = now;
  if (ended_) return;
  if (fetching_ && now - heard_ > kFetchPatience && (connected || !ready_)) {
    if (!ready_) return Fail(NoSuchStream(stream_.name(), kNoAnswer));
    const std::uint64_t next = waiting_.empty() ? next_number_ : waiting_.begin()->first;
    return FetchEnded(end_ ? end_->last_number() : next - 1, now);
  }
  if (!connected || now - wanted_ < kWantEvery) return;
  wanted_ = now;
  relay::v1::RelayMessage message;
  message.mutable_fetch()->set_stream_id(stream_.id());
  port_.Send(SubjectOfAsking(stream_.replica), message);
}

}  // namespace partiemc::server
