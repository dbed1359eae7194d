// GLB files: meshes and outlines for 3D viewers.
#include <limits>

#include "client/output/fixtures.h"
#include "client/output/read_files.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {
namespace {

using nlohmann::json;

TEST(Glb, HasTrianglesLinesAndAttributes) {
  Result result = WithAttributes();
  result.attributes[1].name = "a\"b\n";
  const json file = JsonOf(Encode(FrameFormat::kGlb, {.index = 3, .time = 0.5, .result = result}));
  EXPECT_EQ(file.at("extras"), (json{{"frame", 3}, {"time", 0.5}}));
  const json primitives = file.at("meshes")[0].at("primitives");
  ASSERT_EQ(primitives.size(), 2u);
  EXPECT_EQ(primitives[0].at("mode"), 4);
  EXPECT_EQ(primitives[1].at("mode"), 1);
  const json& accessors = file.at("accessors");
  EXPECT_EQ(accessors[primitives[0].at("indices").get<std::size_t>()].at("count"), 27);
  EXPECT_EQ(accessors[primitives[1].at("indices").get<std::size_t>()].at("count"), 22);
  const json attributes = primitives[0].at("attributes");
  EXPECT_EQ(accessors[attributes.at("_height").get<std::size_t>()].at("type"), "SCALAR");
  EXPECT_EQ(accessors[attributes.at("_a\"b\n").get<std::size_t>()].at("type"), "VEC2");
  EXPECT_EQ(accessors[attributes.at("POSITION").get<std::size_t>()].at("count"), 11);
}

TEST(Glb, KeepsItsPrecisionFarFromTheOrigin) {
  constexpr double kFar = 1e6;
  Result result;
  AddRing(result.rings, {kFar, kFar, kFar + 0.25, kFar, kFar, kFar + 0.25}, kNoRing);
  const json file = JsonOf(Encode(FrameFormat::kGlb, {.result = result}));
  EXPECT_EQ(file.at("nodes")[0].at("translation"), (json{kFar + 0.125, kFar + 0.125, 0}));
  EXPECT_EQ(file.at("accessors")[0].at("max"), (json{0.125, 0.125, 0}));
}

TEST(Glb, AnEmptyFrameIsAnEmptyScene) {
  const Result result;
  for (const bool compress : {false, true}) {
    const std::string glb =
        Encode(FrameFormat::kGlb, {.result = result}, {.compress_glb = compress});
    const json file = JsonOf(glb);
    EXPECT_FALSE(file.contains("meshes"));
    EXPECT_FALSE(file.contains("extensionsRequired"));
    EXPECT_EQ(file.at("scenes").size(), 1u);
  }
}

TEST(Glb, CompressedArraysDecodeToTheSameBits) {
  Result result = WithAttributes();
  result.mesh.points[0] = result.rings.points[0] = 0.1;
  result.attributes[0].values[3] = std::numeric_limits<float>::quiet_NaN();
  const FrameRecord frame{.index = 3, .time = 0.5, .result = result};
  const std::string plain = Encode(FrameFormat::kGlb, frame);
  const std::string packed = Encode(FrameFormat::kGlb, frame, {.compress_glb = true});
  const json file = JsonOf(plain), packed_file = JsonOf(packed);
  for (const char* same : {"accessors", "meshes", "nodes", "extras"}) {
    EXPECT_EQ(packed_file.at(same), file.at(same));
  }
  EXPECT_TRUE(packed_file.at("buffers")[1]["extensions"]["EXT_meshopt_compression"]["fallback"]);
  const std::size_t triangles = file["meshes"][0]["primitives"][0]["indices"];
  ASSERT_EQ(file.at("bufferViews").size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) {
    const std::string expected = ViewOf(plain, file, file.at("bufferViews")[k]);
    const std::string found = ViewOf(packed, packed_file, packed_file.at("bufferViews")[k]);
    if (k == triangles) {
      EXPECT_EQ(Rotated(found), Rotated(expected));
    } else {
      EXPECT_EQ(found, expected) << k;
    }
  }
}

TEST(Glb, CompressionMakesALargeMeshSmaller) {
  Result result;
  constexpr std::uint32_t kSide = 40;
  for (std::uint32_t k = 0; k < kSide * kSide; ++k) {
    result.mesh.points.insert(result.mesh.points.end(), {0.1 * (k % kSide), 0.1 * (k / kSide)});
    if (k % kSide + 1 == kSide || k / kSide + 1 == kSide) continue;
    const std::vector<std::uint32_t> two = {k, k + 1, k + kSide, k + 1, k + kSide + 1, k + kSide};
    result.mesh.triangles.insert(result.mesh.triangles.end(), two.begin(), two.end());
  }
  const std::size_t plain = Encode(FrameFormat::kGlb, {.result = result}).size();
  EXPECT_LT(Encode(FrameFormat::kGlb, {.result = result}, {.compress_glb = true}).size(),
            plain / 4);
}

TEST(Glb, CoordinatesBeyondFloatsAreRefused) {
  Result result = SquareWithHoleAndIsland();
  for (double& coordinate : result.rings.points) coordinate *= 1e40;
  result.mesh = {};
  for (const FrameFormat format : {FrameFormat::kGlb, FrameFormat::kStl}) {
    EXPECT_EQ(EncodeFrame(format, {.result = result}, {}).status().code(),
              absl::StatusCode::kOutOfRange);
  }
}

}  // namespace
}  // namespace partiemc::client
