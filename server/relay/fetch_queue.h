// Queues the fetches of other replicas, so that one replica cannot keep the others waiting.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

/// Replicas take turns. If a replica has more fetches than fit, its oldest fetch is dropped. This
/// is safe: a replica that receives no response fetches again. Not thread-safe.
class FetchQueue {
 public:
  static constexpr std::size_t kReplicas = 1024;
  static constexpr std::size_t kFetchesOfReplica = 16;
  /// Maximum size of a fetch, including the name of its replica. Real fetches have less than 100
  /// bytes.
  static constexpr std::size_t kFetchBytes = 1024;

  struct Item {
    std::string replica;
    relay::v1::Fetch fetch;
  };

  /// Adds a fetch. Drops it if it is too large, or if its replica is new and the queue already has
  /// fetches of kReplicas replicas.
  void Add(const std::string& replica, const relay::v1::Fetch& fetch);
  /// Removes and returns the oldest fetch of the replica whose turn it is; nothing if empty.
  std::optional<Item> TakeNext();

  bool empty() const { return turns_.empty(); }
  std::uint64_t dropped() const { return dropped_; }

 private:
  std::map<std::string, std::deque<relay::v1::Fetch>> fetches_;  // No queue is empty.
  std::deque<std::string> turns_;  // The keys of fetches_, in the order of their turns.
  std::uint64_t dropped_ = 0;
};

}  // namespace partiemc::server
