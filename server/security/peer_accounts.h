// The accounts of callers without a token, one per peer.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "server/security/caller.h"

namespace partiemc::server {

/// "ipv4:192.0.2.7:51234" -> "ipv4:192.0.2.7". Of IPv6 addresses only the first 64
/// bits, because one host can use all addresses with this prefix: "ipv6:[2001:db8::1]:51234" ->
/// "ipv6:2001:db8::". All peers of Unix sockets are "unix".
std::string HostOfPeer(std::string_view peer);

/// Thread-safe.
class PeerAccounts {
 public:
  explicit PeerAccounts(CallerQuota quota) : quota_(quota) {}

  /// The account of a peer, ignoring its port. It exists while a caller holds it.
  std::shared_ptr<CallerAccount> Of(std::string_view peer);

  /// Number of held accounts.
  std::size_t size() const;

 private:
  struct Known;

  const CallerQuota quota_;
  const std::shared_ptr<Known> known_ =
      MakeKnown();  // Shared with the accounts, which may outlive this.

  static std::shared_ptr<Known> MakeKnown();
};

}  // namespace partiemc::server
