// Messages as gRPC carries them: for calls that take bytes in place of messages, so that large
// arrays are copied once and buffers are kept from message to message.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "partiemc/frame.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/frame_rows.h"

namespace partiemc::wire {

/// Of a request, with those of its messages and with unknown ones. No request that means something
/// has nearly as many; each costs up to thirty times its bytes once it is parsed.
inline constexpr int kMaxFields = 4096;

/// Whether parsing `bytes` as a message of `type` takes about as much memory as they do: at most
/// kMaxFields fields, as far as it is such a message, and no groups. Passes over the contents of
/// strings.
bool HasFewFields(grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type);

/// Of a message that is nothing but a oneof of the fields 1 to `last`: the number of the one that
/// it holds, 0 where it holds none, nothing where `bytes` is no message or has more than kMaxFields
/// fields. What is in the fields is not looked at.
std::optional<int> HeldField(grpc::ByteBuffer& bytes, int last);

/// The `sequence` of the ParticleFrame in `bytes`, a ReconstructRequest that holds one; nothing
/// where they are none, or have more than kMaxFields fields. Passes over the frame's arrays.
std::optional<std::uint64_t> SequenceOf(grpc::ByteBuffer& bytes);

/// The `sequence` of the ParticleFrame in `bytes` as SequenceOf, also of a message that is damaged
/// or has more than kMaxFields fields: then the last one before the damage and among these fields.
/// 0 if there is none.
std::uint64_t ReadableSequence(grpc::ByteBuffer& bytes);

/// Adds what `bytes` holds to `message`; strings that are there and empty keep their memory. False
/// where `bytes` is no such message; `message` may then hold a part of it.
bool MergeBytes(grpc::ByteBuffer& bytes, google::protobuf::MessageLite& message);

/// Requires: a message of less than 2 GiB.
grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message);

/// The arrays of `frame` as they are.
FrameRows RowsOf(const Frame& frame);

/// A ReconstructRequest that holds a frame, as EncodeFrame and ToBytes would make it, but without a
/// message between the caller's arrays and the bytes.
class FrameRequest {
 public:
  /// A view of `frame`. Requires: frame.components is 2 or 3.
  FrameRequest(const Frame& frame, std::uint64_t sequence)
      : FrameRequest(RowsOf(frame), sequence) {}
  /// Likewise, of arrays that lie anywhere.
  FrameRequest(const FrameRows& frame, std::uint64_t sequence);

  /// Of its ParticleFrame alone: what Limits.max_frame_bytes counts.
  std::uint64_t frame_bytes() const { return frame_bytes_; }

  /// Copies each array once, from where it is to the memory that is sent.
  /// Requires: frame_bytes() < 2^31 - 16.
  grpc::ByteBuffer ToBytes() const;

 private:
  struct Array {
    int field;
    RowArray rows;
  };

  v1::ParticleFrame scalars_;  // All but the arrays.
  std::array<Array, 4> arrays_;
  std::vector<AttributeRows> attributes_;
  std::uint64_t frame_bytes_ = 0;
};

}  // namespace partiemc::wire
