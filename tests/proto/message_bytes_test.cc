// Messages as bytes: bytes written without Protobuf parse as a message, and malformed bytes are
// refused.
#include "wire/message_bytes.h"

#include <grpcpp/support/slice.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/v1/reconstruction.pb.h"
#include "wire/codec.h"

namespace partiemc::wire {
namespace {

constexpr int kLast = v1::ReconstructRequest::kFrameFieldNumber;

// Split into pieces of `piece` bytes, as a connection may deliver them.
grpc::ByteBuffer InPieces(const std::string& text, std::size_t piece) {
  std::vector<grpc::Slice> slices;
  for (std::size_t at = 0; at < text.size(); at += piece)
    slices.emplace_back(text.substr(at, piece));
  return {slices.data(), slices.size()};
}

v1::ReconstructRequest Parsed(grpc::ByteBuffer bytes) {
  v1::ReconstructRequest request;
  EXPECT_TRUE(MergeBytes(bytes, request));
  return request;
}

template <typename T>
std::vector<T> Numbers(std::size_t count) {
  std::vector<T> numbers(count);
  std::iota(numbers.begin(), numbers.end(), T{1});
  return numbers;
}

// A frame with every array in every format equals the message of EncodeFrame.
template <typename T>
void ExpectSameAsMessage(int components, std::size_t particles) {
  const auto positions = Numbers<T>(particles * static_cast<std::size_t>(components));
  const auto volumes = Numbers<float>(particles);
  const auto ids = Numbers<std::uint64_t>(particles);
  const auto velocities = Numbers<float>(positions.size());
  const auto spin = Numbers<float>(3 * particles);
  const std::string long_name(64, 'n');
  const std::vector<Attribute> attributes = {{"p", 1, volumes}, {long_name, 3, spin}, {"", 2, {}}};
  const Frame frame{.positions = std::span<const T>(positions),
                    .components = components,
                    .volumes = volumes,
                    .ids = ids,
                    .velocities = velocities,
                    .attributes = attributes,
                    .time = 0.25,
                    .box = PeriodicBox{.axes = {PeriodicAxis{-1, 7.5}, std::nullopt, {}}}};
  v1::ReconstructRequest expected;
  EncodeFrame(frame, *expected.mutable_frame());
  expected.mutable_frame()->set_sequence(300);
  const FrameRequest request(frame, 300);
  EXPECT_EQ(request.frame_bytes(), expected.frame().ByteSizeLong());
  const grpc::ByteBuffer bytes = request.ToBytes();
  EXPECT_EQ(bytes.Length(), expected.ByteSizeLong());
  EXPECT_EQ(Parsed(bytes).SerializeAsString(), expected.SerializeAsString());
}

TEST(FrameRequest, IsTheMessageThatEncodeFrameMakes) {
  for (const int components : {2, 3}) {
    for (const std::size_t particles : {0, 1, 20, 300'000}) {
      ExpectSameAsMessage<float>(components, particles);
      ExpectSameAsMessage<double>(components, particles);
    }
  }
}

TEST(FrameRequest, LeavesOutWhatAFrameHasNot) {
  const std::vector<float> positions = {1, 2};
  const FrameRequest request({.positions = std::span<const float>(positions)}, 1);
  const v1::ReconstructRequest parsed = Parsed(request.ToBytes());
  EXPECT_EQ(parsed.frame().position_format(), v1::POSITION_FORMAT_FLOAT32_2);
  EXPECT_TRUE(parsed.frame().ids().empty());
}

TEST(HeldField, IsTheOneOfTheOneofThatComesLast) {
  v1::ReconstructRequest open, frame;
  open.mutable_open()->set_stream_name("name");
  frame.mutable_frame()->set_positions(std::string(1000, 'p'));
  const std::string open_text = open.SerializeAsString(), frame_text = frame.SerializeAsString();
  const std::string unknown = "\x18\x05\x22\x02hi";  // Field 3, a number; field 4, two bytes.
  for (const std::size_t piece : {1, 7, 4096}) {
    const auto held = [&](const std::string& text) {
      grpc::ByteBuffer bytes = InPieces(text, piece);
      return HeldField(bytes, kLast);
    };
    EXPECT_EQ(held(open_text), v1::ReconstructRequest::kOpenFieldNumber);
    EXPECT_EQ(held(frame_text), v1::ReconstructRequest::kFrameFieldNumber);
    EXPECT_EQ(held(frame_text + open_text), v1::ReconstructRequest::kOpenFieldNumber);
    EXPECT_EQ(held(open_text + frame_text + unknown), v1::ReconstructRequest::kFrameFieldNumber);
    EXPECT_EQ(held(unknown), 0);
    EXPECT_EQ(held(frame_text.substr(0, frame_text.size() - 1)), std::nullopt);
    EXPECT_EQ(held(frame_text + "\x07"), std::nullopt) << "7 is no type of a field";
  }
  grpc::ByteBuffer empty = ToBytes(v1::ReconstructRequest());
  EXPECT_EQ(HeldField(empty, kLast), 0);
}

TEST(SequenceOf, IsWhatAParserReads) {
  v1::ReconstructRequest open, frame, other;
  open.mutable_open()->set_stream_name("name");
  frame.mutable_frame()->set_positions(std::string(1000, 'p'));
  frame.mutable_frame()->set_sequence(std::uint64_t{1} << 63);
  frame.mutable_frame()->add_scalars()->set_name("heat");
  other.mutable_frame()->set_sequence(7);
  const std::string open_text = open.SerializeAsString(), frame_text = frame.SerializeAsString();
  const std::string unknown = "\x18\x05\x22\x02hi";    // Field 3, a number; field 4, two bytes.
  const std::string no_number = "\x12\x04\x0a\x02hi";  // A frame with bytes as `sequence`.
  for (const std::size_t piece : {1, 7, 4096}) {
    for (const std::string& text :
         {frame_text, open_text + frame_text, frame_text + unknown, std::string("\x12\x00", 2),
          frame_text + other.SerializeAsString(), frame_text + no_number,
          frame_text + open_text + no_number, frame_text.substr(0, 500), frame_text + "\x07",
          frame_text + "\x12\x05\x08\x01"}) {
      grpc::ByteBuffer bytes = InPieces(text, piece);
      v1::ReconstructRequest parsed;
      std::optional<std::uint64_t> expected;
      if (parsed.ParseFromString(text)) expected = parsed.frame().sequence();
      EXPECT_EQ(SequenceOf(bytes), expected) << parsed.ShortDebugString().substr(0, 100);
    }
  }
}

TEST(MergeBytes, WritesIntoTheMemoryThatIsThere) {
  v1::ReconstructRequest request;
  request.mutable_frame()->set_positions(std::string(5000, 'a'));
  const std::string large = request.SerializeAsString();
  request.mutable_frame()->set_positions(std::string(3000, 'b'));
  const std::string small = request.SerializeAsString();

  v1::ReconstructRequest reused;
  grpc::ByteBuffer bytes = InPieces(large, 512);
  ASSERT_TRUE(MergeBytes(bytes, reused));
  const char* const memory = reused.frame().positions().data();
  reused.mutable_frame()->Clear();
  bytes = InPieces(small, 512);
  ASSERT_TRUE(MergeBytes(bytes, reused));
  EXPECT_EQ(reused.frame().positions(), std::string(3000, 'b'));
  EXPECT_EQ(reused.frame().positions().data(), memory);
}

TEST(MergeBytes, TellsWhatIsNoMessage) {
  v1::ReconstructRequest request;
  request.mutable_frame()->set_positions("0123456789");
  const std::string text = request.SerializeAsString();
  for (std::size_t size = 1; size < text.size(); ++size) {
    grpc::ByteBuffer bytes = InPieces(text.substr(0, size), 4);
    v1::ReconstructRequest into;
    EXPECT_FALSE(MergeBytes(bytes, into)) << size << " of " << text.size() << " bytes";
  }
}

// A length-delimited field, for fields below 16 and contents below 128 bytes.
std::string Field(int number, const std::string& contents) {
  return std::string{static_cast<char>(number << 3 | 2), static_cast<char>(contents.size())} +
         contents;
}

std::string Repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

bool RequestHasFewFields(const std::string& text) {
  grpc::ByteBuffer bytes = InPieces(text, 7);
  return HasFewFields(bytes, *v1::ReconstructRequest::descriptor());
}

TEST(MessageBytes, FieldsAreCountedWithThoseOfMessagesAndUnknownOnes) {
  EXPECT_TRUE(RequestHasFewFields(""));
  const std::string unknown = Field(15, "x");
  EXPECT_TRUE(RequestHasFewFields(Repeated(unknown, kMaxFields)));
  EXPECT_FALSE(RequestHasFewFields(Repeated(unknown, kMaxFields + 1)));
  // Inside the frame: unknown fields beside its own.
  v1::ReconstructRequest request;
  for (int i = 0; i < kMaxFields - 1; ++i) request.mutable_frame()->add_scalars();
  EXPECT_TRUE(RequestHasFewFields(request.SerializeAsString()));
  request.mutable_frame()->add_scalars();
  EXPECT_FALSE(RequestHasFewFields(request.SerializeAsString()));
  // The contents of a string are not parsed.
  request.mutable_frame()->clear_scalars();
  request.mutable_frame()->set_positions(Repeated(unknown, 2 * kMaxFields));
  EXPECT_TRUE(RequestHasFewFields(request.SerializeAsString()));
}

TEST(MessageBytes, ParsedBytesAreNeverTooFew) {
  constexpr int kMany = 10'000;
  const auto parses = [](const std::string& bytes) {
    v1::ReconstructedFrame parsed;
    EXPECT_TRUE(parsed.ParseFromString(bytes));
    const std::uint64_t most = ParsedBytes(bytes, *v1::ReconstructedFrame::descriptor());
    std::printf("%zu bytes, parsed %zu, at most %zu\n", bytes.size(), parsed.SpaceUsedLong(),
                static_cast<std::size_t>(most));
    return parsed.SpaceUsedLong() <= most + bytes.size() && parsed.SpaceUsedLong() > bytes.size();
  };
  v1::ReconstructedFrame measures, sections, parents, attributes, rings, array;
  for (int k = 0; k < kMany; ++k) {
    measures.mutable_surface()->add_measures();
    sections.add_sections();
    attributes.mutable_surface()->add_attributes()->set_name("of a length that is allocated");
    rings.mutable_rings()->add_measures();
  }
  auto& identities = *parents.mutable_surface()->add_measures()->mutable_parent_identities();
  for (int k = 0; k < 100 * kMany; ++k) identities.Add(1);
  for (const auto& message : {measures, sections, parents, attributes, rings}) {
    EXPECT_TRUE(parses(message.SerializeAsString()));
  }
  EXPECT_TRUE(parses(Repeated(Field(11, ""), kMany))) << "unknown fields";
  array.mutable_surface()->set_points(std::string(1 << 20, 'x'));
  EXPECT_LT(ParsedBytes(array.SerializeAsString(), *v1::ReconstructedFrame::descriptor()), 1 << 13);
}

TEST(MessageBytes, ParsedBytesOfDeepMessagesNeedNoDeepStack) {
  std::string deep;
  for (int k = 0; k < 400; ++k) {
    std::string length;
    for (std::size_t rest = deep.size(); length.empty() || rest > 0; rest >>= 7) {
      length += static_cast<char>((rest & 0x7f) | (rest > 0x7f ? 0x80 : 0));
    }
    deep = "\xba\x01" + length + deep;  // Field 23, sections.
  }
  v1::ReconstructedFrame message;
  EXPECT_FALSE(message.ParseFromString(deep));
  EXPECT_LT(ParsedBytes(deep, *v1::ReconstructedFrame::descriptor()), 120 * 1100);
}

TEST(MessageBytes, WhatIsNoMessageIsCountedAsFarAsAParserComes) {
  EXPECT_TRUE(RequestHasFewFields("\x07")) << "a wire type that does not exist";
  EXPECT_TRUE(RequestHasFewFields("\x12\x05x")) << "cut off";
  const std::string many = Repeated(Field(15, ""), kMaxFields + 1);
  EXPECT_FALSE(RequestHasFewFields(many + "\x07"));
  EXPECT_FALSE(RequestHasFewFields("\x12\xff\xff\x7f" + many)) << "in a message that is cut off";
  EXPECT_FALSE(RequestHasFewFields(Repeated("\x7b", 200'000))) << "groups in groups";
  EXPECT_FALSE(RequestHasFewFields("\x7b\x7c")) << "a group";
}

TEST(MessageBytes, ReadableSequenceIsFoundBeforeTheDamage) {
  const auto readable = [](const std::string& frame, const std::string& after = "") {
    std::string text = "\x12";  // `frame`, shorter than 2^14 bytes.
    text += static_cast<char>(0x80 | (frame.size() & 127));
    text += static_cast<char>(frame.size() >> 7);
    grpc::ByteBuffer bytes = InPieces(text + frame + after, 50);
    return ReadableSequence(bytes);
  };
  const std::string number("\x08\x05", 2), many = Repeated(Field(15, ""), kMaxFields);
  EXPECT_EQ(readable(number), 5u);
  EXPECT_EQ(readable(number + many), 5u);
  EXPECT_EQ(readable(many + number), 0u);
  EXPECT_EQ(readable(number + "\x07"), 5u);
  EXPECT_EQ(readable("\x07" + number), 0u);
  EXPECT_EQ(readable(number, "\x07"), 5u);
  EXPECT_EQ(readable(""), 0u);
}

TEST(MessageBytes, TheHeldFieldOfTooManyIsNotLookedFor) {
  grpc::ByteBuffer bytes = InPieces(Repeated(Field(15, ""), kMaxFields + 1), 100);
  EXPECT_FALSE(HeldField(bytes, kLast).has_value());
}

}  // namespace
}  // namespace partiemc::wire
