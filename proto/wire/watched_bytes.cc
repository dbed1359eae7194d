#include "wire/watched_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message_lite.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace partiemc::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

constexpr std::uint32_t LengthTag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

constexpr std::uint32_t VarintTag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_VARINT);
}

// The bytes that `write` writes.
template <typename Write>
std::string Written(Write write) {
  std::string text;
  google::protobuf::io::StringOutputStream stream(&text);
  {
    CodedOutputStream out(&stream);
    write(out);
  }
  return text;
}

// A range of bytes of a message.
struct Span {
  std::size_t offset = 0, length = 0;
};

// The content of the last field with the number `field` in the message in `bytes`; nothing if there
// is none or the message is malformed.
std::optional<Span> FindLast(grpc::ByteBuffer& bytes, int field) {
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return std::nullopt;
  CodedInputStream input(&reader);
  std::optional<Span> found;
  while (const std::uint32_t tag = input.ReadTag()) {
    if (tag != LengthTag(field)) {
      if (!WireFormatLite::SkipField(&input, tag)) return std::nullopt;
      continue;
    }
    std::uint32_t length = 0;
    if (!input.ReadVarint32(&length)) return std::nullopt;
    found = {static_cast<std::size_t>(input.CurrentPosition()), length};
    if (!input.Skip(static_cast<int>(length))) return std::nullopt;
  }
  return found;
}

// Shares the memory of `bytes`.
std::vector<grpc::Slice> SlicesOf(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Dump(&slices).ok()) slices.clear();
  return slices;
}

}  // namespace

WatchedBytes::WatchedBytes(grpc::ByteBuffer& response) {
  // If there are several frames, the last one counts, as for a parser.
  const auto frame = FindLast(response, v1::ReconstructResponse::kFrameFieldNumber);
  if (frame) Append(SlicesOf(response), frame->offset, frame->length);
}

void WatchedBytes::EchoParticles(const v1::ParticleFrame& frame) {
  if (frame.positions().empty()) return;  // A frame without particles.
  using To = v1::ReconstructedFrame;
  std::string echo;
  // A field's tag in the result may be one byte longer than its tag in the frame.
  echo.reserve(frame.ByteSizeLong() + static_cast<std::size_t>(frame.scalars_size()) + 16);
  const auto add_head = [&](int field, std::size_t length) {
    echo += Written([&](CodedOutputStream& out) {
      out.WriteTag(LengthTag(field));
      out.WriteVarint64(length);
    });
  };
  const auto add = [&](int field, const std::string& bytes) {
    if (bytes.empty()) return;
    add_head(field, bytes.size());
    echo += bytes;
  };
  const auto add_message = [&](int field, const google::protobuf::MessageLite& message) {
    add_head(field, message.ByteSizeLong());
    message.AppendToString(&echo);
  };
  echo += Written([&](CodedOutputStream& out) {
    out.WriteTag(VarintTag(To::kParticleFormatFieldNumber));
    out.WriteVarint32(static_cast<std::uint32_t>(frame.position_format()));
  });
  add(To::kParticlesFieldNumber, frame.positions());
  add(To::kParticleIdsFieldNumber, frame.ids());
  add(To::kParticleVolumesFieldNumber, frame.volumes());
  add(To::kParticleVelocitiesFieldNumber, frame.velocities());
  for (const auto& scalar : frame.scalars()) add_message(To::kParticleScalarsFieldNumber, scalar);
  if (frame.has_box()) add_message(To::kParticleBoxFieldNumber, frame.box());
  AppendOwn(std::move(echo));
}

grpc::ByteBuffer WatchedBytes::ToResponse(std::uint64_t dropped,
                                          std::uint64_t oldest_sequence) const {
  const std::string frame_head = Written([&](CodedOutputStream& out) {
    const auto write = [&](int field, std::uint64_t value) {
      if (value == 0) return;
      out.WriteTag(VarintTag(field));
      out.WriteVarint64(value);
    };
    write(v1::WatchedFrame::kDroppedFieldNumber, dropped);
    write(v1::WatchedFrame::kOldestSequenceFieldNumber, oldest_sequence);
    out.WriteTag(LengthTag(v1::WatchedFrame::kFrameFieldNumber));
    out.WriteVarint64(size_);
  });
  std::vector<grpc::Slice> slices;
  slices.reserve(slices_.size() + 1);
  slices.emplace_back(Written([&](CodedOutputStream& out) {
    out.WriteTag(LengthTag(v1::WatchStreamResponse::kFrameFieldNumber));
    out.WriteVarint64(frame_head.size() + size_);
    out.WriteString(frame_head);
  }));
  slices.insert(slices.end(), slices_.begin(), slices_.end());
  return {slices.data(), slices.size()};
}

std::string WatchedBytes::ToString() const {
  std::string bytes;
  bytes.reserve(size_);
  for (const grpc::Slice& slice : slices_) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

void WatchedBytes::AppendOwn(std::string bytes) {
  size_ += bytes.size();
  memory_ += bytes.capacity();
  auto* const kept = new std::string(std::move(bytes));
  slices_.emplace_back(
      kept->data(), kept->size(), [](void* own) { delete static_cast<std::string*>(own); }, kept);
}

void WatchedBytes::Append(std::span<const grpc::Slice> whole, std::size_t offset,
                          std::size_t length) {
  size_ += length;
  for (const grpc::Slice& slice : whole) {
    if (length == 0) return;
    if (offset < slice.size()) {
      const std::size_t end = std::min(slice.size(), offset + length);
      slices_.push_back(slice.sub(offset, end));
      if (std::exchange(counted_, slice.begin()) != slice.begin()) memory_ += slice.size();
      length -= end - offset;
      offset = end;
    }
    offset -= std::min(offset, slice.size());
  }
}

}  // namespace partiemc::wire
