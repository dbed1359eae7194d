// The interface of the relay for its streams: run on its thread, send to other replicas.
#pragma once

#include <functional>
#include <string>

#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

class RelayPort {
 public:
  virtual ~RelayPort() = default;

  /// Runs `action` on the relay thread, in the order of the calls. Thread-safe; does not block.
  virtual void Post(std::function<void()> action) = 0;
  /// Relay thread only. Returns false if the message was certainly lost.
  virtual bool Send(const std::string& subject, relay::v1::RelayMessage& message) = 0;
};

/// Announcements to all replicas.
inline constexpr char kReplicasSubject[] = "partiemc.replicas";
/// Fetches to a replica, and responses to its fetches.
inline std::string SubjectOfAsking(const std::string& replica) { return "partiemc.ask." + replica; }
inline std::string SubjectOfAnswers(const std::string& replica) {
  return "partiemc.for." + replica;
}
/// New results of a stream.
inline std::string SubjectOfResults(const std::string& stream_id) {
  return "partiemc.results." + stream_id;
}

}  // namespace partiemc::server
