// The metrics that the server reads from its parts: gauges of what they hold, counters of what they
// did.
#include <atomic>
#include <chrono>
#include <cstdint>

#include "server/relay/relay.h"
#include "server/server.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {

void Server::AddGauges() {
  const auto add = [this](const char* name, const char* help, auto value) {
    metrics_->AddGauge(name, help, [value] { return static_cast<double>(value()); });
  };
  add("partiemc_streams", "Open streams.", [this] { return registry_.OpenCount(); });
  add("partiemc_watchers", "Watchers of all streams.", [this] { return watchers_.count(); });
  add("partiemc_compute_queue_length", "Frames that wait for a thread.",
      [this] { return pool_.QueueLength(); });
  add("partiemc_memory_held_bytes", "Requests and answers of all streams.",
      [this] { return budget_.held(); });
  add("partiemc_memory_budget_bytes", "What they may hold together.",
      [this] { return budget_.bytes(); });
  add("partiemc_state_bytes", "States of streams between their frames, above 64 KiB of each.",
      [this] { return states_.held(); });
  add("partiemc_watched_bytes",
      "Results that watchers have not taken yet, counted for each although they share them; "
      "outside of the budget.",
      [this] { return watchers_.held_bytes(); });
  add("partiemc_history_bytes",
      "Results that watchers can go back to, of all streams; a part of --memory-budget of its own.",
      [this] { return history_.held(); });
  add("partiemc_level_bytes", "Levels of detail that are kept for watchers, outside of the budget.",
      [this] { return levels_->kept_bytes(); });
  add("partiemc_levels_waiting", "Levels of detail that wait for their thread or are computed.",
      [this] { return levels_->waiting(); });
  metrics_->AddCounter("partiemc_levels_computed_total", "Levels of detail that were computed.",
                       [this] { return static_cast<double>(levels_->computed()); });
  metrics_->AddCounter("partiemc_levels_shared_total",
                       "Frames for which a watcher received a level that was computed for another.",
                       [this] { return static_cast<double>(levels_->shared()); });
  if (relay_ != nullptr) AddRelayMetrics();
  AddConnectionMetrics();
  const auto count = [this](const char* name, const char* help, std::uint64_t LogLosses::*value) {
    metrics_->AddCounter(name, help, [value] { return static_cast<double>(LossesOfLog().*value); });
  };
  count("partiemc_log_lines_dropped_total", "Lines that standard error was too slow for.",
        &LogLosses::dropped_lines);
  count("partiemc_log_refusals_held_back_total", "Refusals beyond what the log tells in a second.",
        &LogLosses::refusals_held_back);
  count("partiemc_log_calls_held_back_total",
        "Begins and ends of calls beyond what the log tells in a second.",
        &LogLosses::calls_held_back);
  if (!options_.tls) return;
  add("partiemc_tls_certificate_not_after_seconds", "When the server's certificate expires (Unix).",
      [this] {
        return std::chrono::system_clock::to_time_t(tls_identity_->Get().identity->not_after);
      });
}

void Server::AddConnectionMetrics() {
  metrics_->AddGauge("partiemc_connections", "Connections of --address.",
                     [this] { return static_cast<double>(watch_.count()); });
  const auto add = [this](const char* name, const char* help,
                          const std::atomic<std::uint64_t>& count) {
    metrics_->AddCounter(name, help, [&count] { return static_cast<double>(count.load()); });
  };
  const ConnectionWatch::Counters& counters = watch_.counters();
  add("partiemc_connections_accepted_total", "Connections that were accepted.", counters.accepted);
  add("partiemc_connections_health_only_total",
      "Connections beyond a limit, which are for health checks alone.", counters.health_only);
  add("partiemc_connections_evicted_total",
      "Connections without a call that were ended for a new one.", counters.evicted);
  add("partiemc_connections_cut_unaccounted_total",
      "Connections that were cut for bytes that no call accounts for.", counters.floods[0]);
  add("partiemc_connections_cut_streams_total", "Connections that were cut for too many streams.",
      counters.floods[1]);
  add("partiemc_connections_cut_headers_total",
      "Connections that were cut for headers without an end.", counters.floods[2]);
}

void Server::AddRelayMetrics() {
  const auto add = [this](const char* name, const char* help, auto value) {
    metrics_->AddGauge(name, help, [value] { return static_cast<double>(value()); });
  };
  add("partiemc_relay_connected", "Whether NATS can be reached.",
      [this] { return relay_->connected(); });
  add("partiemc_relay_replicas", "Other replicas that announce their streams.",
      [this] { return relay_->replicas(); });
  add("partiemc_relay_streams", "Streams that they announce.",
      [this] { return relay_->remote_streams(); });
  add("partiemc_relay_exported_streams", "Streams of this replica that others watch.",
      [this] { return relay_->exported_streams(); });
  add("partiemc_relay_imported_streams", "Streams of other replicas that are watched here.",
      [this] { return relay_->imported_streams(); });
  metrics_->AddCounter(
      "partiemc_relay_lost_messages_total",
      "Attempts to send a message to other replicas that failed, and messages that "
      "came faster than they were handled; what they had is sent or fetched again.",
      [this] { return static_cast<double>(relay_->lost_messages()); });
}

}  // namespace partiemc::server
