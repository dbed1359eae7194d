// Interprets requests to the gateway. Pure functions of untrusted bytes.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// The subprotocol that the server supports, and the prefix of a browser's token.
inline constexpr std::string_view kWebProtocol = "partiemc.v1";
inline constexpr std::string_view kBearerProtocol = "bearer.";

/// Relevant fields of a request, as views into it. A repeated header has one entry per occurrence,
/// because readers differ in which one they use.
struct WebRequest {
  std::string_view method, target;
  std::vector<std::string_view> hosts, origins, authorizations, protocols, transfer_encodings;
  std::string_view content_type, accept_encoding, if_none_match;
  bool is_upgrade = false;  ///< Upgrade to WebSocket.
  bool has_body = false;
};

/// Rules for allowed hosts and origins.
struct WebRules {
  /// See WebOptions::origins.
  std::vector<std::string> origins = {};
  /// See WebOptions::hosts.
  std::vector<std::string> hosts = {};
  /// The server listens on a loopback address only.
  bool is_local = true;
};

/// Kinds of refusals; the metrics use these names.
enum class WebRefusal {
  kFull,        ///< A connection was evicted, or has a reserved slot and is not a health check.
  kTimeout,     ///< Handshake, request or reading of the response took too long.
  kMalformed,   ///< Not HTTP, or not a supported request.
  kOrigin,      ///< A page of a foreign origin.
  kHost,        ///< A host name that is not allowed.
  kCall,        ///< A call that was refused: token, limits, drain.
  kTooLarge,    ///< A message above the limit.
  kBadMessage,  ///< Not a WebSocket message, or not a supported one.
};
inline constexpr std::size_t kWebRefusals = 8;
std::string_view Name(WebRefusal refusal);

enum class WebMethod { kInfo, kStreams, kFrame, kWatch, kReconstruct };

/// A call of a method: WebMethod::kWatch and kReconstruct over a WebSocket, the others by POST.
struct WebCall {
  WebMethod method = WebMethod::kInfo;
  std::optional<std::string> authorization = {};  ///< See CallOrigin::authorization.
  bool from_page = false;  ///< From a browser, which does not read the body of a refusal.
};

/// A file under the root: names with '/' between them, none of which begins with a dot.
struct WebFile {
  std::string path;
  bool head_only = false, takes_gzip = false;
};

struct WebHealth {
  bool head_only = false;
};

/// A browser's request whether a page of another host may POST (CORS preflight).
struct WebPreflight {};

struct WebRefused {
  WebRefusal refusal = WebRefusal::kMalformed;
  unsigned http_status = 400;
  std::string rule;        ///< The broken rule, one line.
  std::string allow = {};  ///< Allowed methods; set for 405.
};

struct WebAnswer {
  std::variant<WebRefused, WebHealth, WebFile, WebPreflight, WebCall> what;
  /// Origin of a page on another host that may read the response.
  std::string allowed_origin = {};
};

WebAnswer Understand(const WebRequest& request, const WebRules& rules);

/// True if a request may name `host`. A server on a loopback address accepts names and addresses of
/// this machine, the hosts of the rules, and the hosts of their origins. Otherwise a page whose
/// name resolves to 127.0.0.1 could read the server's responses (DNS rebinding).
bool IsHostAllowed(std::string_view host, const WebRules& rules);

/// True if a page of `origin` may call the server under the name `host`: the same host and port, or
/// one of the rules' origins. The host must be allowed (IsHostAllowed).
bool IsOriginAllowed(std::string_view origin, std::string_view host, const WebRules& rules);

/// The decoded path of a file below a folder, without the query; "index.html" for "/". Empty for
/// paths that could leave the folder, hidden names and unusual characters.
std::optional<std::string> FilePathOf(std::string_view target);

/// The parsed subprotocols of a WebSocket request: kWebProtocol and tokens.
struct OfferedProtocols {
  bool ours = false;
  std::vector<std::string> tokens = {};
  bool is_malformed = false;
};
OfferedProtocols ParseProtocols(const std::vector<std::string_view>& headers);

/// Decodes base64url without padding (RFC 4648); unused bits must be 0. Empty for malformed text.
std::optional<std::string> DecodeBase64Url(std::string_view text);

/// True if `accept_encoding` lists "gzip" with a weight other than 0.
bool AcceptsGzip(std::string_view accept_encoding);

/// "https://host[:port]" in lower case, without the scheme's default port. Errors: INVALID_ARGUMENT
/// unless `text` is an origin.
absl::StatusOr<std::string> NormalOrigin(std::string_view text);

/// A host name or address in lower case. Errors: INVALID_ARGUMENT for anything else, such as a name
/// with a port.
absl::StatusOr<std::string> NormalHostName(std::string_view text);

}  // namespace partiemc::server
