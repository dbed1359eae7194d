// A call over a WebSocket: each binary message is one request or one response.
#pragma once

#include <memory>

#include "server/web/http_request.h"
#include "server/web/web_channel.h"

namespace partiemc::server {

/// Completes the WebSocket handshake when the call starts its first read, that is, after the caller
/// was admitted. If the caller is refused, sends an HTTP error instead. Browsers hide such errors
/// from the page, so a browser gets the refusal over the completed WebSocket.
///
/// `parser` has read the request that began the WebSocket. `from_page`: a browser sent it.
std::shared_ptr<WebChannel> MakeSocketCall(std::shared_ptr<WebConnection> connection,
                                           std::unique_ptr<HttpParser> parser, bool from_page);

}  // namespace partiemc::server
