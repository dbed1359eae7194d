#include "server/web/responses.h"

#include "absl/strings/str_cat.h"
#include "server/web/status_text.h"

namespace partiemc::server {
namespace {

// 'wasm-unsafe-eval' permits WebAssembly, which decodes compact surfaces. It does not permit eval.
constexpr char kPolicy[] =
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; connect-src 'self' ws: wss:; "
    "img-src 'self' data: blob:; "
    "media-src blob:; style-src 'self' 'unsafe-inline'; frame-ancestors 'self'";
constexpr char kPlainText[] = "text/plain; charset=utf-8";

constexpr char kNoPage[] =
    "This is a PartiEMC server. It has no viewer's page to show: build it in client/viewer, and\n"
    "start the server with --web-root and the folder that this makes.\n"
    "Programs need no page: /v1/watch and /v1/reconstruct are WebSockets (proto/PROTOCOL.md).\n";

WebResponse Plain(unsigned status, std::string text) {
  return {.status = status, .headers = {{"Content-Type", kPlainText}}, .body = std::move(text)};
}

}  // namespace

std::string WebResponse::Text() const {
  std::string text =
      absl::StrCat("HTTP/1.1 ", status, " ", HttpReasonOf(status), "\r\nServer: partiemc\r\n");
  for (const auto& [name, value] : headers) absl::StrAppend(&text, name, ": ", value, "\r\n");
  absl::StrAppend(&text, "X-Content-Type-Options: nosniff\r\n");
  if (close) absl::StrAppend(&text, "Connection: close\r\n");
  // Omits the length for status 304, which has no body: a length would describe the file that is
  // not sent. RFC 9110, section 8.6, forbids a length for status 204.
  if (status != 304 && status != 204) {
    absl::StrAppend(&text, "Content-Length: ", body_bytes > 0 ? body_bytes : body.size(), "\r\n");
  }
  absl::StrAppend(&text, "\r\n");
  if (!head_only) text += body;
  return text;
}

WebResponse ResponseTo(const WebRefused& refused) {
  WebResponse response = Plain(refused.http_status, refused.rule + "\n");
  if (!refused.allow.empty()) response.headers.emplace_back("Allow", refused.allow);
  if (refused.http_status == 426) response.headers.emplace_back("Upgrade", "websocket");
  return response;
}

WebResponse ResponseTo(const WebHealth& health, bool draining) {
  WebResponse response = draining ? Plain(503, "draining\n") : Plain(200, "ok\n");
  response.headers.emplace_back("Cache-Control", "no-store");
  response.head_only = health.head_only;
  return response;
}

WebResponse ResponseToPreflight() {
  return {.status = 204,
          .headers = {{"Access-Control-Allow-Methods", "POST"},
                      {"Access-Control-Allow-Headers", "authorization, content-type"},
                      {"Access-Control-Max-Age", "600"}}};
}

std::string PagePolicy(const std::vector<std::string>& frame_ancestors) {
  std::string policy = kPolicy;
  for (const std::string& origin : frame_ancestors) absl::StrAppend(&policy, " ", origin);
  return policy;
}

WebResponse ResponseOf(const PageFile& file, const WebFile& asked, std::string_view if_none_match,
                       const std::string& policy) {
  WebResponse response{.headers = {{"Content-Type", file.type},
                                   {"ETag", file.tag},
                                   {"Cache-Control", "no-cache"},
                                   {"Content-Security-Policy", policy},
                                   {"Referrer-Policy", "no-referrer"}},
                       .body_bytes = file.bytes,
                       .head_only = asked.head_only};
  if (file.has_packed) response.headers.emplace_back("Vary", "Accept-Encoding");
  if (if_none_match.find(file.tag) != std::string_view::npos) {
    response.status = 304;
    response.head_only = true;
  } else if (file.is_packed) {
    response.headers.emplace_back("Content-Encoding", "gzip");
  }
  return response;
}

WebResponse ResponseWithoutFile(const WebFile& asked, bool has_page) {
  const bool tells_how = !has_page && asked.path == "index.html";
  WebResponse response = tells_how ? Plain(200, kNoPage) : Plain(404, "there is no such page\n");
  response.headers.emplace_back("Cache-Control", "no-cache");
  response.head_only = asked.head_only;
  return response;
}

WebResponse ResponseTo(const absl::Status& status) {
  WebResponse response{
      .status = HttpStatusOf(status),
      .headers = {{"Content-Type", "application/json"}, {"Cache-Control", "no-store"}},
      .body = StatusJson(status) + "\n"};
  if (response.status == 401) response.headers.emplace_back("WWW-Authenticate", "Bearer");
  return response;
}

WebResponse ResponseOfCall(std::uint64_t bytes) {
  return {.headers = {{"Content-Type", "application/x-protobuf"}, {"Cache-Control", "no-store"}},
          .body_bytes = bytes};
}

void AllowOrigin(const std::string& origin, WebResponse& response) {
  response.headers.emplace_back("Access-Control-Allow-Origin", origin);
  response.headers.emplace_back("Vary", "Origin");
}

}  // namespace partiemc::server
