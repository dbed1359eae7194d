// One connection of the gateway, with or without TLS, for HTTP and WebSocket.
#pragma once

#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/stream_traits.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "server/web/context.h"
#include "server/web/http_request.h"

namespace partiemc::server {

using boost::beast::error_code;

/// The executor of a connection: a strand, on which all events of the connection run one at a time.
using WebExecutor = boost::asio::strand<boost::asio::io_context::executor_type>;
using WebSocket = boost::asio::basic_stream_socket<boost::asio::ip::tcp, WebExecutor>;
using TlsWebSocket = boost::beast::ssl_stream<WebSocket>;

/// Returns the peer in gRPC's format: "ipv4:192.0.2.7:51234", "ipv6:%5B2001:db8::1%5D:51234".
std::string PeerOf(const boost::asio::ip::tcp::endpoint& endpoint);

/// The part of a connection that is independent of TLS. Held by shared_ptr. Used on its strand
/// only, except Abort.
class WebConnection : public std::enable_shared_from_this<WebConnection> {
 public:
  WebConnection(WebContext& context_in, WebExecutor executor, std::string peer_in)
      : context(context_in), peer(std::move(peer_in)), executor_(executor), deadline_(executor) {}
  virtual ~WebConnection() = default;
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

 protected:
  virtual WebSocket& socket() = 0;

 private:
  void CloseAfter(std::chrono::milliseconds time, bool is_refusal);
  void CloseIfRead();

  const WebExecutor executor_;
  boost::asio::steady_timer deadline_;
  std::function<void()> closed_;
  bool is_closed_ = false;
};

template <typename Stream>
class WebConnectionOver final : public WebConnection {
 public:
  template <typename... Arguments>
  WebConnectionOver(WebContext& context_in, WebExecutor executor, std::string peer_in,
                    Arguments&&... arguments)
      : WebConnection(context_in, executor, std::move(peer_in)),
        stream(std::forward<Arguments>(arguments)...) {}

  Stream stream;

 private:
  WebSocket& socket() override { return boost::beast::get_lowest_layer(stream); }
};

}  // namespace partiemc::server
