// Serves the HTTP requests of one connection, one after the other.
#pragma once

#include <memory>

namespace partiemc::server {

class WebConnection;

/// Reads requests. Sends the response of each, or passes the connection to the call that the
/// request begins. Called on the connection's strand.
void ServeHttp(std::shared_ptr<WebConnection> connection);

}  // namespace partiemc::server
