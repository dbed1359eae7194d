#include "server/web/http_request.h"

#include <boost/beast/websocket/rfc6455.hpp>
#include <limits>

namespace partiemc::server {
namespace {

namespace http = boost::beast::http;

std::string_view View(boost::beast::string_view text) { return {text.data(), text.size()}; }

std::vector<std::string_view> All(const http::fields& fields, http::field name) {
  std::vector<std::string_view> values;
  const auto [begin, end] = fields.equal_range(name);
  for (auto field = begin; field != end; ++field) values.push_back(View(field->value()));
  return values;
}

}  // namespace

void SetUp(HttpParser& parser) {
  parser.header_limit(kMaxHeaderBytes);
  // Sets the largest possible limit instead of none: Boost 1.74 treats an absent limit as smaller
  // than any length.
  parser.body_limit(std::numeric_limits<std::uint64_t>::max());
}

WebRequest ViewOf(const HttpParser& parser) {
  const auto& request = parser.get();
  const auto length = parser.content_length();
  return {.method = View(request.method_string()),
          .target = View(request.target()),
          .hosts = All(request, http::field::host),
          .origins = All(request, http::field::origin),
          .authorizations = All(request, http::field::authorization),
          .protocols = All(request, http::field::sec_websocket_protocol),
          .transfer_encodings = All(request, http::field::transfer_encoding),
          .content_type = View(request[http::field::content_type]),
          .accept_encoding = View(request[http::field::accept_encoding]),
          .if_none_match = View(request[http::field::if_none_match]),
          .is_upgrade = boost::beast::websocket::is_upgrade(request),
          .has_body = parser.chunked() || (length && *length > 0),
          .is_before_1_1 = request.version() < 11};
}

}  // namespace partiemc::server
