#include "server/web/web_stream.h"

#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>

namespace partiemc::server {

void* WebHandlerMemory::Allocate(std::size_t bytes) {
  if (is_used_) return ::operator new(bytes);
  if (bytes > bytes_) {
    block_.reset(new std::byte[bytes]);
    bytes_ = bytes;
  }
  is_used_ = true;
  return block_.get();
}

void WebHandlerMemory::Free(void* memory) {
  if (memory != block_.get()) return ::operator delete(memory);
  is_used_ = false;
}

struct WebStream::Tls {
  Tls(WebSocket& socket, boost::asio::ssl::context& context) : stream(socket, context) {}

  boost::beast::flat_stream<boost::asio::ssl::stream<WebSocket&>> stream;
};

WebStream::WebStream(WebSocket socket, boost::asio::ssl::context* tls)
    : socket_(std::move(socket)),
      tls_(tls != nullptr ? std::make_unique<Tls>(socket_, *tls) : nullptr) {}

WebStream::~WebStream() = default;

void WebStream::Handshake(WebHandler handler) {
  tls_->stream.next_layer().async_handshake(boost::asio::ssl::stream_base::server,
                                            std::move(handler));
}

void WebStream::ReadSome(std::span<const boost::asio::mutable_buffer> buffers, WebHandler handler) {
  if (tls_ != nullptr) return tls_->stream.async_read_some(buffers, std::move(handler));
  socket_.async_read_some(buffers, std::move(handler));
}

void WebStream::WriteSome(std::span<const boost::asio::const_buffer> buffers, WebHandler handler) {
  if (tls_ != nullptr) return tls_->stream.async_write_some(buffers, std::move(handler));
  socket_.async_write_some(buffers, std::move(handler));
}

void WebStream::WriteAll(std::span<const boost::asio::const_buffer> buffers, WebHandler handler) {
  boost::asio::async_write(*this, buffers, std::move(handler));
}

void WebStream::Teardown(boost::beast::role_type role, WebHandler handler) {
  if (tls_ != nullptr) return tls_->stream.next_layer().async_shutdown(std::move(handler));
  boost::beast::websocket::async_teardown(role, socket_, std::move(handler));
}

}  // namespace partiemc::server
