#include "server/stream/memory_plan.h"

#include <algorithm>

#include "absl/strings/str_format.h"
#include "server/compute/worker_memory.h"

namespace partiemc::server {
namespace {

// More than was measured. The process starts with 19 to 23 MiB of resident memory. A flood from one
// connection adds at most 57 MiB (server/OPERATIONS.md).
constexpr std::uint64_t kProgramBytes = std::uint64_t{24} << 20;
constexpr std::uint64_t kOnTheirWayBytes = std::uint64_t{64} << 20;

}  // namespace

std::uint64_t KeptBytesBeyondHistories(const ServerLimits& limits) {
  if (limits.max_streams == 0) return 0;
  const std::uint64_t kept = limits.max_streams * limits.KeptResultBytes();
  return kept - std::min(kept, limits.AllHistoryBytes());
}

MemoryPlan::MemoryPlan(const ServerLimits& limits, unsigned threads)
    : parts{{kProgramBytes, "the program"},
            {threads * kWorkerBytes, absl::StrFormat("%d compute threads (--threads)", threads)},
            {limits.AllHistoryBytes(),
             "results for watchers that go back (--history-bytes, --max-streams)"},
            {KeptBytesBeyondHistories(limits),
             "newest results of streams beyond their histories (--history-bytes, --max-streams)"},
            {limits.FrameBudget(), "requests and answers (the rest of --memory-budget)"},
            {limits.ReadBytesBeyond(),
             absl::StrFormat("frames of %d streams beyond the budget (--streams-beyond-budget, "
                             "--max-frame-bytes, --max-parts)",
                             limits.streams_beyond_budget)},
            {limits.WorkerBytesBeyond(),
             "computing one frame beyond the budget (--max-particles, --max-frame-bytes)"},
            {limits.StateBytes(), "states of streams between their frames (--memory-budget)"},
            {limits.FrameBudget() / kPartsOfBudgetBeyond, "results that watchers have not taken"},
            {kOnTheirWayBytes, "messages in transfer"},
            {(std::uint64_t{limits.max_streams} + limits.max_parts) * kUnreadBytes,
             "messages that the server has not read yet (--max-streams, --max-parts)"}} {}

std::uint64_t MemoryPlan::bytes() const {
  std::uint64_t bytes = 0;
  for (const Part& part : parts) bytes += part.bytes;
  return bytes;
}

std::string MemoryPlan::ToString() const {
  std::string text;
  const auto line = [&](std::uint64_t part, const std::string& what) {
    absl::StrAppendFormat(&text, "%8.0f MiB  %s\n", static_cast<double>(part) / (1 << 20), what);
  };
  for (const Part& part : parts) line(part.bytes, part.what);
  line(bytes(), "in total; give a container more than this");
  return text;
}

}  // namespace partiemc::server
