// An in-memory replica: streams, watchers and the relay, without gRPC and core.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/parameters.h"
#include "relay/memory_bus.h"
#include "server/closed_transport.h"
#include "server/memory_watcher.h"
#include "server/relay/relay.h"
#include "server/watch/watch_dispatcher.h"

namespace partiemc::server {

/// The bytes of a frame with this sequence number and size; the same on every replica.
std::string FrameBytes(std::uint64_t sequence, std::size_t bytes);

class MemoryReplica {
 public:
  static constexpr std::size_t kWatcherBytes = std::size_t{1} << 20;

  /// `history_bytes`: history per stream; 0: none. `address`: for clients; empty: none.
  explicit MemoryReplica(MemoryHub& hub, std::uint64_t history_bytes = std::uint64_t{8} << 20,
                         const std::string& address = {}, const TimeAndChance& surroundings = {});
  ~MemoryReplica();

  /// The parameters of every stream: all features at once, so no stream could be reconstructed.
  static ReconstructionParameters Parameters();

  // Producer's side. `token` identifies a resumed stream.
  void Open(const std::string& name, const std::string& token, std::uint64_t next_sequence = 1);
  void Publish(const std::string& name, std::uint64_t sequence, std::size_t bytes = 1000);
  void Close(const std::string& name, const absl::Status& status = absl::OkStatus());

  // Watcher's side.
  absl::StatusOr<Relay::Found> Find(const std::string& name,
                                    std::optional<std::uint64_t> from = std::nullopt);
  /// A watcher of another replica's stream; null if it is not found.
  std::unique_ptr<MemoryWatcher> Watch(const std::string& name, WatchMode mode = WatchMode::kEvery,
                                       std::optional<std::uint64_t> from = std::nullopt,
                                       std::uint64_t credit = std::uint64_t{1} << 40);
  /// A watcher of a local stream.
  std::unique_ptr<MemoryWatcher> WatchOwn(const std::string& name);

  Relay& relay() { return *relay_; }
  MemoryHub::End& bus() { return *end_; }

 private:
  struct Stream {
    std::shared_ptr<StreamStateMachine> machine;
    std::shared_ptr<ResultBroadcaster> broadcaster;
  };

  ComputePool pool_{1};
  MemoryBudget budget_{1000};
  ClosedTransport transport_;
  HistoryRoom history_;
  WatchDispatcher dispatcher_;
  StreamRegistry registry_;
  MemoryHub::End* end_ = nullptr;
  std::unique_ptr<Relay> relay_;
  std::map<std::string, Stream> streams_;
};

}  // namespace partiemc::server
