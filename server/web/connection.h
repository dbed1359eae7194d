// One connection of the gateway, with or without TLS, for HTTP and WebSocket.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "server/web/context.h"
#include "server/web/http_request.h"
#include "server/web/web_stream.h"

namespace partiemc::server {

/// Returns the peer in gRPC's format: "ipv4:192.0.2.7:51234", "ipv6:%5B2001:db8::1%5D:51234".
std::string PeerOf(const boost::asio::ip::tcp::endpoint& endpoint);

/// Held by shared_ptr. Used on its strand only, except Abort.
class WebConnection final : public std::enable_shared_from_this<WebConnection> {
 public:
  /// `tls`: see WebStream.
  WebConnection(WebContext& context_in, std::string peer_in, WebSocket socket_in,
                boost::asio::ssl::context* tls)
      : context(context_in), peer(std::move(peer_in)), stream(std::move(socket_in), tls) {}
  WebConnection(const WebConnection&) = delete;
  WebConnection& operator=(const WebConnection&) = delete;

  /// Closes the connection, so pending operations fail. May be called from any thread.
  void Abort() {
    boost::asio::post(executor_, [self = shared_from_this()] { self->Close(); });
  }
  /// Closes the connection at once. Called on the strand.
  void Close();
  /// Sets a function that runs once, when this side closes the connection. The function ends
  /// operations that wait for something other than the socket. Null: none.
  void WhenClosed(std::function<void()> closed) { closed_ = std::move(closed); }

  /// Closes the connection after `time`, and counts this as a timeout. A later call replaces the
  /// deadline.
  void CloseAfter(std::chrono::milliseconds time) { CloseAfter(time, /*is_refusal=*/true); }
  /// Same as CloseAfter, but counts no timeout, because the client has no request in progress.
  void CloseIdleAfter(std::chrono::milliseconds time) { CloseAfter(time, /*is_refusal=*/false); }
  void CloseNever() { deadline_.expires_at(std::chrono::steady_clock::time_point::max()); }

  /// Closes the connection after the client has closed its side, but at the latest after
  /// kWebCloseTime. So the bytes that were written can arrive. Ignores further bytes of the client.
  void CloseGently();

  const WebExecutor& executor() const { return executor_; }

  WebContext& context;
  const std::string peer;
  ConnectionSlots::Slot slot;
  /// Received bytes that were not parsed yet.
  boost::beast::flat_buffer buffer{kMaxHeaderBytes};
  WebStream stream;

 private:
  void CloseAfter(std::chrono::milliseconds time, bool is_refusal);
  void CloseIfRead();
  WebSocket& socket() { return stream.next_layer(); }

  const WebExecutor executor_ = stream.get_executor();
  boost::asio::steady_timer deadline_{executor_};
  std::function<void()> closed_;
  bool is_closed_ = false;
};

}  // namespace partiemc::server
