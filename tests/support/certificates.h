// Certificates for tests: authorities, and certificates they sign at run time.
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

  /// The authority's own certificate, PEM.
  std::string certificate() const;

  /// For localhost and 127.0.0.1, as server and client. Valid since an hour ago, or since before
  /// its end if that is in the past.
  IssuedCertificate Issue(const std::string& name,
                          std::chrono::seconds valid_for = std::chrono::hours(1)) const;

 private:
  struct Signer;
  std::unique_ptr<Signer> signer_;
};

}  // namespace partiemc
