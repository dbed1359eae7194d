#include "server/web/connection.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {

WebRefusals::WebRefusals(Metrics& metrics) {
  auto& family =
      prometheus::BuildCounter()
          .Name("partiemc_web_refusals_total")
          .Help("Connections, requests and messages that the gateway did not take, by reason.")
          .Register(metrics.registry());
  for (std::size_t i = 0; i < kWebRefusals; ++i) {
    counters_[i] = &family.Add({{"reason", std::string(Name(static_cast<WebRefusal>(i)))}});
  }
}

void WebContext::Refuse(WebRefusal refusal, const std::string& peer, const absl::Status& why) {
  refusals.Count(refusal);
  LogRefusal("web request refused", peer, why);
}

std::string PeerOf(const boost::asio::ip::tcp::endpoint& endpoint) {
  auto address = endpoint.address();
  if (address.is_v6() && address.to_v6().is_v4_mapped()) {
    address = boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, address.to_v6());
  }
  if (address.is_v4()) return absl::StrCat("ipv4:", address.to_string(), ":", endpoint.port());
  std::string text = address.to_string();
  if (const auto zone = text.find('%'); zone != std::string::npos) text.replace(zone, 1, "%25");
  return absl::StrCat("ipv6:%5B", text, "%5D:", endpoint.port());
}

void WebConnection::Close() {
  if (std::exchange(is_closed_, true)) return;
  error_code ignored;
  socket().close(ignored);
  deadline_.cancel();
  if (closed_) std::exchange(closed_, nullptr)();
}

void WebConnection::CloseAfter(std::chrono::milliseconds time, bool is_refusal) {
  if (is_closed_) return;
  deadline_.expires_after(time);
  deadline_.async_wait([weak = weak_from_this(), is_refusal](error_code error) {
    const auto self = weak.lock();
    // Ignores the timer if the deadline has been moved since the timer fired.
    if (error || self == nullptr || self->deadline_.expiry() > std::chrono::steady_clock::now()) {
      return;
    }
    if (is_refusal) self->context.refusals.Count(WebRefusal::kTimeout);
    self->Close();
  });
}

// Shuts down this side and waits for the client. If a socket is closed while it has unread bytes,
// the kernel resets the connection, and the client may lose the response.
void WebConnection::CloseGently() {
  error_code error;
  socket().shutdown(WebSocket::shutdown_send, error);
  if (error) return Close();
  deadline_.expires_after(kWebCloseTime);
  deadline_.async_wait([weak = weak_from_this()](error_code aborted) {
    const auto self = weak.lock();
    if (!aborted && self != nullptr) self->Close();
  });
  // Linux completes this wait when both directions are shut down, or after a reset.
  socket().async_wait(WebSocket::wait_error, [weak = weak_from_this()](error_code aborted) {
    const auto self = weak.lock();
    if (!aborted && self != nullptr) self->CloseIfRead();
  });
}

// Called when both directions are shut down. Closing with unread bytes would reset the connection.
// So a few last bytes, such as the close_notify of TLS, are read before the close. If there are
// more bytes, the deadline closes the connection later.
void WebConnection::CloseIfRead() {
  std::array<char, 1024> last;
  error_code error;
  const std::size_t unread = socket().available(error);
  if (!error && unread > last.size()) return;
  if (!error && unread > 0) socket().read_some(boost::asio::buffer(last), error);
  Close();
}

}  // namespace partiemc::server
