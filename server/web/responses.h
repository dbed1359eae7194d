// What the gateway answers where no call does.
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
  /// Beside those that every response has.
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::string body = {};
  std::uint64_t body_bytes = 0;  ///< Of a body that is sent apart; else 0.
  bool close = false;            ///< The connection ends with it.
  bool head_only = false;        ///< The body is not sent.

  /// Status line and headers, and what follows them in `body` if it is sent.
  std::string Text() const;
};

WebResponse ResponseTo(const WebRefused& refused);
WebResponse ResponseTo(const WebHealth& health, bool draining);
WebResponse ResponseToPreflight();
/// The Content-Security-Policy of the page. `frame_ancestors` are origins that may show it in a
/// frame, beside its own.
std::string PagePolicy(const std::vector<std::string>& frame_ancestors);
/// The head of a file, whose contents follow; 304 without them where `if_none_match` has its tag.
/// `policy` is PagePolicy.
WebResponse ResponseOf(const PageFile& file, const WebFile& asked, std::string_view if_none_match,
                       const std::string& policy);
/// Where a file is asked for that is not there; for the page itself it says how to get one.
WebResponse ResponseWithoutFile(const WebFile& asked, bool has_page);
/// How a call ended that has no answer: JSON.
WebResponse ResponseTo(const absl::Status& status);
/// The head of the answer to a call.
WebResponse ResponseOfCall(std::uint64_t bytes);
/// Lets the page of another host, which may call, read it.
void AllowOrigin(const std::string& origin, WebResponse& response);

}  // namespace partiemc::server
