// Certificates for tests: authorities and what they sign, made on the spot.
#pragma once

#include <chrono>
#include <memory>
#include <string>

namespace partiemc {

/// PEM.
struct IssuedCertificate {
  std::string certificate, key;
};

class CertificateAuthority {
 public:
  explicit CertificateAuthority(const std::string& name);
  ~CertificateAuthority();

  /// Its own certificate, PEM.
  std::string certificate() const;

  /// For localhost and 127.0.0.1, as server and as client; valid since an hour before now, or
  /// before its end where that has passed already.
  IssuedCertificate Issue(const std::string& name,
                          std::chrono::seconds valid_for = std::chrono::hours(1)) const;

 private:
  struct Signer;
  std::unique_ptr<Signer> signer_;
};

}  // namespace partiemc
