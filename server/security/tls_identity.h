// The certificate, key and client authority of a server, read from files and checked.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

struct TlsFiles {
  std::string certificate;  ///< PEM: the server's own first, then those between it and its root.
  std::string key;          ///< PEM, without a passphrase.
  /// PEM: authorities, one of which must have signed a client's certificate. Empty: clients need
  /// none.
  std::string client_ca;

  /// Those that are given.
  std::vector<std::string> All() const;
};

/// What the files hold, as PEM.
struct TlsIdentity {
  std::string certificate, key, client_ca;
  std::chrono::system_clock::time_point not_after;  ///< Of the server's own certificate.
};

/// The identity in force. Safe from any thread.
class CurrentTlsIdentity {
 public:
  struct Version {
    std::uint64_t number = 0;  ///< One more for each change; 0: none yet.
    std::shared_ptr<const TlsIdentity> identity;
  };

  void Set(TlsIdentity identity) {
    auto next = std::make_shared<const TlsIdentity>(std::move(identity));
    const std::lock_guard lock(mutex_);
    version_ = {version_.number + 1, std::move(next)};
  }
  Version Get() const {
    const std::lock_guard lock(mutex_);
    return version_;
  }

 private:
  mutable std::mutex mutex_;
  Version version_;
};

/// Reads the files and checks that they fit: a certificate, the key that belongs to it, and at
/// least one authority where they are asked for. One that has expired is no error: clients refuse
/// it, and a server that runs on can be given a new one.
/// Errors: INVALID_ARGUMENT, a line that names the flag, the file, and what is wrong with it; never
/// what is in it.
absl::StatusOr<TlsIdentity> ReadTlsIdentity(const TlsFiles& files);

/// A whole file of secrets or certificates.
/// Errors: INVALID_ARGUMENT, names `flag` and `path`: cannot be read, or is above 1 MiB.
absl::StatusOr<std::string> ReadSmallFile(const std::string& flag, const std::string& path);

}  // namespace partiemc::server
