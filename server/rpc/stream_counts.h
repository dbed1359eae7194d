// Reads the numbers of streams and messages that gRPC has counted for a connection.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/connections/connection_watch.h"

namespace partiemc::server {

/// Reads channelz, the statistics that gRPC keeps for every connection. Used by one thread.
class ChannelzStreams final : public StreamCounter {
 public:
  /// Reads the connections of the gRPC server that was built last in this process.
  ChannelzStreams();

  bool Read(const std::string& peer, std::int64_t& socket, ConnectionReading& reading) override;

 private:
  std::int64_t Find(const std::string& peer);

  std::int64_t server_ = 0;
  std::int64_t next_socket_ = 0;                // Sockets with smaller numbers were listed.
  std::map<std::string, std::int64_t> listed_;  // By peer, until Find returns them; may be closed.
};

}  // namespace partiemc::server
