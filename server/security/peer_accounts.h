// The accounts of callers without a token: one for each peer.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "server/security/caller.h"

namespace partiemc::server {

/// "ipv4:192.0.2.7:51234" -> "ipv4:192.0.2.7". Of IPv6 the first 64 bits, as one host may have all
/// addresses that begin with them: "ipv6:[2001:db8::1]:51234" -> "ipv6:2001:db8::". All who come
/// over a Unix socket are "unix".
std::string HostOfPeer(std::string_view peer);

/// Safe from any thread.
class PeerAccounts {
 public:
  explicit PeerAccounts(CallerQuota quota) : quota_(quota) {}

  /// That of the peer without its port. It is the same one for as long as anybody holds it, and
  /// forgotten after that.
  std::shared_ptr<CallerAccount> Of(std::string_view peer);

  /// Accounts that are held by somebody.
  std::size_t size() const;

 private:
  struct Known;

  const CallerQuota quota_;
  const std::shared_ptr<Known> known_ =
      MakeKnown();  // Of the accounts too, which may outlive this.

  static std::shared_ptr<Known> MakeKnown();
};

}  // namespace partiemc::server
