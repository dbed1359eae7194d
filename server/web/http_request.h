// HTTP as Boost.Beast reads it.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdint>

#include "server/web/requests.h"

namespace partiemc::server {

/// Of a request, all of it: who sends more is refused.
inline constexpr std::uint32_t kMaxHeaderBytes = 16 << 10;

/// Reads a header, and a body piece by piece to where it is told.
using HttpParser = boost::beast::http::request_parser<boost::beast::http::buffer_body>;

/// Keeps `parser` from taking more than kMaxHeaderBytes, and bodies from any limit of its own.
void SetUp(HttpParser& parser);

/// What counts of a request whose header has come; views into `parser`.
WebRequest ViewOf(const HttpParser& parser);

}  // namespace partiemc::server
