// Reads HTTP requests with Boost.Beast.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdint>

#include "server/web/requests.h"

namespace partiemc::server {

/// Maximum size of a request's header. A longer header is refused.
inline constexpr std::uint32_t kMaxHeaderBytes = 16 << 10;

/// Parser that reads a header, and then a body piece by piece into the caller's buffer.
using HttpParser = boost::beast::http::request_parser<boost::beast::http::buffer_body>;

/// Limits the header of `parser` to kMaxHeaderBytes and removes the limit of the body.
void SetUp(HttpParser& parser);

/// Returns the relevant fields of a request after its header was read; they are views into
/// `parser`.
WebRequest ViewOf(const HttpParser& parser);

}  // namespace partiemc::server
