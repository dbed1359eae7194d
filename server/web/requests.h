// Interprets requests to the gateway. Contains pure functions of untrusted bytes.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// WebSocket subprotocol names: the protocol that the server supports, and the prefix of the name
/// in which a browser sends its token.
inline constexpr std::string_view kWebProtocol = "partiemc.v1";
inline constexpr std::string_view kBearerProtocol = "bearer.";

/// The relevant fields of a request, as views into it. A repeated header has one entry for each
/// occurrence, because programs differ in which occurrence they use.
struct WebRequest {
  std::string_view method, target;
  std::vector<std::string_view> hosts, origins, authorizations, protocols, transfer_encodings;
  std::string_view content_type, accept_encoding, if_none_match;
  bool is_upgrade = false;  ///< Upgrade to WebSocket.
  bool has_body = false;
  bool is_before_1_1 = false;  ///< HTTP/1.0.
};

struct WebRules {
  /// WebOptions::origins in the form of NormalOrigin.
  std::vector<std::string> origins = {};
  /// WebOptions::hosts in the form of NormalHostName.
  std::vector<std::string> hosts = {};
  /// Whether the server listens on a loopback address only.
  bool is_local = true;
  /// Whether requests may name any host (IsHostAllowed).
  bool any_host = false;
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

/// A call of a method. WebMethod::kWatch and kReconstruct are called over a WebSocket, the other
/// methods by POST.
struct WebCall {
  WebMethod method = WebMethod::kInfo;
  std::optional<std::string> authorization = {};  ///< See CallOrigin::authorization.
  bool from_page = false;  ///< Has an Origin header, so a browser sent it (MakeSocketCall).
};

/// A file of the page. `path` is relative to the root: names separated by '/', none of which begins
/// with a dot.
struct WebFile {
  std::string path;
  bool head_only = false, takes_gzip = false;
};

struct WebHealth {
  bool head_only = false;
};

/// A CORS preflight: with this request a browser checks whether a page of another origin may POST
/// to this server.
struct WebPreflight {};

struct WebRefused {
  WebRefusal refusal = WebRefusal::kMalformed;
  unsigned http_status = 400;
  std::string field;       ///< Name of a header, or "method", "path", "request" and the like.
  std::string value;       ///< Printable, at most 100 bytes of the request, without secrets.
  std::string rule;        ///< The broken rule, a sentence of one line.
  std::string allow = {};  ///< Allowed methods; set for 405.
};

/// The refusal for the log. Its reason is the name in the metrics.
absl::Status ToStatus(const WebRefused& refused);

struct WebAnswer {
  std::variant<WebRefused, WebHealth, WebFile, WebPreflight, WebCall> what;
  /// If not empty, the origin of the page that sent the request and may read the response.
  std::string allowed_origin = {};
};

WebAnswer Understand(const WebRequest& request, const WebRules& rules);

/// Whether a request may name `host`. Unless `rules` allow any host, it may name localhost, a
/// loopback address, one of the hosts of `rules`, or the host of an origin in `rules`. If the
/// server listens on another than a loopback address, the request may also name any IP address.
/// This prevents DNS rebinding, in which a page whose name resolves to the server's address reads
/// the server's responses.
bool IsHostAllowed(std::string_view host, const WebRules& rules);

/// Whether a page of `origin` may call the server under the name `host`. It may if the origin is
/// one of the origins in `rules`. It also may if the origin has the host and port of `host`, and
/// `host` is allowed (IsHostAllowed).
bool IsOriginAllowed(std::string_view origin, std::string_view host, const WebRules& rules);

/// Returns the decoded path of a file of the page, without the query; "index.html" for "/". Returns
/// nothing for paths that could leave the folder, for hidden names and for unusual characters.
std::optional<std::string> FilePathOf(std::string_view target);

/// The subprotocols that a WebSocket request offers: whether kWebProtocol is one of them, and the
/// tokens.
struct OfferedProtocols {
  bool ours = false;
  std::vector<std::string> tokens = {};
  bool is_malformed = false;  ///< A token is invalid, or there are several.
};
OfferedProtocols ParseProtocols(const std::vector<std::string_view>& headers);

/// Decodes base64url without padding (RFC 4648). Returns nothing for malformed text; unused bits
/// must be 0.
std::optional<std::string> DecodeBase64Url(std::string_view text);

/// Whether `accept_encoding` lists "gzip" with a weight other than 0.
bool AcceptsGzip(std::string_view accept_encoding);

/// Returns the origin in normal form: "https://host[:port]" or "http://host[:port]" in lower case,
/// without the scheme's default port. Errors: INVALID_ARGUMENT unless `text` is an origin.
absl::StatusOr<std::string> NormalOrigin(std::string_view text);

/// Returns a host name or address (IPv6 in brackets) in lower case. Errors: INVALID_ARGUMENT for
/// any other text, such as a name with a port.
absl::StatusOr<std::string> NormalHostName(std::string_view text);

}  // namespace partiemc::server
