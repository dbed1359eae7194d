// The HTTP responses of the gateway: files, refusals, health, and the heads of calls' responses.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/web/page_files.h"
#include "server/web/requests.h"

namespace partiemc::server {

struct WebResponse {
  unsigned status = 200;
  /// Headers in addition to the headers that every response has.
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::string body = {};
  std::uint64_t body_bytes = 0;  ///< Length of a body that is sent separately; otherwise 0.
  bool close = false;            ///< The connection closes after the response.
  bool head_only = false;        ///< Omit the body.

  /// Returns the status line, the headers and, unless head_only is set, `body`.
  std::string Text() const;
};

WebResponse ResponseTo(const WebRefused& refused);
WebResponse ResponseTo(const WebHealth& health, bool draining);
WebResponse ResponseToPreflight();
/// Returns the Content-Security-Policy of the page. `frame_ancestors` are other origins whose pages
/// may show the page in a frame.
std::string PagePolicy(const std::vector<std::string>& frame_ancestors);
/// Returns the head of the response with a file; the caller sends the file's contents afterwards.
/// The status is 304, without contents, if `if_none_match` contains the file's tag. `policy` is the
/// result of PagePolicy.
WebResponse ResponseOf(const PageFile& file, const WebFile& asked, std::string_view if_none_match,
                       const std::string& policy);
/// Returns the response for a missing file. If the page is not installed, the response for
/// "index.html" explains how to install it.
WebResponse ResponseWithoutFile(const WebFile& asked, bool has_page);
/// Returns the response to a call that ended without a response message: its status as JSON.
WebResponse ResponseTo(const absl::Status& status);
/// Returns the head of the response with a call's response message of `bytes`.
WebResponse ResponseOfCall(std::uint64_t bytes);
/// Permits pages of `origin`, which must be an allowed origin, to read the response.
void AllowOrigin(const std::string& origin, WebResponse& response);

}  // namespace partiemc::server
