// Reads and checks the files of a server's TLS identity: certificate, key and client authority.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "common/mutex.h"

namespace partiemc::server {

struct TlsFiles {
  std::string certificate;  ///< PEM: the certificate of the server, then the intermediate ones.
  std::string key;          ///< PEM, without a passphrase.
  /// PEM: certificate authorities that may sign client certificates. Empty: clients need no
  /// certificate.
  std::string client_ca;

  /// Returns the paths of the certificate, the key and, if set, the client authorities.
  std::vector<std::string> All() const;
};

/// The contents of the files, as PEM.
struct TlsIdentity {
  std::string certificate, key, client_ca;
  std::chrono::system_clock::time_point
      not_after;  ///< End of validity of the server's certificate.
};

/// The current identity. Thread-safe.
class CurrentTlsIdentity {
 public:
  struct Version {
    std::uint64_t number = 0;  ///< Number of calls of Set; 0: `identity` is null.
    std::shared_ptr<const TlsIdentity> identity;
  };

  void Set(TlsIdentity identity) {
    auto next = std::make_shared<const TlsIdentity>(std::move(identity));
    const MutexLock lock(mutex_);
    version_ = {version_.number + 1, std::move(next)};
  }
  Version Get() const {
    const MutexLock lock(mutex_);
    return version_;
  }

 private:
  mutable Mutex mutex_;
  Version version_ ABSL_GUARDED_BY(mutex_);
};

/// Reads the files. Checks that certificate and key match, and that client_ca begins with a
/// certificate. Accepts an expired certificate: clients refuse it, and the operator can replace it
/// at run time. Errors: INVALID_ARGUMENT with flag, file and problem, without content of the file.
absl::StatusOr<TlsIdentity> ReadTlsIdentity(const TlsFiles& files);

/// Reads a file of secrets or certificates.
/// Errors: INVALID_ARGUMENT with `flag` and `path` if the file is unreadable or larger than 1 MiB.
absl::StatusOr<std::string> ReadSmallFile(const std::string& flag, const std::string& path);

}  // namespace partiemc::server
