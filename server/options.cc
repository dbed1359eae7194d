#include "server/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <thread>
#include <utility>

#include "server/base/machine_limits.h"
#include "server/stream/memory_plan.h"

namespace partiemc::server {
namespace {

constexpr char kDescription[] =
    "Serves partiemc.v1: streams of particle frames in, isolines and meshes out.\n"
    "\n"
    "  partiemc-server                                   on 127.0.0.1:50051, this machine only\n"
    "  partiemc-server --address unix:/run/partiemc.sock\n"
    "  partiemc-server --address 0.0.0.0:50051 --tls-cert server.pem --tls-key server.key \\\n"
    "    --token-file tokens                             for any network\n"
    "  partiemc-server --address 0.0.0.0:50051 --insecure   for a network that is trusted\n"
    "  partiemc-server --health-check                    is one running? Exit code 0 or 1\n"
    "\n"
    "SIGTERM or SIGINT drains it: what clients have sent is answered, then it leaves. A second "
    "one\n"
    "ends it at once.\n";

constexpr char kFooter[] =
    "\nEvery option can also stand in the file of --config (TOML or INI, `max-streams = 8`) or in "
    "the\n"
    "environment variable that is named with it. The command line counts most, then the file.\n"
    "GRPC_TRACE is ignored: gRPC's traces print tokens. Clients that give no sign of life for 25 "
    "s\n"
    "are taken for gone.\n"
    "Exit codes: 0 good, 1 failed or cut off after --grace-seconds, 2 wrong command line, 128 + N "
    "ended\n"
    "by a second signal N.";

// What the flags fill in, before it is checked as a whole.
struct Raw {
  std::string address = "127.0.0.1:50051";
  std::string health_check;
  bool print_memory_plan = false;
  std::string port_file;
  std::uint64_t max_frame_bytes = 0;
  double grace_seconds = 4;
  double drain_delay = 0;
  double idle_seconds = std::chrono::duration<double>(ServerLimits{}.idle.streaming).count();
  std::string token_file;
  std::string checkpoint_key_file;
  std::string metrics;
  std::string nats, advertise;
  std::string web, web_port_file;
  WebOptions web_options;
  TlsFiles tls;
  std::string log_format = "text";
  CommandLine line;
};

// Beyond this the receive limit of 1.25 times would not fit into gRPC's int.
constexpr std::uint64_t kMaxFrameBytes = std::numeric_limits<std::int32_t>::max() / 5 * 4;

// A frame is in memory before it is counted, so a small budget wants small frames; but a budget
// that is next to nothing still lets streams go on, one frame after the other.
constexpr std::uint64_t kFramesInBudget = 8;
constexpr std::uint64_t kLeastFrameBytes = 4 << 20;

void AddServingOptions(CLI::App& app, Raw& raw) {
  app.add_option("--address", raw.address,
                 "HOST:PORT, [IPV6]:PORT or unix:PATH to listen on; port 0 takes any that is free")
      ->capture_default_str()
      ->type_name("ADDRESS")
      ->envname("PARTIEMC_ADDRESS");
  app.add_option("--port-file", raw.port_file,
                 "Write the address that was bound to this file once the server serves")
      ->type_name("FILE")
      ->envname("PARTIEMC_PORT_FILE");
  app.add_option(
         "--threads", raw.line.server.threads,
         "Threads that compute, all streams together (default: one for each processor that this "
         "machine or container has); results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_THREADS");
  app.add_option(
         "--grace-seconds", raw.grace_seconds,
         "Once it drains, cancel what is not done within this time, and end a second after it")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->envname("PARTIEMC_GRACE_SECONDS");
  app.add_option("--nats", raw.nats,
                 "Share streams with the other replicas that this server of NATS connects, "
                 "nats://[USER:PASSWORD@]HOST[:PORT] or tls://...: each can then be watched at all "
                 "of them. Several with commas between them")
      ->type_name("URL")
      ->envname("PARTIEMC_NATS");
  app.add_option("--advertise", raw.advertise,
                 "With --nats: where clients reach this server. A replica that drains tells its "
                 "streams the addresses of the others, and clients of this project go there")
      ->type_name("HOST:PORT")
      ->envname("PARTIEMC_ADVERTISE");
  app.add_option("--drain-delay", raw.drain_delay,
                 "After SIGTERM, serve on for this time before it drains, while health checks say "
                 "no, so that proxies send nobody new; in its second half streams are told to go, "
                 "one after the other")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->envname("PARTIEMC_DRAIN_DELAY");
}

void AddSecurity(CLI::App& app, Raw& raw) {
  const char* const kGroup = "Security (files are read again when they change)";
  CLI::Option* certificate =
      app.add_option("--tls-cert", raw.tls.certificate,
                     "Speak TLS with this certificate: PEM, those between it and its root after it")
          ->type_name("FILE")
          ->envname("PARTIEMC_TLS_CERT")
          ->group(kGroup);
  CLI::Option* key = app.add_option("--tls-key", raw.tls.key, "Its private key: PEM, no passphrase")
                         ->type_name("FILE")
                         ->envname("PARTIEMC_TLS_KEY")
                         ->group(kGroup);
  certificate->needs(key);
  key->needs(certificate);
  app.add_option("--tls-client-ca", raw.tls.client_ca,
                 "Take only clients with a certificate signed by an authority of this file (mTLS)")
      ->needs(certificate)
      ->type_name("FILE")
      ->envname("PARTIEMC_TLS_CLIENT_CA")
      ->group(kGroup);
  app.add_option("--token-file", raw.token_file,
                 "Take only calls with a bearer token of this file; a line is TOKEN [NAME] "
                 "[may=produce,watch,list] [names=PATTERN,...] [calls=N] [streams=N] [watchers=N] "
                 "[bytes=64MB]: NAME is its client's in the log, what is left out is not limited. "
                 "Health checks need none")
      ->type_name("FILE")
      ->envname("PARTIEMC_TOKEN_FILE")
      ->group(kGroup);
  app.add_option("--checkpoint-key-file", raw.checkpoint_key_file,
                 "Sign the checkpoints that streams are resumed from, and take only signed ones: a "
                 "key, the same for all servers that share streams; a second line has a key that "
                 "is still, or already, taken")
      ->type_name("FILE")
      ->envname("PARTIEMC_CHECKPOINT_KEY_FILE")
      ->group(kGroup);
  app.add_flag("--insecure", raw.line.server.insecure,
               "Listen on an address that other machines reach, although all travels in the clear")
      ->envname("PARTIEMC_INSECURE")
      ->group(kGroup);
}

void AddLimits(CLI::App& app, Raw& raw) {
  ServerLimits& limits = raw.line.server.limits;
  const char* const kGroup = "Limits";
  app.add_option("--max-streams", limits.max_streams,
                 "Streams open at once; one too many is refused at once")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_STREAMS")
      ->group(kGroup);
  app.add_option("--frames-in-flight", limits.frames_in_flight,
                 "Frames of a stream that are read ahead of its client's taking the answers")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_FRAMES_IN_FLIGHT")
      ->group(kGroup);
  app.add_option("--max-watchers", limits.max_watchers,
                 "Watchers of all streams together; one too many is refused at once")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_WATCHERS")
      ->group(kGroup);
  app.add_option("--max-parts", limits.max_parts,
                 "Parts that frames of a stream may come in, and connections of all streams that "
                 "send them; 0: frames come whole")
      ->check(CLI::Range(0, 10'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_PARTS")
      ->group(kGroup);
  app.add_option("--max-watcher-bytes", limits.max_watcher_bytes,
                 "Memory that one watcher may hold, units as in 16MB allowed; larger results "
                 "cannot be watched")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{4096}, kMaxFrameBytes))
      ->capture_default_str()
      ->type_name("BYTES")
      ->envname("PARTIEMC_MAX_WATCHER_BYTES")
      ->group(kGroup);
  app.add_option("--history-bytes", limits.history_bytes,
                 "Results of a stream that are kept for watchers who come late or go back, units "
                 "as in 64MB allowed, the oldest dropped; of all streams at most an eighth of "
                 "--memory-budget, in equal shares; 0: none")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 50))
      ->capture_default_str()
      ->type_name("BYTES")
      ->envname("PARTIEMC_HISTORY_BYTES")
      ->group(kGroup);
  app.add_option("--max-particles", limits.frame.max_particles, "Particles of one frame")
      ->check(CLI::Range(std::size_t{1}, FrameLimits::kMostParticles))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_PARTICLES")
      ->group(kGroup);
  app.add_option("--max-tiles", limits.frame.max_tiles,
                 "Tiles of 32 x 32 lattice nodes that one frame may reach, 10 kB of memory each "
                 "and more where drops are many")
      ->check(CLI::Range(std::size_t{1}, FrameLimits::kMostTiles))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_TILES")
      ->group(kGroup);
  app.add_option("--max-frame-bytes", raw.max_frame_bytes,
                 "Bytes of one serialised frame, units as in 200MB allowed (default: 48 for each "
                 "of --max-particles, but at most an eighth of --memory-budget)")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{1}, kMaxFrameBytes))
      ->type_name("BYTES")
      ->envname("PARTIEMC_MAX_FRAME_BYTES")
      ->group(kGroup);
  app.add_option("--memory-budget", raw.line.server.limits.memory_budget,
                 "Bytes that requests, answers and histories of all streams hold, units as in 2GB "
                 "allowed; beyond it a stream has one frame in flight, and only in its turn "
                 "(default: half of the memory that this machine or container has)")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::PositiveNumber)
      ->type_name("BYTES")
      ->envname("PARTIEMC_MEMORY_BUDGET")
      ->group(kGroup);
  app.add_option(
         "--streams-beyond-budget", limits.streams_beyond_budget,
         "Streams that may have a frame beyond --memory-budget at the same time; the others "
         "wait to be read. More memory, and less waiting where frames are large")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_STREAMS_BEYOND_BUDGET")
      ->group(kGroup);
  app.add_option("--idle-timeout", raw.idle_seconds,
                 "End a stream that has had no frame for this time; 0: never")
      ->check(CLI::Range(0.0, 1e8))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->envname("PARTIEMC_IDLE_TIMEOUT")
      ->group(kGroup);
}

void AddConnections(CLI::App& app, Raw& raw) {
  ConnectionLimits& limits = raw.line.server.connections;
  const char* const kGroup = "Connections of --address";
  app.add_option("--max-connections", limits.connections,
                 "Connections at once, at most half of the file descriptors; when there is one too "
                 "many, one without a call ends; if all have calls, the new one may only check "
                 "the health")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_MAX_CONNECTIONS")
      ->group(kGroup);
  app.add_option("--connections-per-address", limits.of_address,
                 "Connections of one address at once, health checks apart; 0: not limited, for a "
                 "server behind a proxy")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_CONNECTIONS_PER_ADDRESS")
      ->group(kGroup);
  app.add_option("--new-connections-per-address", limits.new_of_address,
                 "New connections of one address in a second, twice as many at once, health checks "
                 "apart; 0: not limited, for a server behind a proxy")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_NEW_CONNECTIONS_PER_ADDRESS")
      ->group(kGroup);
  app.add_option("--unaccounted-bytes", raw.line.server.unaccounted_bytes,
                 "Bytes of a TCP connection that no call and no message accounts for, units as in "
                 "512KiB allowed; a connection with more is cut, and its address may only check "
                 "the health for ten seconds; 0: not limited")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 40))
      ->capture_default_str()
      ->type_name("BYTES")
      ->envname("PARTIEMC_UNACCOUNTED_BYTES")
      ->group(kGroup);
}

void AddMetrics(CLI::App& app, Raw& raw) {
  app.add_option(
         "--metrics", raw.metrics,
         "Serve metrics to Prometheus at http://ADDRESS/metrics, 127.0.0.1:9464 say: counts "
         "and times, no names and no data of streams. Without it there are none")
      ->type_name("ADDRESS")
      ->envname("PARTIEMC_METRICS")
      ->group("Metrics");
}

void AddWeb(CLI::App& app, Raw& raw) {
  const char* const kGroup = "Web (off without --web)";
  CLI::Option* const web =
      app.add_option("--web", raw.web,
                     "Serve the viewer's page at http://ADDRESS/, 127.0.0.1:8080 say, and the "
                     "methods over WebSocket, with the same TLS, tokens and limits")
          ->type_name("ADDRESS")
          ->envname("PARTIEMC_WEB")
          ->group(kGroup);
  app.add_option("--web-root", raw.web_options.root,
                 "The folder with the built page (default: share/partiemc/viewer of where this is "
                 "installed)")
      ->needs(web)
      ->type_name("DIR")
      ->envname("PARTIEMC_WEB_ROOT")
      ->group(kGroup);
  app.add_option("--web-origin", raw.web_options.origins,
                 "Let pages of this origin call too, https://HOST[:PORT]; may come several times. "
                 "Those that this server serves may always, by the address that it listens on")
      ->needs(web)
      ->type_name("ORIGIN")
      ->envname("PARTIEMC_WEB_ORIGIN")
      ->group(kGroup);
  app.add_option(
         "--web-host", raw.web_options.hosts,
         "Accept requests that name this host, as those that a proxy of this machine passes "
         "on; may be given several times. On a loopback address only localhost, loopback "
         "addresses, these names and the hosts of --web-origin are accepted")
      ->needs(web)
      ->type_name("NAME")
      ->envname("PARTIEMC_WEB_HOST")
      ->group(kGroup);
  app.add_option("--web-frame-ancestors", raw.web_options.frame_ancestors,
                 "Allow pages of this origin to show the viewer's page in a frame, "
                 "https://HOST[:PORT]; may be given several times")
      ->needs(web)
      ->type_name("ORIGIN")
      ->envname("PARTIEMC_WEB_FRAME_ANCESTORS")
      ->group(kGroup);
  app.add_option("--web-connections", raw.web_options.max_connections,
                 "Maximum number of connections. Above it the oldest connection without a request "
                 "is closed; health checks have 16 more")
      ->check(CLI::Range(1, 65'536))
      ->capture_default_str()
      ->needs(web)
      ->type_name("N")
      ->envname("PARTIEMC_WEB_CONNECTIONS")
      ->group(kGroup);
  app.add_option("--web-connections-per-address", raw.web_options.max_per_address,
                 "Maximum number of connections of one address (default: half of "
                 "--web-connections)")
      ->check(CLI::Range(1, 65'536))
      ->needs(web)
      ->type_name("N")
      ->envname("PARTIEMC_WEB_CONNECTIONS_PER_ADDRESS")
      ->group(kGroup);
  app.add_option("--web-port-file", raw.web_port_file, "As --port-file, for --web")
      ->needs(web)
      ->type_name("FILE")
      ->envname("PARTIEMC_WEB_PORT_FILE")
      ->group(kGroup);
}

void AddLogging(CLI::App& app, Raw& raw) {
  const char* const kGroup = "Log (to standard error)";
  app.add_option("--log-level", raw.line.log_level, "How much: one line per stream event at info")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str()
      ->type_name("LEVEL")
      ->envname("PARTIEMC_LOG_LEVEL")
      ->group(kGroup);
  app.add_option("--log-format", raw.log_format, "text, or json: one object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str()
      ->type_name("FORMAT")
      ->envname("PARTIEMC_LOG_FORMAT")
      ->group(kGroup);
}

EarlyExit Wrong(const std::string& message) {
  std::string line = message;
  std::replace(line.begin(), line.end(), '\n', ' ');
  return {2, "partiemc-server: " + line + "; see --help\n"};
}

// Rounded up, so that a short time does not become none.
std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(seconds * 1000)));
}

std::variant<CommandLine, EarlyExit> Check(Raw raw, const CLI::App& app) {
  const auto address = ParseAddress(raw.address);
  if (!address.ok()) return Wrong(std::string(address.status().message()));
  raw.line.server.address = *address;
  if (app.count("--health-check") > 0) {
    const auto asked = raw.health_check.empty() ? address : ParseAddress(raw.health_check);
    if (!asked.ok()) return Wrong(std::string(asked.status().message()));
    raw.line.health_check = *asked;
  }
  if (!raw.metrics.empty()) {
    const auto metrics = ParseAddress(raw.metrics);
    if (!metrics.ok()) return Wrong("--metrics: " + std::string(metrics.status().message()));
    raw.line.server.metrics = *metrics;
  }
  if (!raw.web.empty()) {
    const auto web = ParseAddress(raw.web);
    if (!web.ok()) return Wrong("--web: " + std::string(web.status().message()));
    raw.web_options.address = *web;
    raw.line.server.web = raw.web_options;
    if (!raw.web_port_file.empty()) raw.line.web_port_file = raw.web_port_file;
  }
  if (!raw.nats.empty()) raw.line.server.nats = raw.nats;
  if (!raw.advertise.empty()) {
    const auto advertised = ParseAddress(raw.advertise);
    if (!advertised.ok())
      return Wrong("--advertise: " + std::string(advertised.status().message()));
    if (!advertised->unix_path.empty() || advertised->port == 0) {
      return Wrong("--advertise must be HOST:PORT, with the port that clients connect to");
    }
    if (raw.nats.empty()) return Wrong("--advertise needs --nats: by it replicas are told of it");
    raw.line.server.advertised_address = raw.advertise;
  }
  if (!raw.tls.certificate.empty()) raw.line.server.tls = raw.tls;
  if (!raw.token_file.empty()) raw.line.server.token_file = raw.token_file;
  if (!raw.checkpoint_key_file.empty()) {
    raw.line.server.checkpoint_key_file = raw.checkpoint_key_file;
  }
  raw.line.health_check_security.tls = raw.line.server.tls.has_value();
  if (!raw.tls.client_ca.empty()) {
    raw.line.health_check_security.certificate_file = raw.tls.certificate;
    raw.line.health_check_security.key_file = raw.tls.key;
  }
  raw.line.log_format = raw.log_format == "json" ? LogFormat::kJson : LogFormat::kText;
  if (!raw.port_file.empty()) raw.line.port_file = raw.port_file;
  raw.line.grace = Milliseconds(raw.grace_seconds);
  raw.line.drain_delay = Milliseconds(raw.drain_delay);
  ServerLimits& limits = raw.line.server.limits;
  limits.idle.streaming = Milliseconds(raw.idle_seconds);
  limits.max_frame_bytes =
      raw.max_frame_bytes != 0
          ? raw.max_frame_bytes
          : std::min({ServerLimits::DefaultFrameBytes(limits.frame.max_particles), kMaxFrameBytes,
                      std::max(limits.memory_budget / kFramesInBudget, kLeastFrameBytes)});
  if (raw.print_memory_plan) {
    return EarlyExit{0, MemoryPlan(limits, raw.line.server.threads).ToString()};
  }
  return raw.line;
}

}  // namespace

std::variant<CommandLine, EarlyExit> ParseCommandLine(int argc, const char* const* argv) {
  CLI::App app(kDescription, "partiemc-server");
  app.footer(kFooter);
  Raw raw;
  raw.line.server.threads = AvailableProcessors(std::thread::hardware_concurrency());
  raw.line.server.limits.memory_budget = AvailableMemory() / 2;
  AddServingOptions(app, raw);
  AddSecurity(app, raw);
  AddLimits(app, raw);
  AddConnections(app, raw);
  AddWeb(app, raw);
  AddMetrics(app, raw);
  AddLogging(app, raw);
  app.add_option(
         "--health-check", raw.health_check,
         "Ask the server at this address (default: --address) whether it serves, and leave; "
         "with --tls-cert over TLS, with --tls-client-ca showing --tls-cert to it")
      ->expected(0, 1)
      ->type_name("[ADDRESS]")
      ->configurable(false);
  app.add_flag("--print-memory-plan", raw.print_memory_plan,
               "Print what memory these options may take, and leave")
      ->configurable(false);
  // CLI11 reads the environment only after the file, too late for the file's own name.
  const char* const config = std::getenv("PARTIEMC_CONFIG");
  app.set_config("--config", config != nullptr ? config : "",
                 "Read options from this file (or from that of PARTIEMC_CONFIG)",
                 /*config_required=*/config != nullptr);
  // A misspelt option in the file would otherwise pass in silence.
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.set_version_flag("--version", "partiemc-server " PARTIEMC_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    return EarlyExit{0, app.help()};
  } catch (const CLI::CallForVersion&) {
    return EarlyExit{0, "partiemc-server " PARTIEMC_VERSION "\n"};
  } catch (const CLI::ParseError& error) {
    return Wrong(error.what());
  }
  return Check(std::move(raw), app);
}

}  // namespace partiemc::server
