#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "partiemc/result.h"
#include "partiemc/surface.h"

namespace partiemc {
namespace {

Rings TriangleRing() {
  Rings rings;
  rings.points = {0, 0, 1, 0, 0, 1};
  rings.offsets = {0, 3};
  rings.outer_of = {kNoRing};
  return rings;
}

Mesh OneTriangle() {
  Mesh mesh;
  mesh.points = {0, 0, 1, 0, 0, 1};
  mesh.triangles = {0, 1, 2};
  mesh.classes = {TriangleClass::kBoundary};
  return mesh;
}

// The definition of the protocol, word by word: what any client would write.
std::uint64_t Fold(const std::vector<std::uint64_t>& words) {
  std::uint64_t hash = 14695981039346656037u;
  for (const std::uint64_t word : words) {
    hash ^= word;
    hash *= 1099511628211u;
    hash ^= hash >> 32;
  }
  return hash;
}

TEST(Digest, IsTheOneOfTheProtocol) {
  constexpr std::uint64_t kOne = 0x3ff0000000000000u;  // 1.0
  EXPECT_EQ(DigestRings(TriangleRing()),
            Fold({6, 0, 0, kOne, 0, 0, kOne, 2, 0, 3, 1, 0xffffffffu}));
  EXPECT_EQ(DigestMesh(OneTriangle()), Fold({6, 0, 0, kOne, 0, 0, kOne, 3, 0, 1, 2, 1, 0}));
  EXPECT_EQ(DigestRings(Rings{}), Fold({0, 1, 0, 0}));
  EXPECT_EQ(DigestMesh(Mesh{}), Fold({0, 0, 0}));
  Surface surface;
  surface.points = {0, 0, 1};
  surface.triangles = {2};
  surface.triangle_offsets = {0, 4};
  surface.outer_of = {kNoShell};
  EXPECT_EQ(DigestSurface(surface), Fold({3, 0, 0, kOne, 1, 2, 2, 0, 4, 1, 0xffffffffu}));
  EXPECT_EQ(DigestSurface(Surface{}), Fold({0, 0, 1, 0, 0}));
}

// The worked example of proto/PROTOCOL.md, with which writers of clients test their arithmetic.
TEST(Digest, OfTheExampleOfTheProtocolIsTheOneThatStandsThere) {
  Rings rings;
  rings.points = {0, 0, 4, 0, 4, 3, 0, 3, 1, 1, 1, 2, 2.5, 1};
  rings.offsets = {0, 4, 7};
  rings.outer_of = {kNoRing, 0};
  Mesh mesh;
  mesh.points = rings.points;
  mesh.triangles = {0, 1, 6, 0, 6, 4, 0, 4, 5, 0, 5, 3, 3, 5, 2, 5, 6, 2, 6, 1, 2};
  mesh.classes.assign(7, TriangleClass::kBoundary);
  mesh.classes.back() = TriangleClass::kInterior;
  Surface surface;
  surface.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2.5};
  surface.triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  surface.triangle_offsets = {0, 4};
  surface.outer_of = {kNoShell};
  std::ifstream file(PARTIEMC_SOURCE_DIR "/proto/PROTOCOL.md");
  const std::string protocol{std::istreambuf_iterator<char>(file), {}};
  ASSERT_FALSE(protocol.empty());
  const auto expect_told = [&](const char* line, std::uint64_t digest) {
    char text[64];
    std::snprintf(text, sizeof(text), line, static_cast<unsigned long long>(digest));
    EXPECT_NE(protocol.find(text), std::string::npos) << text;
  };
  expect_told("rings_digest    0x%016llx\n", DigestRings(rings));
  expect_told("mesh_digest     0x%016llx\n", DigestMesh(mesh));
  expect_told("surface_digest            0x%016llx\n", DigestSurface(surface));
  expect_told("without a body, is 0x%016llx.", DigestSurface(Surface{}));
  expect_told("`rings_digest` is 0x%016llx;", DigestRings(Rings{}));
  expect_told("`mesh_digest` of an empty mesh is 0x%016llx.", DigestMesh(Mesh{}));
}

TEST(Digest, TellsEveryChangeOfGeometryApart) {
  std::set<std::uint64_t> digests = {DigestRings(TriangleRing())};
  const auto expect_new = [&](const Rings& rings) {
    EXPECT_TRUE(digests.insert(DigestRings(rings)).second);
  };
  for (std::size_t k = 0; k < 6; ++k) {
    Rings rings = TriangleRing();
    rings.points[k] += 0x1p-50;
    expect_new(rings);
  }
  Rings negative_zero = TriangleRing();
  negative_zero.points[0] = -0.0;
  expect_new(negative_zero);
  Rings hole = TriangleRing();
  hole.outer_of[0] = 0;
  expect_new(hole);
  Rings split = TriangleRing();
  split.offsets = {0, 2, 3};
  expect_new(split);
  Rings turned = TriangleRing();
  turned.points = {1, 0, 0, 1, 0, 0};
  expect_new(turned);
}

TEST(Digest, OfAMeshTellsTrianglesAndClassesApart) {
  Mesh turned = OneTriangle();
  turned.triangles = {1, 2, 0};
  Mesh interior = OneTriangle();
  interior.classes[0] = TriangleClass::kInterior;
  EXPECT_NE(DigestMesh(turned), DigestMesh(OneTriangle()));
  EXPECT_NE(DigestMesh(interior), DigestMesh(OneTriangle()));
}

TEST(Digest, LooksAtTheGeometryOnly) {
  Rings measured = TriangleRing();
  measured.measures.resize(1);
  measured.measures[0].identity = 7;
  measured.normals = {1, 0, 1, 0, 1, 0};
  EXPECT_EQ(DigestRings(measured), DigestRings(TriangleRing()));
}

}  // namespace
}  // namespace partiemc
