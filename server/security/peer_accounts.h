// The accounts of callers without a token: one account for each host (HostOfPeer).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "server/security/caller.h"

namespace partiemc::server {

/// Returns the host of a peer, without its port: "ipv4:192.0.2.7:51234" -> "ipv4:192.0.2.7". Keeps
/// only the first 64 bits of an IPv6 address, because one host can use all addresses with this
/// prefix: "ipv6:[2001:db8::1]:51234" -> "ipv6:2001:db8::". Keeps all bits of an IPv4-mapped IPv6
/// address. Returns "unix" for all peers of Unix sockets, and other texts unchanged.
std::string HostOfPeer(std::string_view peer);

/// Thread-safe.
class PeerAccounts {
 public:
  explicit PeerAccounts(CallerQuota quota) : quota_(quota) {}

  /// Returns the account of a peer's host (HostOfPeer). An account exists while a caller holds it.
  std::shared_ptr<CallerAccount> Of(std::string_view peer);

  /// Number of accounts that exist.
  std::size_t size() const;

 private:
  struct Known;

  const CallerQuota quota_;
  const std::shared_ptr<Known> known_ =
      MakeKnown();  // Shared with the accounts, which may outlive this.

  static std::shared_ptr<Known> MakeKnown();
};

}  // namespace partiemc::server
