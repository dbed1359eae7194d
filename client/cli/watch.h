// `partiemc watch`: receives the results of another producer's stream while it runs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/frame_outputs.h"
#include "client/cli/server_flags.h"

namespace CLI {
class App;
}

namespace partiemc::client {

struct WatchFlags {
  std::string stream;
  ServerFlags server;
  std::string mode = "latest";
  std::string from;  ///< A sequence number or "oldest"; empty: the newest frame.
  std::optional<double> max_error;
  std::optional<std::uint64_t> max_triangles;
  std::uint32_t credits = 2;
  std::uint64_t frames = 0;  ///< 0: until the stream ends.
  double deadline_seconds = 30;
  double give_up_after_seconds = 30;  ///< 0: a lost connection ends the watch.
  FrameOutputs::Places files;         ///< The members `surface` and `walls` are not set here.
  std::string record;                 ///< A recording to write; empty: none.
  bool wait = false;                  ///< Wait for the stream to start.
  bool quiet = false;
};

CLI::App* AddWatch(CLI::App& app, WatchFlags& flags);

/// Returns the exit code.
int Watch(const WatchFlags& flags);

}  // namespace partiemc::client
