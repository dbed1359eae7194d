// A stream without a producer's call, for tests of watchers.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "server/memory_watcher.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_dispatcher.h"

namespace partiemc::server {

inline constexpr std::size_t kFrameBytes = 1000;
/// What a frame counts.
inline constexpr std::uint64_t kFrameCost = kFrameBytes + kPublishedBytes;
/// Limit of a watcher: ten frames.
inline constexpr std::size_t kMaxBytes = 10 * kFrameCost;

class WatchTest : public ::testing::Test {
 protected:
  // Publishes frame `number`.
  void Publish(std::uint64_t number, std::size_t bytes = kFrameBytes) {
    if (broadcaster_->Publish(std::make_shared<NumberedFrame>(number, bytes), number))
      broadcaster_->Announce();
  }
  std::unique_ptr<MemoryWatcher> Join(WatchMode mode, std::uint64_t credit) {
    return std::make_unique<MemoryWatcher>(broadcaster_, mode, credit, kMaxBytes);
  }
  void EndStream() { broadcaster_->End(WatchEnd::OfStream(absl::OkStatus())); }

  WatchDispatcher dispatcher_;
  std::shared_ptr<ResultBroadcaster> broadcaster_ = std::make_shared<ResultBroadcaster>(
      dispatcher_,
      ResultBroadcaster::Limits{.mailbox_bytes = kMaxBytes, .kept_bytes = 2 * kFrameBytes});
};

}  // namespace partiemc::server
