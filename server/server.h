// The running server: serves the methods, health checks and reflection over gRPC, runs the gateway,
// and drains.
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
#include "server/compute/state_memory.h"
#include "server/connections/acceptor.h"
#include "server/connections/connection_table.h"
#include "server/connections/connection_watch.h"
#include "server/relay/finished_streams.h"
#include "server/security/authentication.h"
#include "server/security/caller_terms.h"
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
#include "server/watch/level_queue.h"
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

/// Settings for detecting a connection that is dead but was not closed. If a producer is lost, its
/// stream's name becomes free after the sum of both times.
struct Keepalive {
  /// The server sends a ping to a connection that is silent for this time.
  std::chrono::milliseconds interval{15'000};
  /// The server closes the connection if it stays silent for this time after the ping. It must
  /// exceed 5 s, because an idle gRPC client reads its connections only every 5 s.
  std::chrono::milliseconds timeout{10'000};
};

struct ServerOptions {
  Address address{.host = "127.0.0.1", .port = 50051, .unix_path = {}};
  /// Permits to serve without TLS on an address that other machines can reach.
  bool insecure = false;
  /// If set, connections use TLS with this certificate and key.
  std::optional<TlsFiles> tls;
  /// If set, the server admits only callers with a token of this file (BearerTokens::Parse). Health
  /// checks need no token.
  std::optional<std::string> token_file;
  /// If set, the server signs checkpoints, and accepts only checkpoints that were signed with a key
  /// of this file (CheckpointKeys::Parse).
  std::optional<std::string> checkpoint_key_file;
  /// Interval for checking the files above for changes. A change applies to later connections and
  /// calls.
  std::chrono::milliseconds reload_interval{1000};
  /// Maximum length of a call of reflection.
  std::chrono::milliseconds reflection_time{30'000};
  /// If set, the server serves metrics over HTTP at this address. They contain no names and no data
  /// of streams.
  std::optional<Address> metrics;
  /// If set, the server runs the gateway, which serves the viewer's page and the methods over HTTP
  /// and WebSocket. The gateway uses the same identity, tokens and limits.
  std::optional<WebOptions> web;
  /// If set, the URL of the NATS server that connects the replicas (ConnectToNats).
  std::optional<std::string> nats;
  /// Address of this server for clients. Replicas that drain send their clients to it. Empty: none.
  std::string advertised_address;
  /// Number of compute threads for all streams together, at least 1.
  unsigned threads = 1;
  ServerLimits limits;
  /// Limits of each caller: of a token, for values that its line does not set, or without tokens of
  /// an address (HostOfPeer). Without `calls`, ServerLimits::CallsOfOneCaller applies.
  CallerQuota caller_limits;
  /// Limits of the connections of `address`.
  ConnectionLimits connections;
  /// Maximum number of bytes that a connection has received and that belong to no call and no
  /// message. The server cuts a connection that exceeds it. 0 disables this limit, and the limits
  /// of a connection's streams and headers.
  std::uint64_t unaccounted_bytes = ConnectionRules{}.unaccounted_bytes;
  Keepalive keepalive;
};

class Server {
 public:
  /// Starts the server; it listens and serves when this returns. Errors: INVALID_ARGUMENT for an
  /// address that other machines can reach if neither `tls` nor `insecure` is set, and for invalid
  /// files of TLS, tokens or keys; UNAVAILABLE if it cannot listen; the errors of ConnectToNats.
  /// Each message is one line: problem, place, remedy.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerOptions& options);

  /// Unless Drain has already stopped the server: stops it without a grace time and cancels its
  /// calls. With NATS, the last results are first sent to the other replicas, for at most 2 s.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// With the actual port.
  const Address& address() const { return address_; }
  /// Absent if metrics are off.
  std::optional<Address> metrics_address() const;
  /// Absent if the gateway is off.
  std::optional<Address> web_address() const;

  /// Creates a channel to this server within the process, without a socket, for tests and
  /// embedding.
  std::shared_ptr<grpc::Channel> InProcessChannel();

  /// Serves for the time `delay`. During this time, health checks report that the server does not
  /// serve, so that proxies send it no new clients. In the second half of the time, streams are
  /// redirected one after the other, so that their clients do not reconnect at the same moment.
  /// Call Drain afterwards.
  void SendAway(std::chrono::milliseconds delay);

  /// Refuses new calls, notifies the streams, responds to the frames that they have sent, ends
  /// watches and stops. Calls that still run shortly before `grace` has passed are cancelled.
  /// Connections without a call are closed. Returns when all calls have ended.
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
  FinishedStreams finished_;
  std::unique_ptr<Relay> relay_;
  UnaryRegistry calls_;
  MemoryBudget budget_;
  StateMemory states_;
  ComputePool pool_;
  std::shared_ptr<LevelQueue> levels_;
  IdleTimer idle_timer_;
  IntakeGuard intake_guard_;
  const ServerContext context_;
  std::unique_ptr<Methods> methods_;
  ConnectionTable connections_;
  std::unique_ptr<Service> service_;
  std::unique_ptr<HealthService> health_;
  std::atomic<bool> leaves_ = false;  // Reported by the gateway's health check.
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> hand_over_;
  std::unique_ptr<StreamCounter> streams_;
  std::unique_ptr<grpc::Server> server_;
  ConnectionWatch watch_;
  std::unique_ptr<Acceptor>
      acceptor_;  // Destroyed before the objects that receive its connections.
  std::unique_ptr<WebGateway> web_;
  // reloader_ and metrics_endpoint_ come last, so they are destroyed before the objects that they
  // use.
  FileReloader reloader_;
  std::unique_ptr<MetricsEndpoint> metrics_endpoint_;
};

/// Lets gRPC honour the server's limit of the bytes in one read from a socket: switches gRPC's
/// experiment `tcp_read_chunks` off by the environment variable GRPC_EXPERIMENTS. gRPC 1.51 as
/// Debian builds it has the experiment on; then a read takes 64 KiB whatever the limit says, and a
/// flood of calls over TLS takes 125 instead of 50 MiB. Requires: gRPC has not started.
void LimitReadsOfGrpc();

}  // namespace partiemc::server
