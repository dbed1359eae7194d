#include "server/web/web_gateway.h"

#include <pthread.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <list>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/security/peer_accounts.h"
#include "server/web/connection.h"
#include "server/web/context.h"
#include "server/web/http_session.h"
#include "server/web/responses.h"
#include "server/web/tls_contexts.h"

namespace partiemc::server {
namespace {

using boost::asio::ip::tcp;

constexpr int kThreads = 2;
// Pause after a failed accept. If there is no free descriptor, each further attempt would fail at
// once.
constexpr std::chrono::milliseconds kRestAfterFailure(100);
constexpr int kBacklog = 1024;

absl::Status CannotListen(const Address& address, const error_code& error) {
  return absl::UnavailableError(absl::StrCat("cannot listen on --web ", address.ToString(), ": ",
                                             error.message(), "; choose another"));
}

ConnectionSlots::Limits LimitsOf(const WebOptions& options) {
  const std::size_t connections = options.max_connections, asked = options.max_per_address;
  return {.connections = connections,
          .per_address = asked > 0 ? asked : std::max<std::size_t>(connections / 2, 1)};
}

// The checked form of WebOptions.
struct CheckedOptions {
  WebRules rules;
  std::vector<std::string> frame_ancestors;
};

// Returns the normal form of each of `values`.
absl::StatusOr<std::vector<std::string>> Normal(
    std::string_view flag, const std::vector<std::string>& values,
    absl::StatusOr<std::string> (*normal_form)(std::string_view)) {
  std::vector<std::string> normal;
  for (const std::string& value : values) {
    auto form = normal_form(value);
    if (!form.ok()) {
      return absl::InvalidArgumentError(
          absl::StrCat(std::string(flag), " ", form.status().message()));
    }
    normal.push_back(*std::move(form));
  }
  return normal;
}

// Returns the rules for the hosts that requests may name. A page that reaches the server under its
// own name (DNS rebinding) has no token, and no certificate for this name. So tokens or TLS permit
// any name, except on a loopback address, or if the operator lists the names.
WebRules RulesFor(const WebOptions& options, std::vector<std::string> hosts, bool is_secure) {
  WebRules rules{.hosts = std::move(hosts), .is_local = options.address.IsLocal()};
  rules.any_host = !rules.is_local && is_secure && rules.hosts.empty();
  if (auto own = NormalHostName(options.address.host); own.ok()) {
    rules.hosts.push_back(*std::move(own));
  }
  return rules;
}

absl::StatusOr<CheckedOptions> Check(const WebOptions& options, bool is_secure) {
  auto origins = Normal("--web-origin", options.origins, &NormalOrigin);
  if (!origins.ok()) return origins.status();
  auto hosts = Normal("--web-host", options.hosts, &NormalHostName);
  if (!hosts.ok()) return hosts.status();
  auto ancestors = Normal("--web-frame-ancestors", options.frame_ancestors, &NormalOrigin);
  if (!ancestors.ok()) return ancestors.status();
  CheckedOptions checked{.rules = RulesFor(options, *std::move(hosts), is_secure),
                         .frame_ancestors = *std::move(ancestors)};
  checked.rules.origins = *std::move(origins);
  return checked;
}

void Converse(const std::shared_ptr<WebConnection>& connection) {
  if (!connection->stream.has_tls()) return ServeHttp(connection);
  connection->CloseAfter(kWebHeaderTime);
  connection->stream.async_handshake([connection](error_code error) {
    if (error) {
      connection->context.refusals.Count(WebRefusal::kMalformed);
      return connection->Close();
    }
    ServeHttp(connection);
  });
}

}  // namespace

class WebGateway::Implementation {
 public:
  Implementation(const WebOptions& options, const Setup& setup, CheckedOptions config)
      : context_{.methods = setup.methods,
                 .limits = setup.limits,
                 .pings = {setup.ping_interval, setup.ping_timeout},
                 .rules = std::move(config.rules),
                 .files = PageFiles(options.root.empty() ? DefaultPageRoot() : options.root),
                 .page_policy = PagePolicy(config.frame_ancestors),
                 .draining = setup.draining,
                 .refusals = WebRefusals(setup.metrics),
                 .slots = ConnectionSlots(LimitsOf(options))},
        address_(options.address) {
    if (setup.tls != nullptr) tls_.emplace(*setup.tls);
    setup.metrics.AddGauge("partiemc_web_connections", "Connections of the gateway.",
                           [this] { return static_cast<double>(context_.slots.count()); });
  }

  ~Implementation() { Stop(std::chrono::steady_clock::now()); }

  // Listens on all addresses of a host name, because browsers differ in which of them they use.
  absl::Status Listen() {
    if (tls_) {
      if (auto status = tls_->Check(); !status.ok()) return status;
    }
    error_code error;
    tcp::resolver resolver(io_);
    const auto found =
        resolver.resolve(address_.host, absl::StrCat(address_.port),
                         tcp::resolver::passive | tcp::resolver::numeric_service, error);
    if (error) return CannotListen(address_, error);
    error_code first_error;
    for (const auto& entry : found) {
      auto endpoint = entry.endpoint();
      endpoint.port(address_.port);
      const error_code failed = ListenOn(endpoint);
      if (failed && (!first_error || failed == boost::asio::error::address_in_use)) {
        first_error = failed;
      }
    }
    if (listeners_.empty() || first_error == boost::asio::error::address_in_use) {
      return CannotListen(address_, first_error);
    }
    for (auto& listener : listeners_) Accept(listener);
    for (int i = 0; i < kThreads; ++i) {
      threads_.emplace_back([this] { io_.run(); });
      pthread_setname_np(threads_.back().native_handle(), "web");
    }
    return absl::OkStatus();
  }

  const Address& address() const { return address_; }

  void Stop(std::chrono::steady_clock::time_point deadline) {
    if (threads_.empty()) return;
    boost::asio::post(accepting_, [this] {
      stopped_ = true;
      error_code ignored;
      for (auto& listener : listeners_) listener.acceptor.close(ignored);
      for (auto& listener : listeners_) listener.rest.cancel();
    });
    context_.slots.EndUnused();
    if (!context_.slots.WaitUntilEmpty(deadline)) {
      // Posted to the accepting strand, so that it runs after all connections accepted during the
      // wait have been added. No connection is accepted later.
      boost::asio::post(accepting_, [this] { context_.slots.EndAll(); });
      context_.slots.WaitUntilEmpty();
    }
    work_.reset();
    for (auto& thread : threads_) thread.join();
    threads_.clear();
  }

 private:
  struct Acceptor {
    Acceptor(const WebExecutor& executor) : acceptor(executor), rest(executor) {}
    boost::asio::basic_socket_acceptor<tcp, WebExecutor> acceptor;
    boost::asio::steady_timer rest;
  };

  error_code ListenOn(const tcp::endpoint& endpoint) {
    error_code error;
    Acceptor& listener = listeners_.emplace_back(accepting_);
    auto& acceptor = listener.acceptor;
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error && endpoint.address().is_v6()) {
      acceptor.set_option(boost::asio::ip::v6_only(!endpoint.address().is_unspecified()), error);
    }
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(kBacklog, error);
    if (error) {
      listeners_.pop_back();
    } else {
      address_.port = acceptor.local_endpoint(error).port();
    }
    return error;
  }

  void Accept(Acceptor& listener) {
    listener.acceptor.async_accept(
        boost::asio::make_strand(io_), [this, &listener](error_code error, WebSocket socket) {
          if (stopped_) return;
          if (!error) {
            Enter(std::move(socket));
          } else if (error == boost::asio::error::no_descriptors ||
                     error == boost::asio::error::no_buffer_space ||
                     error == boost::asio::error::no_memory) {
            listener.rest.expires_after(kRestAfterFailure);
            return listener.rest.async_wait([this, &listener](error_code) {
              if (!stopped_) Accept(listener);
            });
          }
          Accept(listener);
        });
  }

  void Enter(WebSocket socket) {
    error_code error;
    const auto endpoint = socket.remote_endpoint(error);
    if (error) return;  // The connection is already closed.
    socket.set_option(tcp::no_delay(true), error);
    // The connection keeps a reference to the part of the context that it needs, so the context may
    // be released.
    const auto tls = tls_ ? tls_->Get() : nullptr;
    if (tls_ && tls == nullptr) return context_.refusals.Count(WebRefusal::kMalformed);
    const auto connection =
        std::make_shared<WebConnection>(context_, PeerOf(endpoint), std::move(socket), tls.get());
    bool evicted = false;
    connection->slot = context_.slots.Enter(
        HostOfPeer(connection->peer),
        [weak = std::weak_ptr<WebConnection>(connection)] {
          if (const auto alive = weak.lock()) alive->Abort();
        },
        evicted);
    if (evicted) context_.refusals.Count(WebRefusal::kFull);
    boost::asio::post(connection->executor(), [connection] { Converse(connection); });
  }

  boost::asio::io_context io_{kThreads};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      io_.get_executor()};
  const WebExecutor accepting_ = boost::asio::make_strand(io_);
  WebContext context_;
  Address address_;
  std::optional<TlsContexts> tls_;
  std::list<Acceptor> listeners_;
  bool stopped_ = false;  // Used on accepting_ only.
  std::vector<std::thread> threads_;
};

WebGateway::WebGateway(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

WebGateway::~WebGateway() = default;

const Address& WebGateway::address() const { return implementation_->address(); }

void WebGateway::Stop(std::chrono::steady_clock::time_point deadline) {
  implementation_->Stop(deadline);
}

absl::StatusOr<std::unique_ptr<WebGateway>> WebGateway::Start(const WebOptions& options,
                                                              const Setup& setup) {
  if (!options.address.unix_path.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--web ", options.address.ToString(), ": must be HOST:PORT or [IPV6]:PORT"));
  }
  auto checked = Check(options, setup.has_tokens || setup.tls != nullptr);
  if (!checked.ok()) return checked.status();
  auto implementation = std::make_unique<Implementation>(options, setup, *std::move(checked));
  if (auto status = implementation->Listen(); !status.ok()) return status;
  return std::unique_ptr<WebGateway>(new WebGateway(std::move(implementation)));
}

}  // namespace partiemc::server
