// Bytes that this process's connections have received.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace partiemc::server {

/// Returns the number of bytes that each open TCP connection of this process has received. The key
/// is the peer in gRPC's format: "ipv4:192.0.2.7:51234", "ipv6:%5B2001:db8::1%5D:51234". Empty if
/// the system does not report the numbers. Cost: two system calls for each open descriptor.
std::map<std::string, std::uint64_t> ReceivedBytesOfConnections();

}  // namespace partiemc::server
