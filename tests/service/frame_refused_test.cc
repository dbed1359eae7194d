// The rows of "A frame is refused" in proto/PROTOCOL.md: one test per row, named by its reason,
// with exact reason and message (golden_messages.txt). The stream continues. error_table_test.cc
// finds rows without a test.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <vector>

#include "partiemc/status.h"
#include "server/moving_blob.h"
#include "server/stream/session.h"
#include "service/error_testing.h"

namespace partiemc::server {
namespace {

class FrameRefused : public ErrorTable {
 protected:
  void SetUp() override {
    options_.limits.frame.max_tiles = 100;
    Serve();
  }

  // Expects this answer to `frame` on a stream opened by `open`, and that the stream continues.
  void Expect(const v1::ReconstructRequest& frame, const std::string& reason,
              std::uint64_t next_sequence = 2, const v1::ReconstructRequest& open = OpenRequest()) {
    StreamClient client(channel_);
    ASSERT_TRUE(client.SendAndReceive(open).has_opened());
    const auto answer = client.SendAndReceive(frame);
    ASSERT_TRUE(answer.has_error()) << answer.ShortDebugString().substr(0, 200);
    const v1::FrameError& error = answer.error();
    EXPECT_EQ(error.reason(), reason);
    messages_.Expect(error.message());
    EXPECT_EQ(error.message(), error.field() + ": " + error.value() + "; " + error.rule());
    EXPECT_TRUE(IsFieldOrSubject(error.field())) << error.field();
    EXPECT_EQ(error.sequence(), frame.frame().sequence());
    EXPECT_EQ(error.next_sequence(), next_sequence);
    auto next = BlobRequest(next_sequence, 1, 0);
    for (const std::string& name : open.open().outputs().attributes()) Carry(name, next);
    EXPECT_TRUE(client.SendAndReceive(next).has_frame());
  }
  static v1::ReconstructRequest OpenFor(const std::string& attribute) {
    auto open = OpenRequest();
    open.mutable_open()->mutable_outputs()->set_rings(true);
    open.mutable_open()->mutable_outputs()->add_attributes(attribute);
    return open;
  }
  // Adds the attribute `name` with zeros to the particles of `request`.
  static v1::NamedScalar& Carry(const std::string& name, v1::ReconstructRequest& request) {
    v1::NamedScalar& scalar = *request.mutable_frame()->add_scalars();
    scalar.set_name(name);
    scalar.set_values(std::string(request.frame().positions().size() / 16 * sizeof(float), '\0'));
    return scalar;
  }
  // A good frame with `value` as number `index` of `positions`.
  static v1::ReconstructRequest WithCoordinate(std::size_t index, double value) {
    auto request = BlobRequest(1, 1, 0);
    std::memcpy(request.mutable_frame()->mutable_positions()->data() + 8 * index, &value, 8);
    return request;
  }
};

TEST_F(FrameRefused, SEQUENCE_GAP) { Expect(BlobRequest(7, 1, 0), "SEQUENCE_GAP", 1); }

TEST_F(FrameRefused, SEQUENCE_DUPLICATE) { Expect(BlobRequest(0, 1, 0), "SEQUENCE_DUPLICATE", 1); }

TEST_F(FrameRefused, FRAME_BYTES) {
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_positions(std::string(16 * 65'000, '\0'));
  Expect(request, "FRAME_BYTES");
}

TEST_F(FrameRefused, MALFORMED) {
  const std::string number_1_and_cut_off_positions("\x12\x05\x08\x01\x22\x05p", 7);
  const StreamEnd end = SendBytes(channel_, {OpenRequest().SerializeAsString(),
                                             number_1_and_cut_off_positions, std::string("\x07")});
  ASSERT_EQ(end.answers.size(), 2u) << end.status.error_message();
  const v1::FrameError& error = end.answers[1].error();
  EXPECT_EQ(error.reason(), "MALFORMED");
  messages_.Expect(error.message());
  EXPECT_EQ(error.next_sequence(), 2u);
}

class FrameOfManyFields : public FrameRefused {};

// Also for the first frame of a stream.
TEST_F(FrameOfManyFields, IsMalformed) {
  auto scalars = BlobRequest(1, 1, 0);
  while (scalars.frame().scalars_size() <= 4096) scalars.mutable_frame()->add_scalars();
  Expect(scalars, "MALFORMED");
  // The number after too many fields is not read and not used up.
  std::string unknown;
  for (int i = 0; i < 4097; ++i) unknown += std::string("\x7a\0", 2);
  const std::string message = std::string("\x12\x84\x40", 3) + unknown + "\x08\x01";
  const StreamEnd end =
      SendBytes(channel_, {OpenRequest().SerializeAsString(), message, std::string("\x07")});
  ASSERT_EQ(end.answers.size(), 2u) << end.status.error_message();
  EXPECT_EQ(end.answers[1].error().reason(), "MALFORMED");
  EXPECT_EQ(end.answers[1].error().next_sequence(), 1u);
  EXPECT_EQ(end.answers[1].error().sequence(), 0u);
}

TEST_F(FrameRefused, UNSUPPORTED) {
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_position_format(v1::POSITION_FORMAT_UNSPECIFIED);
  Expect(request, "UNSUPPORTED");
}

TEST_F(FrameRefused, BYTE_COUNT) {
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_ids("123");
  const auto particles = std::to_string(request.frame().positions().size() / 16);
  Expect(request, "BYTE_COUNT");
}

TEST_F(FrameRefused, NO_SUCH_ATTRIBUTE) {
  auto request = BlobRequest(1, 1, 0);
  Carry("density", request);
  Expect(request, "NO_SUCH_ATTRIBUTE", 2, OpenFor("pressure"));
}

TEST_F(FrameRefused, TOO_MANY_PARTICLES) {
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_positions(std::string(16 * 20'001, '\0'));
  Expect(request, "TOO_MANY_PARTICLES");
}

TEST_F(FrameRefused, TOO_MANY_TILES) {
  auto request = BlobRequest(1, 1, 0);
  std::vector<double> line;
  for (int k = 0; k < 200; ++k) line.insert(line.end(), {100.0 * k, 0.0});
  request.mutable_frame()->set_positions(line.data(), line.size() * sizeof(double));
  Expect(request, "TOO_MANY_TILES");
}

TEST_F(FrameRefused, DUPLICATE) {
  auto request = BlobRequest(1, 1, 0);
  std::vector<std::uint64_t> ids(request.frame().positions().size() / 16);
  for (std::size_t k = 0; k < ids.size(); ++k) ids[k] = k;
  ids[5] = 2;
  request.mutable_frame()->set_ids(ids.data(), ids.size() * sizeof(std::uint64_t));
  Expect(request, "DUPLICATE");
}

TEST_F(FrameRefused, NOT_FINITE) {
  Expect(WithCoordinate(7, std::numeric_limits<double>::quiet_NaN()), "NOT_FINITE");
  auto request = BlobRequest(1, 1, 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(Carry("pressure", request).mutable_values()->data() + 8, &nan, sizeof(nan));
  Expect(request, "NOT_FINITE", 2, OpenFor("pressure"));
}

TEST_F(FrameRefused, OUT_OF_RANGE) {
  Expect(WithCoordinate(7, 1e300), "OUT_OF_RANGE");
  auto request = BlobRequest(1, 1, 0);
  Carry("stress", request).set_components(4);
  Expect(request, "OUT_OF_RANGE");
}

TEST_F(FrameRefused, NOT_PLANAR) {
  auto request = BlobRequest(1, 1, 0);
  const std::vector<double> corner = {0, 0, 0, 1, 0, 0, 0, 1, 0.5};
  request.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT64_3);
  request.mutable_frame()->set_positions(corner.data(), corner.size() * sizeof(double));
  Expect(request, "NOT_PLANAR");
}

TEST_F(FrameRefused, PERCOLATES) {
  auto open = OpenRequest();
  auto& parameters = *open.mutable_open()->mutable_parameters();
  parameters.set_spacing(kBlobSpacing);
  parameters.mutable_box()->mutable_x()->set_length(400 * kBlobSpacing);
  parameters.set_placement(v1::PLACEMENT_FARTHEST_PARTICLE);  // Its rings cannot be cut.
  auto request = BlobRequest(1, 1, 0);
  std::vector<double> layer;
  for (int k = 0; k < 400; ++k) layer.insert(layer.end(), {k * kBlobSpacing, 0.0});
  request.mutable_frame()->set_positions(layer.data(), layer.size() * sizeof(double));
  Expect(request, "PERCOLATES", 2, open);
}

// float32 positions so far from the origin that a step is many spacings.
v1::ReconstructRequest CoarseRequest() {
  std::vector<float> far;
  for (const double coordinate : MovingBlob(1, 0)) {
    far.push_back(static_cast<float>(coordinate + 1e6));
  }
  auto request = BlobRequest(2, 1, 0);
  request.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  request.mutable_frame()->set_positions(far.data(), far.size() * sizeof(float));
  return request;
}

TEST_F(FrameRefused, RESOLUTION) {
  auto open = OpenRequest();
  open.mutable_open()->mutable_outputs()->set_rings(true);
  open.mutable_open()->mutable_outputs()->set_coordinate_format(
      v1::COORDINATE_FORMAT_FLOAT32_RELATIVE);
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(open).has_opened());
  const auto answer = client.SendAndReceive(WithCoordinate(7, 1e5 + 0.013));
  EXPECT_EQ(answer.error().reason(), "RESOLUTION");
  EXPECT_TRUE(answer.error().field().starts_with("rings.points[")) << answer.error().field();
  EXPECT_TRUE(answer.error().value().starts_with("moved by ")) << answer.error().value();
  EXPECT_EQ(answer.error().rule(),
            "must move by at most 1e-04 spacings; ask for COORDINATE_FORMAT_FLOAT64");
  EXPECT_EQ(answer.error().next_sequence(), 2u);
  const auto coarse = client.SendAndReceive(CoarseRequest());
  EXPECT_EQ(coarse.error().reason(), "RESOLUTION");
  EXPECT_EQ(coarse.error().field(), "positions");
  EXPECT_TRUE(coarse.error().value().starts_with("float32 up to 100000"));
  EXPECT_EQ(coarse.error().rule(), "must be finer than a quarter of the spacing, " +
                                       ShortestNumber(kBlobSpacing) +
                                       "; send float64, or coordinates relative to a near origin");
  EXPECT_EQ(coarse.error().next_sequence(), 3u);
}

// Larger than any message: the codec checks all counts before the core.
TEST_F(FrameRefused, COUNT) {
  Session session = *Session::Open({.spacing = 1}, {});
  Worker worker;
  const std::vector<double> positions(6);
  const std::vector<float> volumes(2, 1);
  const Frame frame{.positions = std::span<const double>(positions), .volumes = volumes};
  const auto status =
      session.Answer(1, frame, worker, [](auto&, auto&) { return absl::OkStatus(); });
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(FindViolation(status)->reason, "COUNT");
  messages_.Expect(std::string(status.message()));
}

TEST_F(FrameRefused, MEMORY_BUDGET) {
  StateMemory memory(100, 0);
  Session session = *Session::Open({.spacing = kBlobSpacing}, {}, {memory, nullptr});
  Worker worker;
  const std::vector<double> positions = MovingBlob(1, 0);
  const Frame frame{.positions = std::span<const double>(positions)};
  const auto status =
      session.Answer(1, frame, worker, [](auto&, auto&) { return absl::OkStatus(); });
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(FindViolation(status)->reason, "MEMORY_BUDGET");
  messages_.Expect(std::string(status.message()));
  EXPECT_EQ(session.next_sequence(), 2u);
}

TEST_F(FrameRefused, OUT_OF_MEMORY) {
  Session session = *Session::Open({.spacing = 1}, {});
  Worker worker;
  const std::vector<double> positions(6);
  const Frame frame{.positions = std::span<const double>(positions)};
  const auto status = session.Answer(1, frame, worker,
                                     [](auto&, auto&) -> absl::Status { throw std::bad_alloc(); });
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(FindViolation(status)->reason, "OUT_OF_MEMORY");
  messages_.Expect(std::string(status.message()));
  EXPECT_EQ(session.next_sequence(), 2u);
}

}  // namespace
}  // namespace partiemc::server
