// A unary call (one request, one response) as an HTTP POST.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/web/http_request.h"
#include "server/web/web_channel.h"

namespace partiemc::server {

/// Reads the body only when the call requests it, that is, after the caller was admitted. `parser`
/// has read the header. `next`: function that awaits the next HTTP request of the connection after
/// this call.
std::shared_ptr<WebChannel> MakePostCall(std::shared_ptr<WebConnection> connection,
                                         std::unique_ptr<HttpParser> parser,
                                         std::string allowed_origin, std::function<void()> next);

}  // namespace partiemc::server
