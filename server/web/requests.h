// What a request to the gateway asks for. Pure functions of bytes that strangers send.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// The subprotocol that the server speaks, and what a browser's token stands behind.
inline constexpr std::string_view kWebProtocol = "partiemc.v1";
inline constexpr std::string_view kBearerProtocol = "bearer.";

/// What of a request counts; views into it. A header that came several times stands there as
/// often, as which of them is meant would depend on who reads it.
struct WebRequest {
  std::string_view method, target;
  std::vector<std::string_view> hosts, origins, authorizations, protocols, transfer_encodings;
  std::string_view content_type, accept_encoding, if_none_match;
  bool is_upgrade = false;  ///< To a WebSocket.
  bool has_body = false;
};

/// Who may ask.
struct WebRules {
  /// As WebOptions::origins.
  std::vector<std::string> origins = {};
  /// As WebOptions::hosts.
  std::vector<std::string> hosts = {};
  /// The server listens on a loopback address only.
  bool is_local = true;
};

/// The refusals that the metrics count, by these names.
enum class WebRefusal {
  kFull,        ///< A connection was evicted, or has a reserved slot and is no health check.
  kTimeout,     ///< No handshake, or no request, in time; or nobody takes what is sent.
  kMalformed,   ///< No HTTP, or none of ours.
  kOrigin,      ///< A page of somebody else.
  kHost,        ///< A host name that is not this machine's.
  kCall,        ///< A call that is not let in: token, limits, drain.
  kTooLarge,    ///< A message above the limit.
  kBadMessage,  ///< No WebSocket message, or none of ours.
};
inline constexpr std::size_t kWebRefusals = 8;
std::string_view Name(WebRefusal refusal);

enum class WebMethod { kInfo, kStreams, kFrame, kWatch, kReconstruct };

/// A call of a method: WebMethod::kWatch and kReconstruct over a WebSocket, the others by POST.
struct WebCall {
  WebMethod method = WebMethod::kInfo;
  std::optional<std::string> authorization = {};  ///< As CallOrigin::authorization.
  bool from_page = false;                         ///< A browser's: it reads no body of a refusal.
};

/// A file under the root: names with '/' between them, none of which begins with a dot.
struct WebFile {
  std::string path;
  bool head_only = false, takes_gzip = false;
};

struct WebHealth {
  bool head_only = false;
};

/// A browser's question whether a page of another host may POST.
struct WebPreflight {};

struct WebRefused {
  WebRefusal refusal = WebRefusal::kMalformed;
  unsigned http_status = 400;
  std::string rule;        ///< What was asked for, one line.
  std::string allow = {};  ///< For 405: the methods.
};

struct WebAnswer {
  std::variant<WebRefused, WebHealth, WebFile, WebPreflight, WebCall> what;
  /// The page's origin, where it is another host's and may read the answer.
  std::string allowed_origin = {};
};

WebAnswer Understand(const WebRequest& request, const WebRules& rules);

/// Whether a request may name `host`. A server on a loopback address accepts names and addresses of
/// this machine, the hosts of the rules, and the hosts of their origins. Otherwise a page whose
/// name resolves to 127.0.0.1 could read what the server sends (DNS rebinding).
bool IsHostAllowed(std::string_view host, const WebRules& rules);

/// Whether a page of `origin` may ask the server that it calls `host`: the same host and port, or
/// one of the rules' origins. The host must be allowed (IsHostAllowed).
bool IsOriginAllowed(std::string_view origin, std::string_view host, const WebRules& rules);

/// The path of a file below a folder: without the query, decoded, "index.html" for "/". Nothing for
/// what could leave the folder, for hidden names and for unusual characters.
std::optional<std::string> FilePathOf(std::string_view target);

/// What the subprotocols of a WebSocket say: whether they offer kWebProtocol, and the tokens.
struct OfferedProtocols {
  bool ours = false;
  std::vector<std::string> tokens = {};
  bool is_malformed = false;
};
OfferedProtocols ParseProtocols(const std::vector<std::string_view>& headers);

/// base64url without padding (RFC 4648), of bits that are left over 0. Nothing for anything else.
std::optional<std::string> DecodeBase64Url(std::string_view text);

/// Whether "gzip" is among what is accepted, with a weight other than 0.
bool AcceptsGzip(std::string_view accept_encoding);

/// "https://host[:port]" in lower case, the scheme's usual port left out.
/// Errors: INVALID_ARGUMENT for what is no origin.
absl::StatusOr<std::string> NormalOrigin(std::string_view text);

/// A host name or address in lower case. Errors: INVALID_ARGUMENT for anything else, such as a name
/// with a port.
absl::StatusOr<std::string> NormalHostName(std::string_view text);

}  // namespace partiemc::server
