#include "wire/message_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <grpcpp/support/proto_buffer_writer.h>

#include <variant>

#include "wire/codec.h"

namespace partiemc::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

// Of one piece of memory that a message is written into: so large that pieces cost nothing, so
// small that malloc has them at hand again.
constexpr int kPieceBytes = 1 << 20;

constexpr std::uint32_t LengthTag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

std::uint64_t LengthFieldBytes(int field, std::uint64_t bytes) {
  return CodedOutputStream::VarintSize32(LengthTag(field)) +
         CodedOutputStream::VarintSize64(bytes) + bytes;
}

// Adds those of the message in `input`, which ends where `input` does, to `fields`, as far as it is
// a message: a parser comes no further. False where it is none, or has too many.
bool CountFields(CodedInputStream& input, const google::protobuf::Descriptor& type, int& fields) {
  while (const std::uint32_t tag = input.ReadTag()) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    // What a group holds is kept like any unknown field, and no version of the protocol has groups.
    fields = wire_type == WireFormatLite::WIRETYPE_START_GROUP ? kMaxFields + 1 : fields + 1;
    if (fields > kMaxFields) return false;
    const auto* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    if (wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED && field != nullptr &&
        field->message_type() != nullptr) {
      int length = 0;
      if (!input.ReadVarintSizeAsInt(&length)) return false;
      // Types of requests do not contain themselves, so this ends.
      const auto limit = input.PushLimit(length);
      if (!CountFields(input, *field->message_type(), fields)) return false;
      if (input.BytesUntilLimit() != 0) return false;
      input.PopLimit(limit);
    } else if (!WireFormatLite::SkipField(&input, tag)) {
      return false;
    }
  }
  return true;
}

// `frame` without its arrays.
Frame ScalarsOf(const Frame& frame) {
  Frame scalars{.positions = frame.positions, .components = frame.components, .time = frame.time};
  std::visit([](auto& view) { view = {}; }, scalars.positions);  // Of the same type.
  return scalars;
}

}  // namespace

bool HasFewFields(grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type) {
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return false;
  CodedInputStream input(&reader);
  int fields = 0;
  CountFields(input, type, fields);
  return fields <= kMaxFields;
}

std::optional<int> HeldField(grpc::ByteBuffer& bytes, int last) {
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return std::nullopt;
  CodedInputStream input(&reader);
  int held = 0, fields = 0;
  while (const std::uint32_t tag = input.ReadTag()) {
    if (++fields > kMaxFields) return std::nullopt;
    const int field = WireFormatLite::GetTagFieldNumber(tag);
    if (field <= last && tag == LengthTag(field)) held = field;  // The last one counts.
    if (!WireFormatLite::SkipField(&input, tag)) return std::nullopt;
  }
  if (!input.ConsumedEntireMessage()) return std::nullopt;
  return held;
}

bool MergeBytes(grpc::ByteBuffer& bytes, google::protobuf::MessageLite& message) {
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return false;
  CodedInputStream input(&reader);
  return message.MergeFromCodedStream(&input) && input.ConsumedEntireMessage();
}

grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message) {
  grpc::ByteBuffer bytes;
  grpc::ProtoBufferWriter writer(&bytes, kPieceBytes, static_cast<int>(message.ByteSizeLong()));
  message.SerializeToZeroCopyStream(&writer);
  return bytes;
}

FrameRequest::FrameRequest(const Frame& frame, std::uint64_t sequence)
    : arrays_{{{v1::ParticleFrame::kPositionsFieldNumber,
                std::visit([](auto view) { return std::as_bytes(view); }, frame.positions)},
               {v1::ParticleFrame::kIdsFieldNumber, std::as_bytes(frame.ids)},
               {v1::ParticleFrame::kVolumesFieldNumber, std::as_bytes(frame.volumes)},
               {v1::ParticleFrame::kVelocitiesFieldNumber, std::as_bytes(frame.velocities)}}} {
  EncodeFrame(ScalarsOf(frame), scalars_);
  scalars_.set_sequence(sequence);
  frame_bytes_ = scalars_.ByteSizeLong();
  for (const Array& array : arrays_) {
    if (!array.bytes.empty()) frame_bytes_ += LengthFieldBytes(array.field, array.bytes.size());
  }
}

grpc::ByteBuffer FrameRequest::ToBytes() const {
  constexpr int kFrame = v1::ReconstructRequest::kFrameFieldNumber;
  grpc::ByteBuffer bytes;
  {
    grpc::ProtoBufferWriter writer(&bytes, kPieceBytes,
                                   static_cast<int>(LengthFieldBytes(kFrame, frame_bytes_)));
    CodedOutputStream out(&writer);
    out.WriteTag(LengthTag(kFrame));
    out.WriteVarint64(frame_bytes_);
    scalars_.SerializeToCodedStream(&out);
    for (const Array& array : arrays_) {
      if (array.bytes.empty()) continue;
      out.WriteTag(LengthTag(array.field));
      out.WriteVarint64(array.bytes.size());
      out.WriteRaw(array.bytes.data(), static_cast<int>(array.bytes.size()));
    }
  }  // Whose end gives back what is left of the last piece.
  return bytes;
}

}  // namespace partiemc::wire
