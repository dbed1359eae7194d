// Queues what other replicas fetch, so that one of them cannot keep the others waiting.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

/// Replicas take turns. If a replica has more fetches than fit, its oldest is dropped: a replica
/// that misses an answer fetches again. Not thread-safe.
class FetchQueue {
 public:
  static constexpr std::size_t kReplicas = 1024;
  static constexpr std::size_t kFetchesOfReplica = 16;
  /// The limit of one fetch with the name of its replica; a real one has less than 100 bytes.
  static constexpr std::size_t kFetchBytes = 1024;

  struct Item {
    std::string replica;
    relay::v1::Fetch fetch;
  };

  /// Drops the fetch if it is too large, or of one replica too many.
  void Add(const std::string& replica, const relay::v1::Fetch& fetch);
  /// The oldest fetch of the replica whose turn it is.
  std::optional<Item> TakeNext();

  bool empty() const { return turns_.empty(); }
  std::uint64_t dropped() const { return dropped_; }

 private:
  std::map<std::string, std::deque<relay::v1::Fetch>> fetches_;  // No queue is empty.
  std::deque<std::string> turns_;                                // The keys of fetches_.
  std::uint64_t dropped_ = 0;
};

}  // namespace partiemc::server
