// The byte stream of one connection of the gateway: a TCP socket, with or without TLS.
#pragma once

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/handler_continuation_hook.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>
#include <cstddef>
#include <iterator>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

namespace boost::asio::ssl {
class context;
}

namespace partiemc::server {

using boost::beast::error_code;

/// The executor of a connection: a strand, on which all events of the connection run one at a time.
using WebExecutor = boost::asio::strand<boost::asio::io_context::executor_type>;
using WebSocket = boost::asio::basic_stream_socket<boost::asio::ip::tcp, WebExecutor>;

/// Memory for the handlers of one kind of operation. Keeps one block and reuses it, so an operation
/// allocates only if an earlier one is still pending or all earlier ones needed less.
class WebHandlerMemory {
 public:
  void* Allocate(std::size_t bytes);
  void Free(void* memory);

 private:
  std::unique_ptr<std::byte[]> block_;
  std::size_t bytes_ = 0;
  bool is_used_ = false;
};

/// A completion handler of any type. Boost.Asio's operations on the socket and on TLS are templates
/// over the type of the handler; with this type they are compiled once. Move-only.
class WebHandler {
 public:
  /// The handler in its memory. Complete runs the handler, Destroy does not; both free the memory.
  class Held {
   public:
    virtual void Complete(error_code error, std::size_t bytes) = 0;
    virtual void Destroy() = 0;

    bool is_continuation = false;

   protected:
    ~Held() = default;
  };

  explicit WebHandler(Held* held) : held_(held) {}
  WebHandler(WebHandler&& other) noexcept : held_(std::exchange(other.held_, nullptr)) {}
  WebHandler& operator=(WebHandler&&) = delete;
  ~WebHandler() {
    if (held_ != nullptr) held_->Destroy();
  }

  void operator()(error_code error, std::size_t bytes = 0) {
    std::exchange(held_, nullptr)->Complete(error, bytes);
  }

  /// Boost.Asio's hook. A thread runs a continuation itself, instead of waking up another thread.
  friend bool asio_handler_is_continuation(WebHandler* handler) {
    return handler->held_->is_continuation;
  }

 private:
  Held* held_;
};

/// `passes_bytes`: whether the handler has a second parameter, the number of bytes.
template <typename Handler, bool passes_bytes>
class HeldWebHandler final : public WebHandler::Held {
 public:
  template <typename From>
  HeldWebHandler(WebHandlerMemory& memory, From&& handler)
      : memory_(memory), handler_(std::forward<From>(handler)) {
    using boost::asio::asio_handler_is_continuation;
    is_continuation = asio_handler_is_continuation(std::addressof(handler_));
  }

  void Complete(error_code error, std::size_t bytes) override {
    Handler handler = Release();
    if constexpr (passes_bytes) {
      handler(error, bytes);
    } else {
      handler(error);
    }
  }
  void Destroy() override { Release(); }

 private:
  // Frees the memory before the handler runs, so that the handler's next operation reuses it. The
  // handler is destroyed later, because it may hold the last reference to the stream.
  Handler Release() {
    Handler handler(std::move(handler_));
    WebHandlerMemory& memory = memory_;
    this->~HeldWebHandler();
    memory.Free(this);
    return handler;
  }

  WebHandlerMemory& memory_;
  Handler handler_;
};

/// Whether a strand runs the handler. Boost.Asio's composed operations add a property to the type
/// of the stream's strand.
template <typename Handler,
          typename Executor = boost::asio::associated_executor_t<Handler, WebExecutor>>
struct RunsOnStrand : std::false_type {};
template <typename Handler, typename Inner>
struct RunsOnStrand<Handler, boost::asio::strand<Inner>> : std::true_type {};

/// Models AsyncReadStream and AsyncWriteStream of Boost.Asio. Used on the connection's strand only,
/// and all handlers run there. Requires: a handler keeps the stream alive.
class WebStream {
 public:
  using executor_type = WebExecutor;
  using next_layer_type = WebSocket;

  /// `tls`: null for a stream without TLS. The stream keeps a reference to the part of the context
  /// that it needs.
  WebStream(WebSocket socket, boost::asio::ssl::context* tls);
  ~WebStream();
  WebStream(const WebStream&) = delete;
  WebStream& operator=(const WebStream&) = delete;

  bool has_tls() const { return tls_ != nullptr; }
  executor_type get_executor() noexcept { return socket_.get_executor(); }
  WebSocket& next_layer() noexcept { return socket_; }

  /// Makes the handshake of TLS as the server. Requires: has_tls().
  template <typename Handler>
  void async_handshake(Handler&& handler) {
    Handshake(Hold(std::forward<Handler>(handler)));
  }
  /// Over TLS, reads into the first buffer that is not empty.
  template <typename Buffers, typename Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    Start(&WebStream::ReadSome, read_memory_, buffers, std::forward<Handler>(handler));
  }
  /// Over TLS, joins small buffers, so that they become one record.
  template <typename Buffers, typename Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    Start(&WebStream::WriteSome, write_memory_, buffers, std::forward<Handler>(handler));
  }
  /// boost::asio::async_write, which is compiled once if called here.
  template <typename Buffers, typename Handler>
  void AsyncWriteAll(const Buffers& buffers, Handler&& handler) {
    Start(&WebStream::WriteAll, memory_, buffers, std::forward<Handler>(handler));
  }

  /// Called by Boost.Beast's WebSocket after its close frames.
  template <typename Handler>
  friend void async_teardown(boost::beast::role_type role, WebStream& stream, Handler&& handler) {
    stream.Teardown(role, stream.Hold(std::forward<Handler>(handler)));
  }

 private:
  struct Tls;

  template <typename Handler>
  WebHandler Hold(Handler&& handler) {
    using Held = HeldWebHandler<std::decay_t<Handler>, /*passes_bytes=*/false>;
    static_assert(RunsOnStrand<std::decay_t<Handler>>::value);
    return WebHandler(new (memory_.Allocate(sizeof(Held)))
                          Held(memory_, std::forward<Handler>(handler)));
  }

  // Copies the sequence of buffers, without their bytes, next to the handler.
  template <typename Buffer, typename Buffers, typename Handler>
  void Start(void (WebStream::*operation)(std::span<const Buffer>, WebHandler),
             WebHandlerMemory& memory, const Buffers& buffers, Handler&& handler) {
    using Held = HeldWebHandler<std::decay_t<Handler>, /*passes_bytes=*/true>;
    static_assert(RunsOnStrand<std::decay_t<Handler>>::value);
    static_assert(alignof(Held) >= alignof(Buffer) &&
                  alignof(Held) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);
    const auto begin = boost::asio::buffer_sequence_begin(buffers);
    const auto end = boost::asio::buffer_sequence_end(buffers);
    const auto count = static_cast<std::size_t>(std::distance(begin, end));
    void* const block = memory.Allocate(sizeof(Held) + count * sizeof(Buffer));
    auto* const copy = reinterpret_cast<Buffer*>(static_cast<std::byte*>(block) + sizeof(Held));
    std::uninitialized_copy(begin, end, copy);
    (this->*operation)({copy, count},
                       WebHandler(new (block) Held(memory, std::forward<Handler>(handler))));
  }

  void Handshake(WebHandler handler);
  void ReadSome(std::span<const boost::asio::mutable_buffer> buffers, WebHandler handler);
  void WriteSome(std::span<const boost::asio::const_buffer> buffers, WebHandler handler);
  void WriteAll(std::span<const boost::asio::const_buffer> buffers, WebHandler handler);
  void Teardown(boost::beast::role_type role, WebHandler handler);

  WebSocket socket_;
  const std::unique_ptr<Tls> tls_;  // Null: no TLS.
  WebHandlerMemory read_memory_, write_memory_, memory_;
};

}  // namespace partiemc::server
