#include "server/security/tls_identity.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cerrno>
#include <cstdio>
#include <ctime>
#include <memory>
#include <system_error>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

template <auto kFree>
struct Free {
  void operator()(auto* object) const { kFree(object); }
};
using Bio = std::unique_ptr<BIO, Free<BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Free<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
using File = std::unique_ptr<std::FILE, Free<std::fclose>>;

// Maximum size of a file of secrets or certificates, far above the size of real files.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

absl::Status Wrong(const std::string& flag, const std::string& path, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(flag, " ", path, ": ", what));
}

Bio Reading(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

// Password callback of OpenSSL. It fails, so keys with a passphrase are refused; without it OpenSSL
// would prompt on the terminal.
int NoPassphrase(char*, int, int, void*) { return -1; }

// Parses the first certificate of a PEM file.
absl::StatusOr<Certificate> ParseCertificate(const std::string& flag, const std::string& path,
                                             const std::string& text) {
  const Bio bio = Reading(text);
  Certificate certificate(PEM_read_bio_X509(bio.get(), nullptr, NoPassphrase, nullptr));
  ERR_clear_error();
  if (certificate == nullptr) return Wrong(flag, path, "must hold a certificate in PEM");
  return certificate;
}

absl::StatusOr<Key> ParseKey(const std::string& path, const std::string& text) {
  const Bio bio = Reading(text);
  Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, NoPassphrase, nullptr));
  ERR_clear_error();
  if (key == nullptr) {
    return Wrong("--tls-key", path, "must hold a private key in PEM, without a passphrase");
  }
  return key;
}

std::chrono::system_clock::time_point NotAfter(const X509& certificate) {
  std::tm time{};
  ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &time);
  return std::chrono::system_clock::from_time_t(timegm(&time));
}

}  // namespace

std::vector<std::string> TlsFiles::All() const {
  std::vector<std::string> files = {certificate, key};
  if (!client_ca.empty()) files.push_back(client_ca);
  return files;
}

absl::StatusOr<std::string> ReadSmallFile(const std::string& flag, const std::string& path) {
  const File file(std::fopen(path.c_str(), "rb"));
  if (file == nullptr) {
    return Wrong(flag, path,
                 absl::StrCat("cannot be read: ", std::generic_category().message(errno)));
  }
  std::string text(kMaxFileBytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file.get()));
  if (std::ferror(file.get()) != 0) return Wrong(flag, path, "cannot be read: is it a file?");
  if (text.size() > kMaxFileBytes) return Wrong(flag, path, "must be at most 1 MiB");
  return text;
}

absl::StatusOr<TlsIdentity> ReadTlsIdentity(const TlsFiles& files) {
  TlsIdentity identity;
  for (const auto& [flag, path, text] :
       {std::tuple("--tls-cert", &files.certificate, &identity.certificate),
        std::tuple("--tls-key", &files.key, &identity.key),
        std::tuple("--tls-client-ca", &files.client_ca, &identity.client_ca)}) {
    if (path->empty()) continue;
    auto read = ReadSmallFile(flag, *path);
    if (!read.ok()) return read.status();
    *text = *std::move(read);
  }
  const auto certificate = ParseCertificate("--tls-cert", files.certificate, identity.certificate);
  if (!certificate.ok()) return certificate.status();
  const auto key = ParseKey(files.key, identity.key);
  if (!key.ok()) return key.status();
  if (X509_check_private_key(certificate->get(), key->get()) != 1) {
    ERR_clear_error();
    return Wrong("--tls-key", files.key,
                 absl::StrCat("must be the key of --tls-cert ", files.certificate));
  }
  if (!files.client_ca.empty()) {
    const auto authority = ParseCertificate("--tls-client-ca", files.client_ca, identity.client_ca);
    if (!authority.ok()) return authority.status();
  }
  identity.not_after = NotAfter(**certificate);
  return identity;
}

}  // namespace partiemc::server
