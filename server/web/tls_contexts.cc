#include "server/web/tls_contexts.h"

#include <openssl/ssl.h>

#include <boost/asio/buffer.hpp>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

namespace ssl = boost::asio::ssl;

// ALPN callback of OpenSSL: selects HTTP/1.1 if the client offers it. Otherwise the connection
// continues without ALPN. The gateway does not support HTTP/2.
int ChooseProtocol(SSL*, const unsigned char** out, unsigned char* out_bytes,
                   const unsigned char* offered, unsigned int offered_bytes, void*) {
  static constexpr std::string_view kOurs = "\x08http/1.1";
  unsigned char* chosen = nullptr;
  if (SSL_select_next_proto(
          &chosen, out_bytes, reinterpret_cast<const unsigned char*>(kOurs.data()),
          static_cast<unsigned>(kOurs.size()), offered, offered_bytes) != OPENSSL_NPN_NEGOTIATED) {
    return SSL_TLSEXT_ERR_NOACK;
  }
  *out = chosen;
  return SSL_TLSEXT_ERR_OK;
}

std::shared_ptr<ssl::context> Make(const TlsIdentity& identity, bool asks_clients,
                                   boost::system::error_code& error) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  SSL_CTX* const handle = context->native_handle();
  SSL_CTX_set_min_proto_version(handle, TLS1_2_VERSION);
  SSL_CTX_set_options(handle, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_NO_TICKET);
  SSL_CTX_set_session_cache_mode(handle, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_mode(handle, SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_alpn_select_cb(handle, &ChooseProtocol, nullptr);
  context->use_certificate_chain(boost::asio::buffer(identity.certificate), error);
  if (!error) {
    context->use_private_key(boost::asio::buffer(identity.key), ssl::context::pem, error);
  }
  if (asks_clients) {
    if (!error) {
      context->add_certificate_authority(boost::asio::buffer(identity.client_ca), error);
    }
    if (!error) {
      context->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert, error);
    }
  }
  return context;
}

}  // namespace

TlsContexts::TlsContexts(const CurrentTlsIdentity& current)
    : current_(current), asks_clients_(!current.Get().identity->client_ca.empty()) {}

std::shared_ptr<ssl::context> TlsContexts::Get() {
  const CurrentTlsIdentity::Version version = current_.Get();
  if (version.number == version_) return context_;
  boost::system::error_code error;
  auto context = Make(*version.identity, asks_clients_, error);
  version_ = version.number;
  if (error) {
    error_ = error.message();
    LogEvent(spdlog::level::warn, "TLS identity is not taken by the gateway", {{"error", error_}});
  } else {
    context_ = std::move(context);
  }
  return context_;
}

absl::Status TlsContexts::Check() {
  if (Get() != nullptr) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--tls-cert and --tls-key cannot be used by --web: ", error_));
}

}  // namespace partiemc::server
