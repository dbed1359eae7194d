#include "server/web/requests.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "common/address.h"
#include "common/printable.h"
#include "common/text.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

constexpr char kMessageType[] = "application/x-protobuf";
constexpr std::string_view kCalls = "/v1/";
constexpr std::size_t kMostPathBytes = 1024;
constexpr std::size_t kMostValueBytes = 100;  // Of a refused value in the log.
constexpr char kMustBeGet[] = "the request must be a GET";

struct Route {
  std::string_view path;
  WebMethod method;
  bool is_socket;
};
constexpr std::array kRoutes = {
    Route{"/v1/info", WebMethod::kInfo, false}, Route{"/v1/streams", WebMethod::kStreams, false},
    Route{"/v1/frame", WebMethod::kFrame, false}, Route{"/v1/watch", WebMethod::kWatch, true},
    Route{"/v1/reconstruct", WebMethod::kReconstruct, true}};

// HTTP's optional white space.
constexpr std::string_view kSpace = " \t";

std::string Lower(std::string_view text) { return absl::AsciiStrToLower(std::string(text)); }

// A part of a request with its name, for the log.
struct NamedValue {
  std::string field, value;
};

// Makes a value of the request printable and short. A name and a password before '@' and a query
// are left out, because they may be secrets.
NamedValue PrintableValue(std::string field, std::string_view value) {
  value = value.substr(0, value.find('?'));
  if (const auto at = value.rfind('@'); at != std::string_view::npos) value.remove_prefix(at + 1);
  std::string shown = Printable(value.substr(0, kMostValueBytes));
  if (value.size() > kMostValueBytes) shown += "...";
  return {std::move(field), shown.empty() ? "empty" : std::move(shown)};
}

NamedValue HeaderCount(std::string field, std::size_t headers) {
  return {std::move(field), absl::StrCat(headers, headers == 1 ? " header" : " headers")};
}

WebAnswer RefusedAs(WebRefusal refusal, unsigned status, NamedValue part, std::string rule,
                    std::string allow = {}) {
  return {.what = WebRefused{refusal, status, std::move(part.field), std::move(part.value),
                             std::move(rule), std::move(allow)}};
}

// A request whose HTTP method is not one of `allow`.
WebAnswer RefusedMethod(const WebRequest& request, std::string rule, std::string allow) {
  return RefusedAs(WebRefusal::kMalformed, 405, PrintableValue("method", request.method),
                   std::move(rule), std::move(allow));
}

// Returns the value of a header that occurs exactly once, otherwise nothing. Programs differ in
// which occurrence of a repeated header they use, so a repeated header is not accepted.
std::optional<std::string> OnlyOne(const std::vector<std::string_view>& values) {
  if (values.size() != 1) return std::nullopt;
  return std::string(values.front());
}

int ValueOfDigit(char c, bool hexadecimal) {
  if (absl::ascii_isdigit(static_cast<unsigned char>(c))) return c - '0';
  if (!hexadecimal) return -1;
  const char lower = absl::ascii_tolower(static_cast<unsigned char>(c));
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

std::optional<std::string> DecodePercent(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    if (text.front() != '%') {
      out += text.front();
      text.remove_prefix(1);
      continue;
    }
    if (text.size() < 3) return std::nullopt;
    const int high = ValueOfDigit(text[1], true), low = ValueOfDigit(text[2], true);
    if (high < 0 || low < 0) return std::nullopt;
    out += static_cast<char>(16 * high + low);
    text.remove_prefix(3);
  }
  return out;
}

bool IsFileCharacter(char c) {
  return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
         std::string_view("-_.~+@").find(c) != std::string_view::npos;
}

// Normalises the value of "Host", or the part of an origin after "://". Removes the port if it is
// `usual_port`, the scheme's default port. Returns nothing for text that is no host.
std::optional<std::string> NormalHost(std::string_view text, std::string_view usual_port) {
  std::string host = Lower(text);
  if (host.empty() || host.size() > 300) return std::nullopt;
  const std::size_t colon = host.rfind(':');
  const bool has_port = colon != std::string::npos && host.find(']', colon) == std::string::npos &&
                        (host.front() == '[' || host.find(':') == colon);
  const std::string_view port = has_port ? std::string_view(host).substr(colon + 1) : "";
  const std::string_view name = std::string_view(host).substr(0, has_port ? colon : host.size());
  if (name.empty() || (has_port && port.empty()) || port.size() > 5) return std::nullopt;
  if (!std::ranges::all_of(port, [](unsigned char c) { return absl::ascii_isdigit(c); })) {
    return std::nullopt;
  }
  const bool is_number = name.front() == '[';
  if (is_number != (name.back() == ']')) return std::nullopt;
  const std::string_view inner = is_number ? name.substr(1, name.size() - 2) : name;
  if (inner.empty() || !std::ranges::all_of(inner, [&](char c) {
        return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '.' ||
               c == '_' || (is_number && c == ':');
      })) {
    return std::nullopt;
  }
  if (has_port && port == usual_port) host.resize(colon);
  return host;
}

std::string_view UsualPort(std::string_view scheme) { return scheme == "https" ? "443" : "80"; }

// Returns the host without its port. An IPv6 address keeps its brackets.
std::string_view NameOf(std::string_view host) {
  return host.substr(0, host.front() == '[' ? host.find(']') + 1 : host.find(':'));
}

// Whether `name` is an IPv4 address, or an IPv6 address in brackets.
bool IsNumber(std::string_view name) {
  const bool is_six = ConsumePrefix(name, "[");
  if (is_six) name.remove_suffix(1);
  in6_addr number{};
  return inet_pton(is_six ? AF_INET6 : AF_INET, std::string(name).c_str(), &number) == 1;
}

bool IsLocalHost(std::string_view host) {
  std::string_view name = NameOf(host);
  if (ConsumePrefix(name, "[")) name.remove_suffix(1);
  return name == "localhost" || name.ends_with(".localhost") ||
         Address{.host = std::string(name), .port = 1, .unix_path = {}}.IsLocal();
}

WebAnswer SocketCallOf(const WebRequest& request, WebMethod method, bool from_page) {
  if (request.method != "GET") {
    return RefusedMethod(request, "the method must be called by GET, as a WebSocket", "GET");
  }
  if (!request.is_upgrade || request.has_body) {
    return RefusedAs(WebRefusal::kMalformed, 426,
                     {"Upgrade", request.is_upgrade ? "a request with a body" : "none"},
                     "the method must be called as a WebSocket");
  }
  OfferedProtocols offered = ParseProtocols(request.protocols);
  if (!offered.ours || offered.is_malformed) {
    // The value may contain a token.
    return RefusedAs(WebRefusal::kMalformed, 400,
                     {"Sec-WebSocket-Protocol",
                      offered.ours ? "a wrong token, or several" : "without partiemc.v1"},
                     "the request must offer the subprotocol partiemc.v1, and at most one "
                     "bearer.TOKEN beside it, TOKEN in base64url without padding");
  }
  WebCall call{.method = method, .authorization = {}, .from_page = from_page};
  if (request.authorizations.size() + offered.tokens.size() == 1) {
    call.authorization = offered.tokens.empty() ? std::string(request.authorizations.front())
                                                : "Bearer " + offered.tokens.front();
  }
  return {.what = std::move(call)};
}

WebAnswer PostCallOf(const WebRequest& request, WebMethod method, bool from_page) {
  if (request.method == "OPTIONS" && from_page) return {.what = WebPreflight{}};
  if (request.method != "POST") {
    return RefusedMethod(request, "the method must be called by POST", "POST");
  }
  const std::string_view type =
      request.content_type.substr(0, request.content_type.find_first_of("; \t"));
  if (Lower(type) != kMessageType) {
    return RefusedAs(WebRefusal::kMalformed, 415,
                     PrintableValue("Content-Type", request.content_type),
                     "the request must have Content-Type application/x-protobuf");
  }
  return {.what = WebCall{.method = method,
                          .authorization = OnlyOne(request.authorizations),
                          .from_page = from_page}};
}

}  // namespace

std::string_view Name(WebRefusal refusal) {
  static constexpr std::array<std::string_view, kWebRefusals> kNames = {
      "full", "timeout", "malformed", "origin", "host", "call", "too_large", "bad_message"};
  return kNames[static_cast<std::size_t>(refusal)];
}

absl::Status ToStatus(const WebRefused& refused) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(Name(refused.refusal)), refused.field, refused.value, refused.rule});
}

bool IsHostAllowed(std::string_view host, const WebRules& rules) {
  if (rules.any_host) return true;
  const auto normal = NormalHost(host, "");
  if (!normal) return false;
  const std::string_view name = NameOf(*normal);
  return IsLocalHost(*normal) || (!rules.is_local && IsNumber(name)) ||
         std::ranges::find(rules.hosts, name) != rules.hosts.end() ||
         std::ranges::any_of(rules.origins, [&](std::string_view origin) {
           return NameOf(origin.substr(origin.find("//") + 2)) == name;
         });
}

WebAnswer Understand(const WebRequest& request, const WebRules& rules) {
  const std::string_view path = request.target.substr(0, request.target.find('?'));
  const bool head_only = request.method == "HEAD";
  const bool is_get = request.method == "GET" || head_only;
  if (request.hosts.size() != 1) {
    return RefusedAs(WebRefusal::kMalformed, 400, HeaderCount("Host", request.hosts.size()),
                     "the request must have one header Host");
  }
  const auto& encodings = request.transfer_encodings;
  if (encodings.size() > 1 || (encodings.size() == 1 && encodings.front() != "chunked")) {
    return RefusedAs(WebRefusal::kMalformed, 400,
                     encodings.size() > 1 ? HeaderCount("Transfer-Encoding", encodings.size())
                                          : PrintableValue("Transfer-Encoding", encodings.front()),
                     "the request must have no Transfer-Encoding, or once and exactly `chunked`");
  }
  // HTTP/1.0 has no Transfer-Encoding, so a proxy could find another end of the request.
  if (!encodings.empty() && request.is_before_1_1) {
    return RefusedAs(WebRefusal::kMalformed, 400, {"version", "HTTP/1.0"},
                     "a request with a Transfer-Encoding must be HTTP/1.1");
  }
  if (path == "/v1/healthz") {
    if (!is_get) return RefusedMethod(request, kMustBeGet, "GET, HEAD");
    return {.what = WebHealth{.head_only = head_only}};
  }
  if (!IsHostAllowed(request.hosts.front(), rules)) {
    return RefusedAs(
        WebRefusal::kHost, 421, PrintableValue("Host", request.hosts.front()),
        "the request must name localhost, an address of this server, or one of its --web-host");
  }
  if (!path.starts_with(kCalls)) {
    if (!is_get) return RefusedMethod(request, kMustBeGet, "GET, HEAD");
    auto file = FilePathOf(request.target);
    if (!file) {
      return RefusedAs(WebRefusal::kMalformed, 404, PrintableValue("path", path),
                       "there is no such page");
    }
    return {.what = WebFile{.path = *std::move(file),
                            .head_only = head_only,
                            .takes_gzip = AcceptsGzip(request.accept_encoding)}};
  }
  const auto route = std::ranges::find(kRoutes, path, &Route::path);
  if (route == kRoutes.end()) {
    return RefusedAs(WebRefusal::kMalformed, 404, PrintableValue("path", path),
                     "there is no such method");
  }
  const bool from_page = !request.origins.empty();
  if (from_page && (request.origins.size() > 1 ||
                    !IsOriginAllowed(request.origins.front(), request.hosts.front(), rules))) {
    return RefusedAs(
        WebRefusal::kOrigin, 403,
        request.origins.size() > 1 ? HeaderCount("Origin", request.origins.size())
                                   : PrintableValue("Origin", request.origins.front()),
        "the method must be called by a page of this server, or of an origin of its --web-origin");
  }
  WebAnswer answer = route->is_socket ? SocketCallOf(request, route->method, from_page)
                                      : PostCallOf(request, route->method, from_page);
  if (from_page && !route->is_socket) answer.allowed_origin = std::string(request.origins.front());
  return answer;
}

absl::StatusOr<std::string> NormalHostName(std::string_view text) {
  auto host = NormalHost(text, "");
  if (!host || NameOf(*host) != *host) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", std::string(text.substr(0, 100)),
                     "\" is no host name: must be NAME, IPV4 or [IPV6], without a port"));
  }
  return *std::move(host);
}

absl::StatusOr<std::string> NormalOrigin(std::string_view text) {
  const auto wrong = [&] {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", std::string(text.substr(0, 100)),
                     "\" is no origin: must be http://HOST[:PORT] or https://HOST[:PORT]"));
  };
  for (const std::string scheme : {"https", "http"}) {
    const std::string before = scheme + "://";
    if (Lower(text.substr(0, before.size())) != before) continue;
    const auto host = NormalHost(text.substr(before.size()), UsualPort(scheme));
    if (!host) return wrong();
    return before + *host;
  }
  return wrong();
}

bool IsOriginAllowed(std::string_view origin, std::string_view host, const WebRules& rules) {
  const auto normal = NormalOrigin(origin);
  if (!normal.ok()) return false;
  const auto allows = [&](const std::string& asked) {
    return std::ranges::find(rules.origins, asked) != rules.origins.end();
  };
  if (allows(*normal)) return true;
  const std::string scheme = normal->substr(0, normal->find(':'));
  const auto own = NormalHost(host, UsualPort(scheme));
  if (!own || *normal != scheme + "://" + *own) return false;
  return IsHostAllowed(host, rules);
}

std::optional<std::string> FilePathOf(std::string_view target) {
  target = target.substr(0, target.find_first_of("?#"));
  if (target.empty() || target.front() != '/' || target.size() > kMostPathBytes)
    return std::nullopt;
  if (target == "/") return "index.html";
  auto path = DecodePercent(target.substr(1));
  if (!path) return std::nullopt;
  // Splits the path after decoding, so that the check below also applies to an encoded '/' or '..'.
  for (const std::string_view name : Split(*path, '/', /*blanks=*/"")) {
    if (name.empty() || name.front() == '.' || !std::ranges::all_of(name, IsFileCharacter)) {
      return std::nullopt;
    }
  }
  return path;
}

OfferedProtocols ParseProtocols(const std::vector<std::string_view>& headers) {
  OfferedProtocols offered;
  for (const std::string_view header : headers) {
    for (std::string_view name : Split(header, ',', kSpace)) {
      if (name == kWebProtocol) offered.ours = true;
      if (!ConsumePrefix(name, kBearerProtocol)) continue;
      auto token = DecodeBase64Url(name);
      offered.is_malformed |= !token || token->empty() || !offered.tokens.empty();
      if (token) offered.tokens.push_back(*std::move(token));
    }
  }
  return offered;
}

std::optional<std::string> DecodeBase64Url(std::string_view text) {
  const std::string encoded(text);
  std::string decoded;
  if (!absl::WebSafeBase64Unescape(encoded, &decoded)) return std::nullopt;
  // Compares with the canonical encoding, because abseil also accepts blanks, padding and
  // superfluous bits.
  if (absl::WebSafeBase64Escape(decoded) != encoded) return std::nullopt;
  return decoded;
}

bool AcceptsGzip(std::string_view accept_encoding) {
  for (const std::string_view item : Split(accept_encoding, ',', kSpace)) {
    const auto parts = Split(item, ';', kSpace);
    if (Lower(parts.front()) != "gzip") continue;
    if (parts.size() == 1) return true;
    // False for "q=0" and "q=0.000".
    return parts[1].find_first_of("123456789") != std::string_view::npos;
  }
  return false;
}

}  // namespace partiemc::server
