// Serialised messages in gRPC's byte buffers. Calls exchange bytes instead of messages, so that
// large arrays are copied once and buffers are reused.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "partiemc/frame.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/frame_rows.h"

namespace partiemc::wire {

/// Maximum number of fields of a request, including nested and unknown ones. Bounds the memory of
/// parsing, because a parsed field can take thirty times its serialised size. Valid requests have
/// far fewer.
inline constexpr int kMaxFields = 4096;

/// Whether a message of `type` in `bytes` has at most kMaxFields fields and no groups, up to the
/// first malformed field. Parsing it then takes little more memory than its bytes. Skips the
/// contents of strings.
bool HasFewFields(grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type);

/// Upper bound of the memory of a message of `type` parsed from `bytes`, without the contents of
/// its strings. Reads up to the first malformed field, as a parser does.
std::uint64_t ParsedBytes(std::string_view bytes, const google::protobuf::Descriptor& type);

/// The number of the set field of a message that consists of a oneof with the fields 1 to `last`; 0
/// if none is set. If several occur, the last one counts. Empty if `bytes` is malformed or has more
/// than kMaxFields fields. Does not check the contents of the field.
std::optional<int> HeldField(grpc::ByteBuffer& bytes, int last);

/// The `sequence` of the ParticleFrame in `bytes`, a ReconstructRequest; 0 without a frame. Empty
/// if `bytes` is malformed or has more than kMaxFields fields. Skips the arrays.
std::optional<std::uint64_t> SequenceOf(grpc::ByteBuffer& bytes);

/// SequenceOf for damaged messages and messages with more than kMaxFields fields: the last
/// `sequence` before the damage and among the first kMaxFields fields; 0 if there is none.
std::uint64_t ReadableSequence(grpc::ByteBuffer& bytes);

/// Merges `bytes` into `message`. Reuses the buffers of strings that `message` has cleared. Returns
/// false if `bytes` is malformed; `message` then holds some of the fields.
bool MergeBytes(grpc::ByteBuffer& bytes, google::protobuf::MessageLite& message);

/// Serialises a message. Requires: less than 2 GiB.
grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message);

/// A view of the arrays of `frame`.
FrameRows RowsOf(const Frame& frame);

/// Serialises a ReconstructRequest with a frame directly from the caller's arrays. Without a box,
/// the bytes equal those from EncodeFrame and ToBytes. A box comes before the arrays.
class FrameRequest {
 public:
  /// Keeps views of the arrays of `frame`. Requires: frame.components is 2 or 3.
  FrameRequest(const Frame& frame, std::uint64_t sequence)
      : FrameRequest(RowsOf(frame), sequence) {}
  /// Keeps views of arrays with any memory layout.
  FrameRequest(const FrameRows& frame, std::uint64_t sequence);

  /// Size of the ParticleFrame, as counted by Limits.max_frame_bytes.
  std::uint64_t frame_bytes() const { return frame_bytes_; }

  /// Copies each array once, into the memory that gRPC sends.
  /// Requires: frame_bytes() < 2^31 - 16.
  grpc::ByteBuffer ToBytes() const;

 private:
  struct Array {
    int field;
    RowArray rows;
  };

  v1::ParticleFrame scalars_;  // All fields except the arrays.
  std::array<Array, 4> arrays_;
  std::vector<AttributeRows> attributes_;
  std::uint64_t frame_bytes_ = 0;
};

}  // namespace partiemc::wire
