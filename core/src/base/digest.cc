// The 64-bit digests of proto/PROTOCOL.md: FNV-1a over 64-bit words, with a shift that mixes high
// bits down. The digests are not cryptographic.
#include <bit>
#include <cstdint>
#include <span>

#include "partiemc/result.h"

namespace partiemc {
namespace {

class Digest {
 public:
  void Add(std::uint64_t word) {
    hash_ = (hash_ ^ word) * 0x00000100000001b3u;
    hash_ ^= hash_ >> 32;
  }
  // An array contributes its size, then each element as one word.
  void Add(std::span<const double> values) {
    Add(values.size());
    for (const double value : values) Add(std::bit_cast<std::uint64_t>(value));
  }
  void Add(std::span<const std::uint32_t> values) {
    Add(values.size());
    for (const std::uint32_t value : values) Add(std::uint64_t{value});
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace

std::uint64_t DigestRings(const Rings& rings) {
  Digest digest;
  digest.Add(rings.points);
  digest.Add(rings.offsets);
  digest.Add(rings.outer_of);
  return digest.value();
}

std::uint64_t DigestMesh(const Mesh& mesh) {
  Digest digest;
  digest.Add(mesh.points);
  digest.Add(mesh.triangles);
  digest.Add(mesh.classes.size());
  for (const TriangleClass triangle_class : mesh.classes) {
    digest.Add(static_cast<std::uint64_t>(triangle_class));
  }
  return digest.value();
}

std::uint64_t DigestSurface(const Surface& surface) {
  Digest digest;
  digest.Add(surface.points);
  digest.Add(surface.triangles);
  digest.Add(surface.triangle_offsets);
  digest.Add(surface.outer_of);
  return digest.value();
}

std::vector<OutlineDigests> DigestSections(const Result& result) {
  std::vector<OutlineDigests> digests;
  for (const Result& section : result.sections) {
    digests.push_back({DigestRings(section.rings), DigestMesh(section.mesh)});
  }
  return digests;
}

}  // namespace partiemc
