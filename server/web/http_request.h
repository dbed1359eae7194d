// Reads HTTP requests with Boost.Beast.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdint>

#include "server/web/requests.h"

namespace partiemc::server {

/// Limit of a whole request header; a longer one is refused.
inline constexpr std::uint32_t kMaxHeaderBytes = 16 << 10;

/// Reads a header, then a body piece by piece into the caller's buffer.
using HttpParser = boost::beast::http::request_parser<boost::beast::http::buffer_body>;

/// Limits the header of `parser` to kMaxHeaderBytes and removes the limit of the body.
void SetUp(HttpParser& parser);

/// The relevant fields of a request whose header was read; views into `parser`.
WebRequest ViewOf(const HttpParser& parser);

}  // namespace partiemc::server
