#include "server/security/peer_accounts.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <map>

#include "common/mutex.h"

namespace partiemc::server {

struct PeerAccounts::Known {
  Mutex mutex;
  std::map<std::string, std::weak_ptr<CallerAccount>> accounts ABSL_GUARDED_BY(mutex);
};

namespace {

// Returns the /64 network of an IPv6 address: "[2001:db8::1]" -> "2001:db8::". Returns other
// addresses, also IPv4 addresses mapped to IPv6, without brackets and zone.
std::string NetworkOf(std::string_view host) {
  // Removes brackets and zone, because gRPC writes IPv6 addresses as in a URI.
  for (const std::string_view before : {"[", "%5B"}) {
    if (host.starts_with(before)) host.remove_prefix(before.size());
  }
  host = host.substr(0, std::min(host.find('%'), host.find(']')));
  std::array<std::uint8_t, 16> address{};
  if (inet_pton(AF_INET6, std::string(host).c_str(), address.data()) != 1) return std::string(host);
  if (IN6_IS_ADDR_V4MAPPED(reinterpret_cast<const in6_addr*>(address.data()))) {
    return std::string(host);
  }
  std::fill(address.begin() + 8, address.end(), std::uint8_t{0});
  std::array<char, INET6_ADDRSTRLEN> text{};
  return inet_ntop(AF_INET6, address.data(), text.data(), text.size());
}

}  // namespace

std::string HostOfPeer(std::string_view peer) {
  if (peer.starts_with("unix")) return "unix";
  const std::string_view host = peer.substr(0, peer.rfind(':'));
  if (peer.starts_with("ipv4:")) return std::string(host);
  if (peer.starts_with("ipv6:")) return "ipv6:" + NetworkOf(host.substr(5));
  return std::string(peer);
}

std::shared_ptr<PeerAccounts::Known> PeerAccounts::MakeKnown() { return std::make_shared<Known>(); }

std::shared_ptr<CallerAccount> PeerAccounts::Of(std::string_view peer) {
  std::string key = HostOfPeer(peer);
  const MutexLock lock(known_->mutex);
  std::weak_ptr<CallerAccount>& known = known_->accounts[key];
  if (auto account = known.lock()) return account;
  // The deleter of the account also removes its entry from the map, unless the entry already
  // contains a new account of the peer.
  const auto forget = [all = known_, key = std::move(key)](CallerAccount* account) {
    delete account;
    const MutexLock forgetting(all->mutex);
    const auto found = all->accounts.find(key);
    if (found != all->accounts.end() && found->second.expired()) all->accounts.erase(found);
  };
  std::shared_ptr<CallerAccount> account(new CallerAccount(quota_), forget);
  known = account;
  return account;
}

std::size_t PeerAccounts::size() const {
  const MutexLock lock(known_->mutex);
  return known_->accounts.size();
}

}  // namespace partiemc::server
