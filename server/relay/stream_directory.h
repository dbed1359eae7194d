// The streams that other replicas have, as they announce them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

struct RemoteStream {
  std::string replica;
  relay::v1::LiveStream stream;

  const std::string& id() const { return stream.summary().stream_id(); }
  const std::string& name() const { return stream.summary().stream_name(); }
};

/// Safe from any thread. A stream that was resumed at another replica, and that the former one has
/// not given up yet, is there once: as the later one has it, by the clocks of both.
class StreamDirectory {
 public:
  using Clock = std::chrono::steady_clock;

  /// All streams of a replica. Whether they are others than before.
  bool Announced(const std::string& replica, const relay::v1::Announcement& announcement,
                 Clock::time_point now);
  void Left(const std::string& replica);
  /// Whose last announcement is older than that has left; gives them.
  std::vector<std::string> Expire(Clock::time_point before);
  /// What was heard before counts as heard now: nothing could be heard meanwhile.
  void Refresh(Clock::time_point now);

  /// Of those that do not drain, each once: at most `count`.
  std::vector<std::string> Addresses(std::size_t count) const;

  /// Whether every one that is known has announced its streams since then.
  bool HaveAllAnnouncedSince(Clock::time_point since) const;

  /// The stream of that name that was opened last.
  std::optional<RemoteStream> FindName(std::string_view name) const;
  /// The stream with this lineage that was opened last.
  std::optional<RemoteStream> FindLineage(std::string_view lineage) const;
  bool Has(const std::string& replica, std::string_view stream_id) const;
  /// Those that `wants` wants, in the order of their ids: at most `count`, after `after`.
  std::vector<relay::v1::LiveStream> List(
      const std::string& after, std::size_t count,
      absl::FunctionRef<bool(const relay::v1::LiveStream&)> wants) const;
  std::size_t replicas() const;
  std::size_t streams() const;

 private:
  struct Replica {
    std::map<std::string, relay::v1::LiveStream> streams;  // By their ids.
    Clock::time_point heard, announced;
    std::string address;  // Empty where none is to be told.
  };

  template <typename Matches>
  std::optional<RemoteStream> Latest(Matches matches) const;

  mutable std::mutex mutex_;  // Guards everything below.
  std::map<std::string, Replica> replicas_;
};

}  // namespace partiemc::server
