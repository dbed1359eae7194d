#include "server/options.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <thread>
#include <utility>

#include "server/base/machine_limits.h"
#include "server/limit_flags.h"
#include "server/option_sources.h"
#include "server/security/caller_terms.h"
#include "server/stream/memory_plan.h"

namespace partiemc::server {
namespace {

constexpr char kDescription[] =
    "Serves partiemc.v1: reconstructs outlines and meshes of streamed particle frames.\n"
    "\n"
    "  partiemc-server                                   on 127.0.0.1:50051, for this machine "
    "only\n"
    "  partiemc-server --address unix:/run/partiemc.sock\n"
    "  partiemc-server --address 0.0.0.0:50051 --tls-cert server.pem --tls-key server.key \\\n"
    "    --token-file tokens                             for untrusted networks\n"
    "  partiemc-server --address 0.0.0.0:50051 --insecure   for trusted networks\n"
    "  partiemc-server --health-check                    checks whether one runs: exit code 0 or "
    "1\n"
    "\n"
    "SIGTERM or SIGINT drains the server: it answers the frames it has received, then exits. A\n"
    "second signal ends it at once.\n";

constexpr char kFooter[] =
    "\nEvery option can also be set in the file of --config (TOML or INI, `max-streams = 8`) or "
    "by\n"
    "its environment variable. The command line takes precedence, then the file. The server does\n"
    "not start with an unknown option in the file, or with a misspelt variable PARTIEMC_*. Other\n"
    "unknown variables are logged, except service links of Kubernetes. GRPC_TRACE is ignored,\n"
    "because gRPC's traces print tokens. Clients that are silent for 25 s are disconnected.\n"
    "Exit codes: 0 success, 1 failed or cut off after --grace-seconds, 2 invalid command line,\n"
    "128 + N ended by a second signal N.";

// The values of the flags as CLI11 parsed them. Check examines them together.
struct Raw {
  std::string address = "127.0.0.1:50051";
  std::string health_check;
  bool print_memory_plan = false;
  std::string port_file;
  double grace_seconds = 4;
  double drain_delay = 0;
  LimitFlags limits;
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

void AddServingOptions(CLI::App& app, Raw& raw) {
  app.add_option("--address", raw.address,
                 "HOST:PORT, [IPV6]:PORT or unix:PATH to listen on; port 0 selects a free port")
      ->capture_default_str()
      ->type_name("ADDRESS")
      ->envname("PARTIEMC_ADDRESS");
  app.add_option("--port-file", raw.port_file,
                 "Write the bound address to this file when the server serves")
      ->type_name("FILE")
      ->envname("PARTIEMC_PORT_FILE");
  app.add_option("--threads", raw.line.server.threads,
                 "Compute threads for all streams (default: one per processor of this machine or "
                 "container); results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str()
      ->type_name("N")
      ->envname("PARTIEMC_THREADS");
  app.add_option(
         "--grace-seconds", raw.grace_seconds,
         "Time limit of a drain: remaining calls are cancelled, and the process ends half a "
         "second later")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->envname("PARTIEMC_GRACE_SECONDS");
  app.add_option("--nats", raw.nats,
                 "Share streams with other replicas through this NATS server, "
                 "nats://[USER:PASSWORD@]HOST[:PORT] or tls://...: every stream can be watched at "
                 "every replica. Separate several servers by commas")
      ->type_name("URL")
      ->envname("PARTIEMC_NATS");
  app.add_option(
         "--advertise", raw.advertise,
         "With --nats: address at which clients reach this server. A draining replica sends "
         "its streams the addresses of the others, where they resume")
      ->type_name("HOST:PORT")
      ->envname("PARTIEMC_ADVERTISE");
  app.add_option("--drain-delay", raw.drain_delay,
                 "Time after SIGTERM in which the server still serves, while health checks fail so "
                 "that proxies send no new clients. In its second half, streams are redirected "
                 "one after the other")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->type_name("SECONDS")
      ->envname("PARTIEMC_DRAIN_DELAY");
}

void AddSecurity(CLI::App& app, Raw& raw) {
  const char* const kGroup = "Security (changed files are reloaded)";
  CLI::Option* certificate =
      app.add_option(
             "--tls-cert", raw.tls.certificate,
             "Use TLS with this certificate: PEM, followed by its intermediate certificates")
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
                 "Require client certificates signed by an authority of this file (mTLS)")
      ->needs(certificate)
      ->type_name("FILE")
      ->envname("PARTIEMC_TLS_CLIENT_CA")
      ->group(kGroup);
  app.add_option(
         "--token-file", raw.token_file,
         "Require a bearer token of this file, except for health checks. A line is TOKEN [NAME] "
         "[may=produce,watch,list] [names=PATTERN,...] [calls=N] [streams=N] [watchers=N] "
         "[bytes=64MB]. NAME identifies the client in the log; limits that are left out are "
         "those of --caller-limits. The last line must end with a newline")
      ->type_name("FILE")
      ->envname("PARTIEMC_TOKEN_FILE")
      ->group(kGroup);
  app.add_option(
         "--checkpoint-key-file", raw.checkpoint_key_file,
         "Sign checkpoints with the key in this file, and accept only signed ones. All servers "
         "that share streams need the same key. A second key on its own line is accepted "
         "but not used for signing. The last line must end with a newline")
      ->type_name("FILE")
      ->envname("PARTIEMC_CHECKPOINT_KEY_FILE")
      ->group(kGroup);
  app.add_flag("--insecure", raw.line.server.insecure,
               "Allow an address that other machines can reach without TLS")
      ->envname("PARTIEMC_INSECURE")
      ->group(kGroup);
}

void AddMetrics(CLI::App& app, Raw& raw) {
  app.add_option(
         "--metrics", raw.metrics,
         "Serve Prometheus metrics at http://ADDRESS/metrics, for example 127.0.0.1:9464: counts "
         "and times without names or data of streams. Off by default")
      ->type_name("ADDRESS")
      ->envname("PARTIEMC_METRICS")
      ->group("Metrics");
}

void AddWeb(CLI::App& app, Raw& raw) {
  const char* const kGroup = "Web (off without --web)";
  CLI::Option* const web =
      app.add_option(
             "--web", raw.web,
             "Serve the viewer's page at http://ADDRESS/, for example 127.0.0.1:8080, and the "
             "methods over WebSocket, with the same TLS, tokens and limits")
          ->type_name("ADDRESS")
          ->envname("PARTIEMC_WEB")
          ->group(kGroup);
  app.add_option("--web-root", raw.web_options.root,
                 "Folder of the built page (default: share/partiemc/viewer of the installation)")
      ->needs(web)
      ->type_name("DIR")
      ->envname("PARTIEMC_WEB_ROOT")
      ->group(kGroup);
  app.add_option(
         "--web-origin", raw.web_options.origins,
         "Allow pages of this origin, https://HOST[:PORT], to call; may be given several times. "
         "Pages of this server may always call")
      ->needs(web)
      ->type_name("ORIGIN")
      ->envname("PARTIEMC_WEB_ORIGIN")
      ->group(kGroup);
  app.add_option(
         "--web-host", raw.web_options.hosts,
         "Accept requests for this host name, for example from a proxy on this machine; may be "
         "given several times. The server accepts only localhost, loopback addresses, these names "
         "and the hosts of --web-origin; if it listens on another than a loopback address, also "
         "any IP address, and with TLS or tokens and without this option any name")
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
  app.add_option("--web-port-file", raw.web_port_file, "Same as --port-file for --web")
      ->needs(web)
      ->type_name("FILE")
      ->envname("PARTIEMC_WEB_PORT_FILE")
      ->group(kGroup);
}

void AddLogging(CLI::App& app, Raw& raw) {
  const char* const kGroup = "Log (to standard error)";
  app.add_option("--log-level", raw.line.log_level,
                 "Log level; info writes one line per stream event")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str()
      ->type_name("LEVEL")
      ->envname("PARTIEMC_LOG_LEVEL")
      ->group(kGroup);
  app.add_option("--log-format", raw.log_format, "text, or json with one object per line")
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

// Rounds up: a short positive time must not become 0, which means no limit.
std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::ceil(seconds * 1000)));
}

std::variant<CommandLine, EarlyExit> Check(Raw raw, const CLI::App& app, const ConfigFile& file) {
  const auto wrong = [&](const std::string& flag, const absl::Status& status) {
    return Wrong(file.WithLine(flag + ": " + std::string(status.message())));
  };
  const auto address = ParseAddress(raw.address);
  if (!address.ok()) return wrong("--address", address.status());
  raw.line.server.address = *address;
  if (app.count("--health-check") > 0) {
    const auto asked = raw.health_check.empty() ? address : ParseAddress(raw.health_check);
    if (!asked.ok()) return wrong("--health-check", asked.status());
    raw.line.health_check = *asked;
  }
  if (!raw.metrics.empty()) {
    const auto metrics = ParseAddress(raw.metrics);
    if (!metrics.ok()) return wrong("--metrics", metrics.status());
    raw.line.server.metrics = *metrics;
  }
  if (!raw.web.empty()) {
    const auto web = ParseAddress(raw.web);
    if (!web.ok()) return wrong("--web", web.status());
    raw.web_options.address = *web;
    raw.line.server.web = raw.web_options;
    if (!raw.web_port_file.empty()) raw.line.web_port_file = raw.web_port_file;
  }
  if (!raw.nats.empty()) raw.line.server.nats = raw.nats;
  if (!raw.advertise.empty()) {
    const auto advertised = ParseAddress(raw.advertise);
    if (!advertised.ok()) return wrong("--advertise", advertised.status());
    if (!advertised->unix_path.empty() || advertised->port == 0) {
      return Wrong(
          file.WithLine("--advertise must be HOST:PORT, with the port that clients connect to"));
    }
    if (raw.nats.empty()) {
      return Wrong(file.WithLine("--advertise needs --nats, which sends the address to replicas"));
    }
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
  limits.idle.streaming = Milliseconds(raw.limits.idle_seconds);
  limits.max_frame_bytes = FrameBytes(raw.limits, limits);
  const auto caller_limits = ParseCallerQuota(raw.limits.caller_limits);
  if (!caller_limits.ok()) return wrong("--caller-limits", caller_limits.status());
  raw.line.server.caller_limits = *caller_limits;
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
  AddLimitFlags(app, raw.line.server.limits, raw.limits);
  AddConnectionFlags(app, raw.line.server);
  AddWeb(app, raw);
  AddMetrics(app, raw);
  AddLogging(app, raw);
  app.add_option(
         "--health-check", raw.health_check,
         "Check whether the server at this address (default: --address) serves, and exit. Uses "
         "TLS with --tls-cert, and that certificate as client certificate with --tls-client-ca")
      ->expected(0, 1)
      ->type_name("[ADDRESS]")
      ->configurable(false);
  app.add_flag("--print-memory-plan", raw.print_memory_plan,
               "Print the maximum memory for these options, and exit")
      ->configurable(false);
  // Reads the variable here, because CLI11 evaluates environment variables after it has read the
  // config file: too late for the name of this file.
  const char* const config = std::getenv("PARTIEMC_CONFIG");
  app.set_config("--config", config != nullptr ? config : "",
                 "Read options from this file (environment: PARTIEMC_CONFIG)",
                 /*config_required=*/config != nullptr);
  const auto file = std::make_shared<ConfigFile>(app);
  app.config_formatter(file);
  app.set_version_flag("--version", "partiemc-server " PARTIEMC_VERSION);
  UnknownVariables unknown = FindUnknownVariables(app, environ);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    return EarlyExit{0, app.help()};
  } catch (const CLI::CallForVersion&) {
    return EarlyExit{0, "partiemc-server " PARTIEMC_VERSION "\n"};
  } catch (const CLI::ParseError& error) {
    // A misspelt variable can be the cause of the other error.
    return Wrong(unknown.error ? *unknown.error : file->WithLine(error.what()));
  }
  if (unknown.error) return Wrong(*unknown.error);
  raw.line.ignored_variables = std::move(unknown.ignored);
  return Check(std::move(raw), app, *file);
}

}  // namespace partiemc::server
