// What the parts of the relay have in common: its thread, and the way out to other replicas.
#pragma once

#include <functional>
#include <string>

#include "partiemc/relay/v1/relay.pb.h"

namespace partiemc::server {

/// Of one replica.
class RelayPort {
 public:
  virtual ~RelayPort() = default;

  /// Has `action` done by the relay's thread, in the order of the calls. From any thread; waits for
  /// nothing.
  virtual void Post(std::function<void()> action) = 0;
  /// By the relay's thread alone. False if the message is lost for certain.
  virtual bool Send(const std::string& subject, relay::v1::RelayMessage& message) = 0;
};

/// All replicas listen to these announcements.
inline constexpr char kReplicasSubject[] = "partiemc.replicas";
/// Fetches for a replica, and what answers its own.
inline std::string SubjectOfAsking(const std::string& replica) { return "partiemc.ask." + replica; }
inline std::string SubjectOfAnswers(const std::string& replica) {
  return "partiemc.for." + replica;
}
/// New results of a stream.
inline std::string SubjectOfResults(const std::string& stream_id) {
  return "partiemc.results." + stream_id;
}

}  // namespace partiemc::server
