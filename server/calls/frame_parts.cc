#include "server/calls/frame_parts.h"

#include <algorithm>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"
#include "server/calls/joined_frame.h"
#include "server/stream/session.h"
#include "wire/codec.h"
#include "wire/message_bytes.h"

namespace partiemc::server {
namespace {

constexpr std::uint32_t kDefaultTimeoutMs = 10'000, kMaxTimeoutMs = 600'000;
constexpr std::size_t kMaxPartsTokenBytes = 128;

class PartMessage final : public PartBytes {
 public:
  // Shares the bytes.
  explicit PartMessage(const grpc::ByteBuffer& request) : bytes(request) {}
  const grpc::ByteBuffer bytes;
};

absl::Status OutOfRange(std::string field, std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOutOfRange), std::move(field), std::move(value), std::move(rule)});
}

absl::Status MalformedFrame(const std::string& field, std::size_t bytes) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonMalformed), field, absl::StrCat(bytes, " bytes"),
       absl::StrCat("must be a ParticleFrame of at most ", wire::kMaxFields, " fields")});
}

std::chrono::milliseconds TimeoutOf(const v1::OpenStream& open) {
  const std::uint32_t asked = open.part_timeout_ms();
  return std::chrono::milliseconds(asked == 0 ? kDefaultTimeoutMs : asked);
}

}  // namespace

absl::Status ParseFrame(grpc::ByteBuffer& bytes, v1::ReconstructRequest& request,
                        const std::string& field) {
  request.mutable_frame()->Clear();
  absl::Status status = MalformedFrame(field, bytes.Length());
  try {
    if (wire::HasFewFields(bytes, *request.GetDescriptor()) && wire::MergeBytes(bytes, request)) {
      request.DiscardUnknownFields();
      return absl::OkStatus();
    }
  } catch (const std::bad_alloc&) {
    status = OutOfMemory(absl::StrCat(bytes.Length(), " bytes"));
  }
  request.mutable_frame()->set_sequence(wire::ReadableSequence(bytes));
  return status;
}

absl::Status CheckParts(const v1::OpenStream& open, const ServerLimits& limits) {
  if (open.parts() > limits.max_parts) {
    return OutOfRange("open.parts", absl::StrCat(open.parts()),
                      absl::StrCat("must be at most ", limits.max_parts,
                                   "; start the server with a larger --max-parts"));
  }
  if (open.part() >= std::max(open.parts(), 1u)) {
    return OutOfRange("open.part", absl::StrCat(open.part()), "must be below open.parts");
  }
  if (open.part_timeout_ms() > kMaxTimeoutMs) {
    return OutOfRange("open.part_timeout_ms", absl::StrCat(open.part_timeout_ms()),
                      absl::StrCat("must be at most ", kMaxTimeoutMs));
  }
  const std::string& token = open.parts_token();
  if (token.size() > kMaxPartsTokenBytes ||
      !std::ranges::all_of(token, [](char c) { return c >= ' ' && c <= '~'; })) {
    return OutOfRange(
        "open.parts_token", absl::StrCat(token.size(), " bytes"),
        absl::StrCat("must be at most ", kMaxPartsTokenBytes, " bytes of printable ASCII"));
  }
  return absl::OkStatus();
}

std::chrono::milliseconds FrameArrival::LookEvery() const {
  using std::chrono::milliseconds;
  if (assembler_ == nullptr) return milliseconds(0);
  // Short compared to the timeout, so that a frame waits hardly longer than its timeout.
  return std::clamp(assembler_->timeout() / 20, milliseconds(5), milliseconds(500));
}

PartZero::PartZero(const v1::OpenStream& open, const ServerLimits& limits,
                   std::uint64_t next_sequence)
    : FrameArrival(std::make_shared<FrameAssembler>(
          FrameAssembler::Terms{.parts = open.parts(),
                                .window = limits.frames_in_flight,
                                .max_frame_bytes = limits.MaxMessageBytes(),
                                .timeout = TimeoutOf(open),
                                .has_checkpoints = open.checkpoint_interval() > 0,
                                .next_sequence = next_sequence})),
      slots_(limits.frames_in_flight) {}

void PartZero::OnFrame(std::size_t slot, grpc::ByteBuffer& request) {
  slots_[slot] = {.sequence = wire::SequenceOf(request), .came = FrameAssembler::Clock::now()};
  if (slots_[slot].sequence) assembler()->LeaderSent(*slots_[slot].sequence);
}

bool PartZero::MayAnswer(std::size_t slot) const {
  const Slot& frame = slots_[slot];
  return !frame.sequence ||
         assembler()->IsReady(*frame.sequence, frame.came, FrameAssembler::Clock::now());
}

std::uint64_t PartZero::ComputedBytes(std::uint64_t bytes) const {
  return bytes + assembler()->BytesOfNext();
}

absl::Status PartZero::Complete(std::size_t slot, const wire::Outputs& outputs,
                                v1::ReconstructRequest& request, grpc::ByteBuffer& bytes) {
  if (slots_[slot].sequence == assembler()->next_wanted()) {
    if (auto status = Join(outputs.attributes, request); !status.ok()) return status;
  }
  if (outputs.echo_particles) bytes = wire::ToBytes(request);
  return absl::OkStatus();
}

absl::Status PartZero::Join(std::span<const std::string> attributes,
                            v1::ReconstructRequest& request) {
  const auto taken = assembler()->Take();
  if (!taken.ok()) return taken.status();
  try {
    std::vector<v1::ParticleFrame> parts(taken->size());
    v1::ReconstructRequest part;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      grpc::ByteBuffer bytes = static_cast<const PartMessage&>(*(*taken)[k]).bytes;
      auto status = ParseFrame(bytes, part, absl::StrCat("parts[", k + 1, "]"));
      if (!status.ok()) return status;
      parts[k].Swap(part.mutable_frame());
    }
    return JoinParts(parts, attributes, *request.mutable_frame());
  } catch (const std::bad_alloc&) {
    return OutOfMemory(absl::StrCat(taken->size() + 1, " parts"));
  }
}

void PartZero::OnAnswered(std::uint64_t next_sequence, bool with_checkpoint) {
  assembler()->Answered(next_sequence, with_checkpoint);
}

OtherPart::OtherPart(JoinedPart joined, std::size_t window)
    : FrameArrival(joined.assembler), joined_(std::move(joined)), slots_(window) {}

void OtherPart::OnFrame(std::size_t slot, grpc::ByteBuffer& request) {
  const auto sequence = wire::SequenceOf(request);
  slots_[slot] = {.sequence = sequence.value_or(0), .refusal = absl::OkStatus()};
  if (!sequence) {
    slots_[slot].refusal = MalformedFrame("frame", request.Length());
    return;
  }
  auto status =
      assembler()->Offer(joined_.seat, *sequence, request.Length(),
                         std::make_shared<PartMessage>(request), FrameAssembler::Clock::now());
  // CANCELLED means that another call has taken over the part. This call then ends with a status,
  // so the frame needs no refusal.
  if (!absl::IsCancelled(status)) slots_[slot].refusal = std::move(status);
}

bool OtherPart::MayAnswer(std::size_t slot) const {
  return !slots_[slot].refusal.ok() ||
         assembler()->IsOver(slots_[slot].sequence, FrameAssembler::Clock::now());
}

// Drops the part, because it may wait for the other parts for a long time. A whole frame is kept
// instead: it waits only for its turn to be computed.
bool OtherPart::DropFrame(std::size_t slot, const absl::Status& why) {
  Slot& part = slots_[slot];
  if (!part.refusal.ok()) return true;
  assembler()->Withdraw(joined_.seat, part.sequence);
  part.refusal = why;
  return true;
}

std::optional<v1::ReconstructResponse> OtherPart::RespondToPart(std::size_t slot) {
  const Slot part = std::exchange(slots_[slot], {});
  const absl::Status status =
      part.refusal.ok() ? assembler()->OutcomeOf(part.sequence) : part.refusal;
  v1::ReconstructResponse response;
  if (status.ok()) {
    response.mutable_part()->set_sequence(part.sequence);
    response.mutable_part()->set_resume_sequence(assembler()->resume_sequence());
  } else {
    wire::EncodeFrameError(status, part.sequence, assembler()->next_wanted(),
                           *response.mutable_error());
  }
  return response;
}

}  // namespace partiemc::server
