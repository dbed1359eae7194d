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

/// Most fields of a request, nested and unknown ones included. Valid requests have far fewer. A
/// parsed field can take thirty times its serialised size.
inline constexpr int kMaxFields = 4096;

/// Whether `bytes` has at most kMaxFields fields and no groups, read as a message of `type` up to
/// the first malformed field. Parsing such a message takes about as much memory as its bytes. Skips
/// the contents of strings.
bool HasFewFields(grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type);

/// Estimate of the memory that a message of `type` takes, parsed from `bytes`, beside the contents
/// of its strings. Never too low. Reads up to the first malformed field, as a parser does.
std::uint64_t ParsedBytes(std::string_view bytes, const google::protobuf::Descriptor& type);

/// The number of the set field of a message that consists of a oneof with the fields 1 to `last`; 0
/// if none is set. Empty if `bytes` is malformed or has more than kMaxFields fields. Does not check
/// the contents of the field.
std::optional<int> HeldField(grpc::ByteBuffer& bytes, int last);

/// The `sequence` of the ParticleFrame in `bytes`, a ReconstructRequest. Empty if `bytes` is
/// malformed or has more than kMaxFields fields. Skips the arrays.
std::optional<std::uint64_t> SequenceOf(grpc::ByteBuffer& bytes);

/// SequenceOf for damaged messages and messages with more than kMaxFields fields: the last
/// `sequence` before the damage and among the first kMaxFields fields; 0 if there is none.
std::uint64_t ReadableSequence(grpc::ByteBuffer& bytes);

/// Merges `bytes` into `message`. Empty strings of `message` keep their memory. Returns false if
/// `bytes` is malformed; `message` then holds a part of it.
bool MergeBytes(grpc::ByteBuffer& bytes, google::protobuf::MessageLite& message);

/// Requires: a message of less than 2 GiB.
grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message);

/// A view of the arrays of `frame`.
FrameRows RowsOf(const Frame& frame);

/// A ReconstructRequest with a frame. Without a box the same bytes as of EncodeFrame and ToBytes,
/// but copied directly from the caller's arrays. A box comes before the arrays.
class FrameRequest {
 public:
  /// A view of `frame`. Requires: frame.components is 2 or 3.
  FrameRequest(const Frame& frame, std::uint64_t sequence)
      : FrameRequest(RowsOf(frame), sequence) {}
  /// A view of arrays with any memory layout.
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
