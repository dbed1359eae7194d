#include "server/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/base/received_bytes.h"
#include "server/calls/methods.h"
#include "server/calls/surface_level.h"
#include "server/compute/heap.h"
#include "server/compute/worker_memory.h"
#include "server/relay/nats_bus.h"
#include "server/relay/relay.h"
#include "server/rpc/call_guard.h"
#include "server/rpc/health_service.h"
#include "server/rpc/service.h"
#include "server/rpc/stream_counts.h"
#include "server/security/secrets.h"
#include "server/security/tls_credentials.h"
#include "server/stream/memory_plan.h"
#include "server/telemetry/logging.h"
#include "server/web/web_gateway.h"

namespace partiemc::server {
namespace {

// Maximum size of one read from a connection.
constexpr int kReadBytes = 32 << 10;

// Time limit for the handshakes of HTTP/2 and TLS on a new connection.
constexpr int kHandshakeTimeoutMs = 10'000;
constexpr int kReflectionThreads = 16;

// Descriptors that are reserved for the gateway, files and threads; the rest is available for
// gRPC's connections.
constexpr std::uint64_t kOtherDescriptors = 512;

// Allowance for streams of a connection that have ended but that gRPC has not destroyed yet.
constexpr std::uint64_t kStreamsThatEnd = 64;

constexpr std::chrono::milliseconds kTimeToCut(250);
// Time for the last statuses to arrive and for connections to close cleanly. Without this limit,
// gRPC waits for a reply of each client, and an idle client reads only every few seconds.
constexpr std::chrono::milliseconds kTimeToClose(500);
// The drain waits until no new call has arrived for this time. It is several times as long as a new
// call takes to arrive.
constexpr std::chrono::milliseconds kQuiet(50);

absl::Status CheckSecurity(const ServerOptions& options, const Address& address) {
  if (options.tls || options.insecure || address.IsLocal()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "address ", address.ToString(), " can be reached from other machines, and ",
      options.token_file ? "tokens" : "everything",
      " would travel in the clear; give --tls-cert and --tls-key, listen on 127.0.0.1, or add "
      "--insecure if the network is trusted"));
}

template <typename Parse>
auto ReadSecrets(const std::string& flag, const std::string& path, Parse parse)
    -> decltype(parse(std::string())) {
  const auto text = ReadSmallFile(flag, path);
  if (!text.ok()) return text.status();
  const auto wrong = [&](const absl::Status& status) {
    return absl::InvalidArgumentError(absl::StrCat(flag, " ", path, ": ", status.message()));
  };
  if (const auto status = CheckIsWhole(*text); !status.ok()) return wrong(status);
  auto secrets = parse(*text);
  if (!secrets.ok()) return wrong(secrets.status());
  return secrets;
}

// The limits that IntakeGuard enforces for the memory of the process. The process may hold its
// memory at the start, the workers, the states of streams, the newest results of streams, and the
// budget, which includes the histories. In addition it may hold frames beyond the budget, and
// results that watchers have not received yet or levels of detail of them, up to a sixteenth of the
// budget.
IntakeGuard::Process WatchedProcess(const ServerOptions& options, const MemoryBudget& budget,
                                    const StateMemory& states, const WatchRegistry& watchers,
                                    const LevelQueue& levels) {
  const std::uint64_t own_states = options.limits.max_streams * ServerLimits::kOwnStateBytes;
  const std::uint64_t outside = ResidentBytes() + options.threads * kWorkerBytes +
                                options.limits.AllHistoryBytes() +
                                KeptBytesBeyondHistories(options.limits) + own_states;
  const std::uint64_t room = budget.bytes(), more = room / kPartsOfBudgetBeyond;
  const std::uint64_t most =
      room + options.limits.ReadBytesBeyond() + options.limits.WorkerBytesBeyond();
  return {.resident_bytes = ResidentBytes,
          .most_bytes =
              [outside, room, most, &budget, &states] {
                return outside + states.held() + std::clamp(budget.planned(), room, most);
              },
          .more_bytes =
              [more, &watchers, &levels] {
                return std::min(watchers.held_bytes() + levels.kept_bytes(), more);
              },
          .give_back_freed = GiveBackFreedMemory,
          .limit_bytes = outside + options.limits.SharedStateBytes() + most,
          .received_bytes = ReceivedBytesOfConnections};
}

BeyondBudget BeyondOf(const ServerLimits& limits) {
  return {.reads = {.streams_beyond = limits.streams_beyond_budget,
                    .message_bytes = limits.MaxMessageBytes()},
          .worker_bytes = limits.WorkerBytesBeyond()};
}

// Limits the connections by the free descriptors; each connection uses two.
ConnectionLimits LimitsOfConnections(const ServerOptions& options) {
  ConnectionLimits limits = options.connections;
  rlimit descriptors{};
  if (getrlimit(RLIMIT_NOFILE, &descriptors) != 0) return limits;
  const std::uint64_t free =
      descriptors.rlim_cur - std::min<std::uint64_t>(descriptors.rlim_cur, kOtherDescriptors);
  constexpr std::uint32_t kNoLimit = std::numeric_limits<std::uint32_t>::max();
  const std::uint32_t most = limits.connections == 0 ? kNoLimit : limits.connections;
  limits.connections = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(free / 2, 1, most));
  return limits;
}

// Without a limit of unaccounted bytes, max_streams is unlimited, too (0). Otherwise it exceeds the
// calls of one caller, so only a flood reaches it.
ConnectionRules RulesOfConnections(const ServerOptions& options) {
  return {.unaccounted_bytes = options.unaccounted_bytes,
          .max_message_bytes = options.limits.MaxMessageBytes(),
          .max_streams = options.unaccounted_bytes == 0
                             ? std::uint64_t{0}
                             : options.limits.CallsOfOneCaller() + kStreamsThatEnd};
}

// The limits of the relay. kept_bytes is as large as a watcher's limit, so that the newest result
// of another replica's stream is always kept: fetching it again takes time.
Relay::Limits RelayLimits(const ServerLimits& limits, HistoryRoom& history,
                          FinishedStreams& finished) {
  return {.broadcaster = {.mailbox_bytes = limits.max_watcher_bytes,
                          .kept_bytes = limits.max_watcher_bytes},
          .watcher_bytes = limits.max_watcher_bytes,
          .history = limits.history_bytes > 0 ? &history : nullptr,
          .finished = &finished,
          .watches = limits.max_watchers};
}

CallerQuota WithCalls(CallerQuota quota, std::uint32_t calls) {
  if (!quota.calls) quota.calls = calls;
  return quota;
}

// Time for watchers to read the end of their watch when the server drains.
constexpr std::chrono::milliseconds kWatchPatience(500);

}  // namespace

Server::Server(const ServerOptions& options, std::unique_ptr<MessageBus> bus)
    : options_(options),
      address_(options.address),
      authentication_(WithCalls(options.caller_limits, options.limits.CallsOfOneCaller())),
      tls_identity_(std::make_unique<CurrentTlsIdentity>()),
      opening_(options.limits.MaxOpeningCalls()),
      history_(options.limits.history_bytes, options.limits.AllHistoryBytes()),
      watchers_(options.limits.max_watchers),
      registry_(options.limits.max_streams, options.limits.history_bytes > 0 ? &history_ : nullptr,
                options.limits.max_parts),
      relay_(bus == nullptr
                 ? nullptr
                 : std::make_unique<Relay>(std::move(bus), registry_, dispatcher_,
                                           RelayLimits(options.limits, history_, finished_),
                                           options.advertised_address)),
      calls_(options.limits.max_streams),
      budget_(options.limits.FrameBudget(), BeyondOf(options.limits)),
      states_(options.limits.SharedStateBytes(), ServerLimits::kOwnStateBytes),
      pool_(options.threads, kWarmTime, metrics_.get(), &budget_),
      levels_(std::make_shared<LevelQueue>(
          dispatcher_,
          [this](const LevelQueue::Frame& exact, const LevelOfDetail& level,
                 const std::atomic<bool>& cancelled) {
            return MakeResultLevel(exact, level, cancelled, budget_);
          },
          LevelQueue::Limits{.kept_bytes = options.limits.LevelBytes()})),
      idle_timer_(registry_, watchers_, calls_, options.limits),
      intake_guard_(opening_, WatchedProcess(options, budget_, states_, watchers_, *levels_),
                    &budget_.reads()),
      context_{.limits = options_.limits,
               .authentication = authentication_,
               .checkpoint_keys = checkpoint_keys_,
               .history = history_,
               .opening = opening_,
               .streams = registry_,
               .finished = finished_,
               .unary_calls = calls_,
               .watchers = watchers_,
               .dispatcher = dispatcher_,
               .levels = *levels_,
               .budget = budget_,
               .states = states_,
               .pool = pool_,
               .relay = relay_.get()},
      methods_(std::make_unique<Methods>(context_, *metrics_)),
      service_(std::make_unique<Service>(*methods_, connections_)),
      health_(std::make_unique<HealthService>(context_, connections_)),
      watch_(LimitsOfConnections(options), RulesOfConnections(options), connections_) {}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options) {
  if (auto status = CheckSecurity(options, options.address); !status.ok()) return status;
  if (options.web) {
    if (auto status = CheckSecurity(options, options.web->address); !status.ok()) return status;
  }
  std::unique_ptr<MessageBus> bus;
  if (options.nats) {
    auto connection = ConnectToNats(*options.nats);
    if (!connection.ok()) return connection.status();
    bus = *std::move(connection);
  }
  std::unique_ptr<Server> server(new Server(options, std::move(bus)));
  if (auto status = server->LoadFiles(); !status.ok()) return status;
  if (auto status = server->Listen(); !status.ok()) return status;
  if (options.web) {
    if (auto status = server->OpenGateway(); !status.ok()) return status;
  }
  server->reloader_.Start(options.reload_interval);
  if (options.metrics) {
    server->AddGauges();
    auto endpoint = MetricsEndpoint::Listen(*options.metrics, server->metrics_);
    if (!endpoint.ok()) return endpoint.status();
    server->metrics_endpoint_ = *std::move(endpoint);
  }
  return server;
}

absl::Status Server::LoadFiles() {
  if (options_.tls) {
    auto status = reloader_.Add("TLS certificate", options_.tls->All(), [this] {
      auto identity = ReadTlsIdentity(*options_.tls);
      if (!identity.ok()) return identity.status();
      const auto now = std::chrono::system_clock::now();
      if (identity->not_after < now) {
        const auto current = tls_identity_->Get().identity;
        if (current != nullptr && current->not_after >= now) {
          return absl::InvalidArgumentError(options_.tls->certificate +
                                            ": has expired; the current one has not");
        }
        LogEvent(spdlog::level::warn, "TLS certificate has expired, clients will refuse it",
                 {{"file", options_.tls->certificate}});
      }
      tls_identity_->Set(*std::move(identity));
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
  }
  if (options_.token_file) {
    auto status = reloader_.Add("tokens", {*options_.token_file}, [this] {
      auto tokens = ReadSecrets("--token-file", *options_.token_file, BearerTokens::Parse);
      if (!tokens.ok()) return tokens.status();
      authentication_.Set(*std::move(tokens));
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
  }
  if (options_.checkpoint_key_file) {
    auto status = reloader_.Add("checkpoint keys", {*options_.checkpoint_key_file}, [this] {
      auto keys = ReadSecrets("--checkpoint-key-file", *options_.checkpoint_key_file,
                              CheckpointKeys::Parse);
      if (!keys.ok()) return keys.status();
      checkpoint_keys_.Set(*std::move(keys));
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

std::optional<Address> Server::metrics_address() const {
  if (metrics_endpoint_ == nullptr) return std::nullopt;
  return metrics_endpoint_->address();
}

absl::Status Server::Listen() {
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  auto acceptor = Acceptor::Listen(address_, options_.keepalive.timeout, watch_);
  if (!acceptor.ok()) return acceptor.status();
  credentials_ =
      options_.tls ? MakeTlsCredentials(*tls_identity_) : grpc::InsecureServerCredentials();
  hand_over_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials_);
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(
      MakeGuardOfForeignServices(authentication_, connections_, options_.reflection_time));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  builder.RegisterService(service_.get());
  builder.RegisterService(health_.get());
  builder.SetMaxReceiveMessageSize(static_cast<int>(options_.limits.MaxMessageBytes()));
  // Disables gRPC's own limit of PINGs: ConnectionWatch counts PINGs with all other bytes. If gRPC
  // enforced its limit, a flood of PINGs would make it create error objects of up to 64 MiB.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  // Detects lost clients, such as a frozen program or a cut cable. Without keepalive they would
  // hold their streams for hours.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS,
                             static_cast<int>(options_.keepalive.interval.count()));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS,
                             static_cast<int>(options_.keepalive.timeout.count()));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // No limit.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeoutMs);
  // Fixes the flow-control window: the bytes that a client may send before the server reads them.
  // If gRPC could enlarge the windows, a hundred unread bodies would hold 70 MiB. A pending read
  // opens the window for the whole message, so a large frame loses only one round trip.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, static_cast<int>(kUnreadBytes));
  // The maximum number of HTTP/2 streams of a connection equals the default limit of a caller's
  // calls. Further calls wait in the client or use another connection.
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(options_.limits.CallsOfOneCaller()));
  // Limits the size of one read from a socket. gRPC parses all bytes of a read, even if the
  // connection has been cut. A read of 32 KiB can contain 4,000 calls, which take 40 MiB. gRPC's
  // default of 4 MiB could take more than 1 GiB. The limit needs LimitReadsOfGrpc.
  builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kReadBytes);
  // Limits the threads of the reflection service, the only service that occupies a thread for each
  // call.
  grpc::ResourceQuota quota;
  quota.SetMaxThreads(kReflectionThreads);
  builder.SetResourceQuota(quota);
  server_ = builder.BuildAndStart();
  if (server_ == nullptr) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve on ", address_.ToString(), ": gRPC refuses its options"));
  }
  acceptor_ = *std::move(acceptor);
  if (address_.unix_path.empty()) address_.port = acceptor_->port();
  streams_ = std::make_unique<ChannelzStreams>();
  watch_.Start(streams_.get());
  acceptor_->Start([this](int descriptor) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = descriptor;
    hand_over_->HandleNewConnection(&connection);
  });
  health_->SetServing(true);
  return absl::OkStatus();
}

void LimitReadsOfGrpc() {
  constexpr char kName[] = "GRPC_EXPERIMENTS", kOff[] = "-tcp_read_chunks";
  const char* const others = std::getenv(kName);
  // gRPC applies the last one of two contradicting entries.
  setenv(kName, others == nullptr ? kOff : absl::StrCat(others, ",", kOff).c_str(), 1);
}

absl::Status Server::OpenGateway() {
  auto web = WebGateway::Start(*options_.web, {.methods = *methods_,
                                               .limits = options_.limits,
                                               .tls = options_.tls ? tls_identity_.get() : nullptr,
                                               .has_tokens = options_.token_file.has_value(),
                                               .metrics = *metrics_,
                                               .draining = [this] { return leaves_.load(); },
                                               .ping_interval = options_.keepalive.interval,
                                               .ping_timeout = options_.keepalive.timeout});
  if (!web.ok()) return web.status();
  web_ = *std::move(web);
  return absl::OkStatus();
}

std::optional<Address> Server::web_address() const {
  if (web_ == nullptr) return std::nullopt;
  return web_->address();
}

Server::~Server() {
  // Drains the relay first: watch calls stop waiting for streams of other replicas.
  if (relay_ != nullptr) relay_->Drain();
  // Ends the calls of the gateway while the objects that they use still exist.
  if (web_ != nullptr) web_->Stop(std::chrono::steady_clock::now());
  if (server_ == nullptr) return;
  acceptor_->StopListening();
  watch_.EndAllAt(std::chrono::steady_clock::now() + kTimeToClose);
  server_->Shutdown(std::chrono::system_clock::now());
  server_->Wait();
  acceptor_.reset();
  levels_->Stop();  // It uses the budget.
}

// Waits until no new calls arrive. gRPC's shutdown would cut a new call without a reason. Before
// the shutdown, the server refuses new calls with a reason, so that their clients try another
// server.
void Server::WaitUntilNobodyComes(std::chrono::steady_clock::time_point deadline) const {
  std::uint64_t before = 0;
  do {
    before = registry_.turned_away();
    std::this_thread::sleep_until(std::min(deadline, std::chrono::steady_clock::now() + kQuiet));
  } while (registry_.turned_away() != before && std::chrono::steady_clock::now() < deadline);
}

std::shared_ptr<grpc::Channel> Server::InProcessChannel() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  return server_->InProcessChannel(arguments);
}

void Server::StopBeingReady() {
  leaves_ = true;
  health_->SetServing(false);
  if (relay_ == nullptr) return;
  relay_->WillDrain();
  registry_.SetElsewhere(relay_->Addresses());
}

void Server::SendAway(std::chrono::milliseconds delay) {
  StopBeingReady();
  std::this_thread::sleep_for(delay / 2);
  if (relay_ != nullptr)
    registry_.SetElsewhere(relay_->Addresses());  // Addresses of replicas that do not drain.
  registry_.SendAway(delay - delay / 2);
}

void Server::Drain(std::chrono::milliseconds grace) {
  // Reserves part of the grace time: in it, clients that do not read their responses are cut.
  const auto deadline = std::chrono::steady_clock::now() + grace - std::min(grace / 8, kTimeToCut);
  StopBeingReady();
  registry_.Drain();
  calls_.Drain();
  // Streams must end before gRPC's Shutdown, which sends nothing to them: it waits, then cuts them.
  // A stream must also have sent its status: closing a connection that has unread requests discards
  // the bytes just written.
  registry_.WaitUntilEmpty(deadline);
  calls_.WaitForFrames(deadline);
  dispatcher_.Flush();  // Delivers the last results before the watches end.
  if (relay_ != nullptr) relay_->Drain();
  watchers_.Drain(std::min(deadline, std::chrono::steady_clock::now() + kWatchPatience));
  WaitUntilNobodyComes(deadline);
  const auto left = std::clamp<std::chrono::steady_clock::duration>(
      deadline - std::chrono::steady_clock::now(), std::chrono::steady_clock::duration::zero(),
      kTimeToClose);
  const auto closed = std::chrono::system_clock::now() + left;
  if (web_ != nullptr) web_->Stop(std::chrono::steady_clock::now() + left);
  acceptor_->StopListening();
  // Sets a deadline for connections, because a client that does not respond would delay the
  // shutdown.
  watch_.EndAllAt(std::chrono::steady_clock::now() + left);
  server_->Shutdown(closed);
  server_->Wait();
  metrics_endpoint_.reset();  // Last, so that metrics cover the drain.
}

}  // namespace partiemc::server
