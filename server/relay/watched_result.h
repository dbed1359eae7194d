// A result for watchers, whose bytes all watchers share.
#pragma once

#include <utility>

#include "server/watch/result_mailbox.h"
#include "wire/watched_bytes.h"

namespace partiemc::server {

class WatchedResult final : public WatchFrame {
 public:
  explicit WatchedResult(wire::WatchedBytes result)
      : WatchFrame(result.size(), result.memory()), bytes(std::move(result)) {}

  const wire::WatchedBytes bytes;
};

}  // namespace partiemc::server
