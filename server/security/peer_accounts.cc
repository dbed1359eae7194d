#include "server/security/peer_accounts.h"

#include <map>
#include <mutex>

namespace partiemc::server {

struct PeerAccounts::Known {
  std::mutex mutex;
  std::map<std::string, std::weak_ptr<CallerAccount>> accounts;  // Guarded by mutex.
};

std::string PeerWithoutPort(std::string_view peer) {
  if (peer.starts_with("unix")) return "unix";
  if (!peer.starts_with("ipv4:") && !peer.starts_with("ipv6:")) return std::string(peer);
  return std::string(peer.substr(0, peer.rfind(':')));
}

std::shared_ptr<PeerAccounts::Known> PeerAccounts::MakeKnown() { return std::make_shared<Known>(); }

std::shared_ptr<CallerAccount> PeerAccounts::Of(std::string_view peer) {
  std::string key = PeerWithoutPort(peer);
  const std::lock_guard lock(known_->mutex);
  std::weak_ptr<CallerAccount>& known = known_->accounts[key];
  if (auto account = known.lock()) return account;
  // The last who holds it forgets it, unless the peer has come again since.
  const auto forget = [all = known_, key = std::move(key)](CallerAccount* account) {
    delete account;
    const std::lock_guard forgetting(all->mutex);
    const auto found = all->accounts.find(key);
    if (found != all->accounts.end() && found->second.expired()) all->accounts.erase(found);
  };
  std::shared_ptr<CallerAccount> account(new CallerAccount(quota_), forget);
  known = account;
  return account;
}

std::size_t PeerAccounts::size() const {
  const std::lock_guard lock(known_->mutex);
  return known_->accounts.size();
}

}  // namespace partiemc::server
