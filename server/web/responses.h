// Responses of the gateway that do not come from a call.
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
  /// In addition to the headers of every response.
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::string body = {};
  std::uint64_t body_bytes = 0;  ///< Length of a body that is sent separately; otherwise 0.
  bool close = false;            ///< The connection closes after the response.
  bool head_only = false;        ///< Omit the body.

  /// Status line, headers and, unless it is omitted, `body`.
  std::string Text() const;
};

WebResponse ResponseTo(const WebRefused& refused);
WebResponse ResponseTo(const WebHealth& health, bool draining);
WebResponse ResponseToPreflight();
/// The Content-Security-Policy of the page. `frame_ancestors` are other origins that may show it in
/// a frame.
std::string PagePolicy(const std::vector<std::string>& frame_ancestors);
/// The head of a file, whose contents follow. 304 without contents if `if_none_match` contains its
/// tag. `policy` is PagePolicy.
WebResponse ResponseOf(const PageFile& file, const WebFile& asked, std::string_view if_none_match,
                       const std::string& policy);
/// The response for a missing file. For the page itself it explains how to install it.
WebResponse ResponseWithoutFile(const WebFile& asked, bool has_page);
/// JSON status of a call that ended without a response.
WebResponse ResponseTo(const absl::Status& status);
/// The head of a call's response.
WebResponse ResponseOfCall(std::uint64_t bytes);
/// Allows the page of another, allowed host to read the response.
void AllowOrigin(const std::string& origin, WebResponse& response);

}  // namespace partiemc::server
