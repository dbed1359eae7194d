// A result for watchers, whose bytes all watchers share.
#pragma once

#include <cstdint>
#include <utility>

#include "server/watch/result_mailbox.h"
#include "wire/watched_bytes.h"

namespace partiemc::server {

class WatchedResult final : public WatchFrame {
 public:
  enum class Origin : std::uint8_t { kHere, kOtherReplica };

  explicit WatchedResult(wire::WatchedBytes result, Origin came_from = Origin::kHere)
      : WatchFrame(result.size(), result.memory()), bytes(std::move(result)), origin(came_from) {}

  const wire::WatchedBytes bytes;
  const Origin origin;  ///< The bytes of another replica may be malformed.
};

}  // namespace partiemc::server
