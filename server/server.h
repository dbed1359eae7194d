// The running server: gRPC's server with the service, health and reflection, its gateway, and its
// drain.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "common/address.h"
#include "server/calls/server_context.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/connections/acceptor.h"
#include "server/connections/connection_table.h"
#include "server/connections/connection_watch.h"
#include "server/security/authentication.h"
#include "server/security/checkpoint_keys.h"
#include "server/security/file_reloader.h"
#include "server/security/tls_identity.h"
#include "server/stream/idle_timer.h"
#include "server/stream/intake_guard.h"
#include "server/stream/limits.h"
#include "server/stream/opening_calls.h"
#include "server/stream/stream_registry.h"
#include "server/stream/unary_registry.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/metrics_endpoint.h"
#include "server/watch/result_history.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_registry.h"
#include "server/web/web_options.h"

namespace grpc {
class Channel;
class Server;
class ServerCredentials;
namespace experimental {
class ExternalConnectionAcceptor;
}
}  // namespace grpc

namespace partiemc::server {

class HealthService;
class Relay;
class MessageBus;
class Methods;
class Service;
class WebGateway;

/// How a server finds out that a connection is dead although nobody closed it. The name of a
/// producer that vanished is free after both times.
struct Keepalive {
  /// A connection without a sign of life for this time is asked for one.
  std::chrono::milliseconds interval{15'000};
  /// It is closed if it gives none within this time. Longer than the 5 s in which a gRPC client
  /// that waits for nothing looks at its connections.
  std::chrono::milliseconds timeout{10'000};
};

struct ServerOptions {
  Address address{.host = "127.0.0.1", .port = 50051, .unix_path = {}};
  /// Allows an address beyond this machine, although everything travels in the clear.
  bool insecure = false;
  /// Speaks TLS, and nothing else, with this identity.
  std::optional<TlsFiles> tls;
  /// Lets in only callers with a token of this file (BearerTokens::Parse), health checks apart.
  std::optional<std::string> token_file;
  /// Signs checkpoints and takes only those signed by a key of this file (CheckpointKeys::Parse).
  std::optional<std::string> checkpoint_key_file;
  /// How soon a change of those files counts: for connections and calls that begin after it.
  std::chrono::milliseconds reload_interval{1000};
  /// Where metrics are served over HTTP; they hold no names and no data of streams.
  std::optional<Address> metrics;
  /// Where the viewer's page and the methods are served over HTTP and WebSocket, with the same
  /// identity, tokens and limits.
  std::optional<WebOptions> web;
  /// Where replicas tell each other of their streams (ConnectToNats).
  std::optional<std::string> nats;
  /// Where clients that another replica sends away may come to; empty: none is sent here.
  std::string advertised_address;
  /// Threads that compute, all streams together, at least 1.
  unsigned threads = 1;
  ServerLimits limits;
  /// Connections of `address`, in number and in what they may send.
  ConnectionLimits connections;
  /// The bytes of a connection that no call and no message accounts for; 0: not limited.
  std::uint64_t unaccounted_bytes = ConnectionRules{}.unaccounted_bytes;
  Keepalive keepalive;
};

class Server {
 public:
  /// Listens and serves when it returns.
  /// Errors: INVALID_ARGUMENT for an address beyond this machine with neither `tls` nor
  /// `insecure`, and for files of `tls`, tokens or keys that do not hold what they should;
  /// UNAVAILABLE where it cannot listen; a line that says what, where and what to do.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerOptions& options);

  /// Stops at once if it was not drained.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// With the port that it got.
  const Address& address() const { return address_; }
  /// Where metrics are served, if they are.
  std::optional<Address> metrics_address() const;
  /// Where the gateway is, if there is one.
  std::optional<Address> web_address() const;

  /// To this server without a socket, for tests and embedding.
  std::shared_ptr<grpc::Channel> InProcessChannel();

  /// Serves on for `delay`, while health checks say that it does not, so that proxies send nobody
  /// new; in its second half the streams are told to go elsewhere, one after the other, so that
  /// they do not all come there in the same moment. Drain comes next.
  void SendAway(std::chrono::milliseconds delay);

  /// Takes no new call, tells the streams, answers what they have sent, ends watches, and stops.
  /// What is not done shortly before the end of `grace` is cancelled; connections without a call of
  /// ours are not waited for. Returns when nothing goes on any more.
  void Drain(std::chrono::milliseconds grace);

 private:
  Server(const ServerOptions& options, std::unique_ptr<MessageBus> bus);

  absl::Status LoadFiles();
  absl::Status Listen();
  absl::Status OpenGateway();
  void AddGauges();
  void AddRelayMetrics();
  void AddConnectionMetrics();
  void StopBeingReady();
  void WaitUntilNobodyComes(std::chrono::steady_clock::time_point deadline) const;

  const ServerOptions options_;
  Address address_;
  const std::shared_ptr<Metrics> metrics_ = std::make_shared<Metrics>();
  Authentication authentication_;
  CurrentCheckpointKeys checkpoint_keys_;
  std::unique_ptr<CurrentTlsIdentity> tls_identity_;
  std::shared_ptr<grpc::ServerCredentials> credentials_;
  OpeningCalls opening_;
  HistoryRoom history_;
  WatchDispatcher dispatcher_;
  WatchRegistry watchers_;
  StreamRegistry registry_;
  std::unique_ptr<Relay> relay_;
  UnaryRegistry calls_;
  MemoryBudget budget_;
  ComputePool pool_;
  IdleTimer idle_timer_;
  IntakeGuard intake_guard_;
  const ServerContext context_;
  std::unique_ptr<Methods> methods_;
  ConnectionTable connections_;
  std::unique_ptr<Service> service_;
  std::unique_ptr<HealthService> health_;
  std::atomic<bool> leaves_ = false;  // As the gateway's health says.
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> hand_over_;
  std::unique_ptr<StreamCounter> streams_;
  std::unique_ptr<grpc::Server> server_;
  ConnectionWatch watch_;
  std::unique_ptr<Acceptor> acceptor_;  // Stops before what it gives connections to.
  std::unique_ptr<WebGateway> web_;
  // The last two stop before what they load into and read from goes.
  FileReloader reloader_;
  std::unique_ptr<MetricsEndpoint> metrics_endpoint_;
};

}  // namespace partiemc::server
