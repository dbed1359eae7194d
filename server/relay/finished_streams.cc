#include "server/relay/finished_streams.h"

#include <utility>

namespace partiemc::server {
namespace {

// Time for which a finished stream is kept, so that its watchers can reconnect.
constexpr std::chrono::seconds kFinishedKept(30);

}  // namespace

void FinishedStreams::Add(relay::v1::LiveStream stream, std::uint64_t last_sequence) {
  stream.mutable_summary()->set_last_sequence(last_sequence);
  const std::size_t bytes = sizeof(Finished) + stream.SpaceUsedLong();
  if (bytes > kMostBytes) return;
  const MutexLock lock(mutex_);
  bytes_ += bytes;
  streams_.push_back({std::move(stream), bytes, clock_.Now()});
  DropOld();
}

void FinishedStreams::Forget(std::string_view lineage) {
  const MutexLock lock(mutex_);
  std::erase_if(streams_, [&](const Finished& one) {
    mutex_.AssertHeld();
    if (one.stream.lineage() != lineage) return false;
    bytes_ -= one.bytes;
    return true;
  });
}

std::optional<relay::v1::LiveStream> FinishedStreams::Find(std::string_view name,
                                                           std::string_view lineage) {
  if (lineage.empty()) return std::nullopt;
  const MutexLock lock(mutex_);
  DropOld();
  for (auto one = streams_.rbegin(); one != streams_.rend(); ++one) {
    if (one->stream.lineage() == lineage && one->stream.summary().stream_name() == name) {
      return one->stream;
    }
  }
  return std::nullopt;
}

void FinishedStreams::DropOld() {
  const auto now = clock_.Now();
  while (!streams_.empty() && (bytes_ > kMostBytes || now - streams_.front().at > kFinishedKept)) {
    bytes_ -= streams_.front().bytes;
    streams_.pop_front();
  }
}

}  // namespace partiemc::server
