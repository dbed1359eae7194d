#include "server/calls/resume.h"

#include <map>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/security/checkpoint_keys.h"
#include "server/stream/limits.h"
#include "server/stream/stream_token.h"

namespace partiemc::server {
namespace {

// Returns a number that identifies `outputs`. For outlines, the number is the same as in versions
// of the server that had no surfaces, so that checkpoints of these versions stay valid.
std::uint32_t NumberOf(const wire::Outputs& outputs, bool is_surface) {
  // Lists every member. If a member is added, this statement does not compile until the author also
  // adds the member to the number.
  const auto& [rings, mesh, surface, normals, coordinates, echo_particles, attributes] = outputs;
  const bool relative = coordinates == wire::Coordinates::kRelativeFloat32;
  const bool compact = coordinates == wire::Coordinates::kCompact;
  std::uint32_t number = 0;
  for (const bool part : {rings, mesh, normals, relative, echo_particles}) {
    number = number << 1 | std::uint32_t{part};
  }
  number |= (std::uint32_t{is_surface && surface} << 1 | std::uint32_t{compact}) << 30;
  if (attributes.empty()) return number;
  std::map<std::string, std::string> names;
  for (const std::string& name : attributes) names.emplace(absl::StrCat(names.size()), name);
  return number ^ static_cast<std::uint32_t>(FingerprintOf(names)) << 5;
}

}  // namespace

StreamTerms TermsOf(const v1::OpenStream& open, const wire::Outputs& outputs,
                    std::string_view token) {
  return {.lineage = LineageOf(token),
          .name = open.stream_name(),
          .labels = FingerprintOf({open.labels().begin(), open.labels().end()}),
          .outputs = NumberOf(outputs, open.parameters().output() == v1::OUTPUT_SURFACE),
          .checkpoint_interval = open.checkpoint_interval()};
}

absl::Status Resume(const v1::ResumeStream& resume, const ServerContext& context, Session& session,
                    StreamTerms& terms) {
  if (auto status = CheckStreamToken(resume.stream_token()); !status.ok()) return status;
  const std::uint64_t bytes = resume.checkpoint().size();
  const std::uint64_t max_bytes = context.limits.MaxCheckpointBytes();
  if (bytes > max_bytes) {
    return ViolationError(
        absl::StatusCode::kResourceExhausted,
        {std::string(kReasonCheckpointBytes), "open.resume.checkpoint",
         absl::StrCat(bytes, " bytes"), absl::StrCat("must be at most ", max_bytes, " bytes")});
  }
  auto checkpoint = ParseCheckpoint(resume.checkpoint(), session.parameters(), terms,
                                    context.checkpoint_keys.Get().get());
  if (!checkpoint.ok()) return checkpoint.status();
  terms.name = checkpoint->name;
  return session.GoOnFrom(*std::move(checkpoint));
}

std::string CheckpointAfter(std::uint64_t sequence, const Session& session,
                            const StreamTerms& terms, const ServerContext& context) {
  const bool used_number = session.next_sequence() > sequence;
  if (terms.checkpoint_interval == 0 || !used_number || sequence % terms.checkpoint_interval != 0) {
    return {};
  }
  return session.MakeCheckpoint(terms, context.checkpoint_keys.Get().get(),
                                context.limits.MaxCheckpointBytes());
}

}  // namespace partiemc::server
