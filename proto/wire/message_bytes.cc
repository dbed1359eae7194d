#include "wire/message_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <grpcpp/support/proto_buffer_writer.h>

#include <algorithm>
#include <span>
#include <variant>

#include "wire/codec.h"

namespace partiemc::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

// Size of one slice of a message: large enough that the overhead per slice is negligible, small
// enough that malloc reuses the memory.
constexpr int kPieceBytes = 1 << 20;

constexpr std::uint32_t LengthTag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

// Upper bounds of the sizes of parsed fields. Arrays of numbers grow by doubling.
constexpr std::uint64_t kBytesOfMessage = 1024, kBytesOfField = 96, kBytesOfPackedByte = 24,
                        kBytesOfUnknownByte = 64;

// Parsers refuse messages that are nested deeper.
constexpr int kMostNested = 100;

std::uint64_t LengthFieldBytes(int field, std::uint64_t bytes) {
  return CodedOutputStream::VarintSize32(LengthTag(field)) +
         CodedOutputStream::VarintSize64(bytes) + bytes;
}

// Adds the number of fields in `input` to `fields`, up to the first malformed field, where a parser
// stops as well. Returns false for a malformed message or too many fields.
bool CountFields(CodedInputStream& input, const google::protobuf::Descriptor& type, int& fields) {
  while (const std::uint32_t tag = input.ReadTag()) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    // A parser would keep the contents of a group. No version of the protocol has groups.
    fields = wire_type == WireFormatLite::WIRETYPE_START_GROUP ? kMaxFields + 1 : fields + 1;
    if (fields > kMaxFields) return false;
    const auto* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    if (wire_type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED && field != nullptr &&
        field->message_type() != nullptr) {
      int length = 0;
      if (!input.ReadVarintSizeAsInt(&length)) return false;
      // The recursion ends, because no request type contains itself.
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

// Adds the memory of the parsed fields in `input` to `bytes`. Returns false if malformed.
bool AddParsedBytes(CodedInputStream& input, const google::protobuf::Descriptor& type, int nested,
                    std::uint64_t& bytes) {
  while (const std::uint32_t tag = input.ReadTag()) {
    bytes += kBytesOfField;
    const auto* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      const int before = input.CurrentPosition();
      if (!WireFormatLite::SkipField(&input, tag)) return false;
      // A group is kept as unknown fields.
      if (WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_START_GROUP) {
        bytes += kBytesOfUnknownByte * static_cast<std::uint64_t>(input.CurrentPosition() - before);
      }
      continue;
    }
    int length = 0;
    if (!input.ReadVarintSizeAsInt(&length)) return false;
    if (field != nullptr && field->message_type() != nullptr) {
      bytes += kBytesOfMessage;
      if (nested == kMostNested) return false;
      const auto limit = input.PushLimit(length);
      if (!AddParsedBytes(input, *field->message_type(), nested + 1, bytes)) return false;
      if (input.BytesUntilLimit() != 0) return false;
      input.PopLimit(limit);
    } else {
      if (field != nullptr && field->is_packable()) {
        bytes += kBytesOfPackedByte * static_cast<std::uint64_t>(length);
      }
      if (!input.Skip(length)) return false;
    }
  }
  return true;
}

// Reads the last `sequence` of a ParticleFrame. Returns false if malformed or with too many fields.
bool ReadSequence(CodedInputStream& input, google::protobuf::uint64& sequence, int& fields) {
  constexpr std::uint32_t kSequence = WireFormatLite::MakeTag(
      v1::ParticleFrame::kSequenceFieldNumber, WireFormatLite::WIRETYPE_VARINT);
  while (const std::uint32_t tag = input.ReadTag()) {
    if (++fields > kMaxFields) return false;
    if (tag == kSequence ? !input.ReadVarint64(&sequence)
                         : !WireFormatLite::SkipField(&input, tag)) {
      return false;
    }
  }
  return input.BytesUntilLimit() == 0;
}

// ReadSequence for a ReconstructRequest.
bool FindSequence(grpc::ByteBuffer& bytes, google::protobuf::uint64& sequence) {
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return false;
  CodedInputStream input(&reader);
  int fields = 0;
  while (const std::uint32_t tag = input.ReadTag()) {
    if (++fields > kMaxFields) return false;
    if (tag == LengthTag(v1::ReconstructRequest::kFrameFieldNumber)) {
      int length = 0;
      if (!input.ReadVarintSizeAsInt(&length)) return false;
      const auto limit = input.PushLimit(length);
      if (!ReadSequence(input, sequence, fields)) return false;
      input.PopLimit(limit);
    } else if (!WireFormatLite::SkipField(&input, tag)) {
      return false;
    } else if (tag == LengthTag(v1::ReconstructRequest::kOpenFieldNumber)) {
      sequence = 0;  // `open` replaces an earlier frame.
    }
  }
  return input.ConsumedEntireMessage();
}

// The scalar fields of `frame`.
Frame ScalarsOf(const Frame& frame) {
  Frame scalars{.positions = frame.positions,
                .components = frame.components,
                .time = frame.time,
                .box = frame.box};
  std::visit([](auto& view) { view = {}; }, scalars.positions);  // Of the same type.
  return scalars;
}

template <typename T>
RowArray RowsOf(std::span<const T> numbers) {
  const auto bytes = std::as_bytes(numbers);
  return {.rows = bytes.size(), .row_bytes = 1, .in_place = bytes.data()};
}

// Gathers rows directly into the slices of `out`. A row that crosses the end of a slice goes
// through `shared`.
void WriteRows(const RowArray& array, CodedOutputStream& out) {
  if (array.in_place != nullptr) {
    out.WriteRaw(array.in_place, static_cast<int>(array.bytes()));
    return;
  }
  for (std::size_t row = 0; row < array.rows;) {
    void* piece = nullptr;
    int room = 0;
    out.GetDirectBufferPointer(&piece, &room);
    const std::size_t fitting =
        std::min(static_cast<std::size_t>(room) / array.row_bytes, array.rows - row);
    if (fitting > 0) {
      array.write(row, row + fitting, static_cast<std::byte*>(piece));
      out.Skip(static_cast<int>(fitting * array.row_bytes));
      row += fitting;
    } else {
      std::byte shared[24];
      array.write(row, row + 1, shared);
      out.WriteRaw(shared, static_cast<int>(array.row_bytes));
      ++row;
    }
  }
}

// The size of a serialised NamedScalar.
std::uint64_t BytesOf(const AttributeRows& attribute) {
  std::uint64_t bytes = 0;
  if (!attribute.name.empty()) {
    bytes += LengthFieldBytes(v1::NamedScalar::kNameFieldNumber, attribute.name.size());
  }
  if (attribute.values.rows > 0) {
    bytes += LengthFieldBytes(v1::NamedScalar::kValuesFieldNumber, attribute.values.bytes());
  }
  return attribute.components == 1 ? bytes : bytes + 2;  // A tag, and 2 or 3.
}

void WriteAttribute(const AttributeRows& attribute, CodedOutputStream& out) {
  out.WriteTag(LengthTag(v1::ParticleFrame::kScalarsFieldNumber));
  out.WriteVarint64(BytesOf(attribute));
  if (!attribute.name.empty()) {
    out.WriteTag(LengthTag(v1::NamedScalar::kNameFieldNumber));
    out.WriteVarint64(attribute.name.size());
    out.WriteRaw(attribute.name.data(), static_cast<int>(attribute.name.size()));
  }
  if (attribute.values.rows > 0) {
    out.WriteTag(LengthTag(v1::NamedScalar::kValuesFieldNumber));
    out.WriteVarint64(attribute.values.bytes());
    WriteRows(attribute.values, out);
  }
  if (attribute.components != 1) {
    out.WriteTag(WireFormatLite::MakeTag(v1::NamedScalar::kComponentsFieldNumber,
                                         WireFormatLite::WIRETYPE_VARINT));
    out.WriteVarint32(static_cast<std::uint32_t>(attribute.components));
  }
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

std::uint64_t ParsedBytes(std::string_view bytes, const google::protobuf::Descriptor& type) {
  CodedInputStream input(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                         static_cast<int>(bytes.size()));
  std::uint64_t parsed = kBytesOfMessage;
  AddParsedBytes(input, type, 0, parsed);
  return parsed;
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

std::optional<std::uint64_t> SequenceOf(grpc::ByteBuffer& bytes) {
  google::protobuf::uint64 sequence = 0;
  if (!FindSequence(bytes, sequence)) return std::nullopt;
  return sequence;
}

std::uint64_t ReadableSequence(grpc::ByteBuffer& bytes) {
  google::protobuf::uint64 sequence = 0;
  FindSequence(bytes, sequence);
  return sequence;
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

FrameRows RowsOf(const Frame& frame) {
  std::vector<AttributeRows> attributes;
  for (const Attribute& one : frame.attributes) {
    attributes.push_back({one.name, one.components, RowsOf(one.values)});
  }
  return {.scalars = ScalarsOf(frame),
          .positions = std::visit([](auto view) { return RowsOf(view); }, frame.positions),
          .ids = RowsOf(frame.ids),
          .volumes = RowsOf(frame.volumes),
          .velocities = RowsOf(frame.velocities),
          .attributes = std::move(attributes)};
}

FrameRequest::FrameRequest(const FrameRows& frame, std::uint64_t sequence)
    : arrays_{{{v1::ParticleFrame::kPositionsFieldNumber, frame.positions},
               {v1::ParticleFrame::kIdsFieldNumber, frame.ids},
               {v1::ParticleFrame::kVolumesFieldNumber, frame.volumes},
               {v1::ParticleFrame::kVelocitiesFieldNumber, frame.velocities}}},
      attributes_(frame.attributes) {
  EncodeFrame(frame.scalars, scalars_);
  scalars_.set_sequence(sequence);
  frame_bytes_ = scalars_.ByteSizeLong();
  for (const Array& array : arrays_) {
    if (array.rows.rows > 0) frame_bytes_ += LengthFieldBytes(array.field, array.rows.bytes());
  }
  for (const AttributeRows& attribute : attributes_) {
    frame_bytes_ += LengthFieldBytes(v1::ParticleFrame::kScalarsFieldNumber, BytesOf(attribute));
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
      if (array.rows.rows == 0) continue;
      out.WriteTag(LengthTag(array.field));
      out.WriteVarint64(array.rows.bytes());
      WriteRows(array.rows, out);
    }
    for (const AttributeRows& attribute : attributes_) WriteAttribute(attribute, out);
  }  // The end of `out` returns the unused rest of the last piece.
  return bytes;
}

}  // namespace partiemc::wire
