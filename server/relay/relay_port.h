// The interface through which exported and imported streams use the relay: to run actions on its
// thread, and to send messages to other replicas.
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
  /// Sends a message. Called by the relay thread only. Returns false if it was certainly lost.
  virtual bool Send(const std::string& subject, relay::v1::RelayMessage& message) = 0;
};

/// The subject of announcements to all replicas.
inline constexpr char kReplicasSubject[] = "partiemc.replicas";
/// Two subjects of a replica: for the fetches that it receives, and for the responses to its own
/// fetches.
inline std::string SubjectOfAsking(const std::string& replica) { return "partiemc.ask." + replica; }
inline std::string SubjectOfAnswers(const std::string& replica) {
  return "partiemc.for." + replica;
}
/// The subject of the new results of a stream.
inline std::string SubjectOfResults(const std::string& stream_id) {
  return "partiemc.results." + stream_id;
}

}  // namespace partiemc::server
