// A server's configuration file.
#include <variant>

#include "fuzz/memory_file.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "server/options.h"

namespace partiemc::fuzz {

void AttackConfig(Bytes bytes) {
  const MemoryFile file(
      std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  const char* const arguments[] = {"partiemc-server", "--config", file.path().c_str()};
  const auto parsed = server::ParseCommandLine(3, arguments);
  if (const auto* line = std::get_if<server::CommandLine>(&parsed)) {
    const server::ServerLimits& limits = line->server.limits;
    Require(limits.max_streams > 0 && limits.frames_in_flight > 0 && limits.max_frame_bytes > 0,
            "limits that are taken are legal");
    RequireOk(Validate(limits.frame), "limits of frames that are taken are legal");
  }
}

}  // namespace partiemc::fuzz
