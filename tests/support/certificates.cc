#include "support/certificates.h"

#include <gtest/gtest.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <atomic>

namespace partiemc {
namespace {

template <auto kFree>
struct Free {
  void operator()(auto* object) const { kFree(object); }
};
using Bio = std::unique_ptr<BIO, Free<BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Free<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;

constexpr long kHour = 3600;

std::string Text(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

std::string ToPem(X509* certificate) {
  const Bio bio(BIO_new(BIO_s_mem()));
  EXPECT_EQ(PEM_write_bio_X509(bio.get(), certificate), 1);
  return Text(bio.get());
}

std::string ToPem(EVP_PKEY* key) {
  const Bio bio(BIO_new(BIO_s_mem()));
  EXPECT_EQ(PEM_write_bio_PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr), 1);
  return Text(bio.get());
}

void AddExtension(X509& certificate, int what, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, &certificate, &certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, what, value);
  ASSERT_NE(extension, nullptr) << value;
  EXPECT_EQ(X509_add_ext(&certificate, extension, -1), 1);
  X509_EXTENSION_free(extension);
}

// Unsigned.
Certificate MakeCertificate(const std::string& name, EVP_PKEY* key, long seconds_left) {
  static std::atomic<long> serial = 1;
  Certificate certificate(X509_new());
  X509_set_version(certificate.get(), X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), serial++);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), std::min(0l, seconds_left) - kHour);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), seconds_left);
  X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate.get()), "CN", MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1, 0);
  X509_set_pubkey(certificate.get(), key);
  return certificate;
}

}  // namespace

struct CertificateAuthority::Signer {
  Key key;
  Certificate certificate;
};

CertificateAuthority::CertificateAuthority(const std::string& name)
    : signer_(std::make_unique<Signer>()) {
  signer_->key.reset(EVP_EC_gen("P-256"));
  signer_->certificate = MakeCertificate(name, signer_->key.get(), kHour);
  X509& certificate = *signer_->certificate;
  X509_set_issuer_name(&certificate, X509_get_subject_name(&certificate));
  AddExtension(certificate, NID_basic_constraints, "critical,CA:TRUE");
  EXPECT_GT(X509_sign(&certificate, signer_->key.get(), EVP_sha256()), 0);
}

CertificateAuthority::~CertificateAuthority() = default;

std::string CertificateAuthority::certificate() const { return ToPem(signer_->certificate.get()); }

IssuedCertificate CertificateAuthority::Issue(const std::string& name,
                                              std::chrono::seconds valid_for) const {
  const Key key(EVP_EC_gen("P-256"));
  const Certificate certificate =
      MakeCertificate(name, key.get(), static_cast<long>(valid_for.count()));
  X509_set_issuer_name(certificate.get(), X509_get_subject_name(signer_->certificate.get()));
  AddExtension(*certificate, NID_subject_alt_name, "DNS:localhost,IP:127.0.0.1");
  AddExtension(*certificate, NID_ext_key_usage, "serverAuth,clientAuth");
  EXPECT_GT(X509_sign(certificate.get(), signer_->key.get(), EVP_sha256()), 0);
  return {ToPem(certificate.get()), ToPem(key.get())};
}

}  // namespace partiemc
