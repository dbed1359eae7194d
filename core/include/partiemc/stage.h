// The nine stages, under the names that they carry everywhere.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace partiemc {

enum class Stage : std::uint8_t {
  kBins,        ///< Particles sorted into tiles of the lattice.
  kField,       ///< Level set at every node of every tile (paper, Eq. 1-5).
  kCrossings,   ///< Active cells and the segments through them (marching squares' topology).
  kRings,       ///< Segments joined to closed rings, nested, cleaned.
  kNormals,     ///< Stabilised cell normals (paper, Eq. 9-11).
  kVertices,    ///< Vertices placed (paper, sections 3.4-3.5).
  kIdentities,  ///< Rings related to those of the frame before (core/IDENTITIES.md).
  kMesh,        ///< Inside filled with triangles (paper, sections 3.7-3.8).
  kAttributes,  ///< What particles carry, interpolated at the vertices; only where there is any.
};

inline constexpr std::size_t kStageCount = 9;
inline constexpr std::array<std::string_view, kStageCount> kStageNames = {
    "bins",     "field",      "crossings", "rings",     "normals",
    "vertices", "identities", "mesh",      "attributes"};

constexpr std::string_view Name(Stage stage) {
  return kStageNames[static_cast<std::size_t>(stage)];
}

/// Told when a stage begins and ends, on the calling thread. The core has no clock of its own.
class StageObserver {
 public:
  virtual ~StageObserver() = default;
  virtual void StageBegins(Stage stage) = 0;
  virtual void StageEnds(Stage stage) = 0;
};

}  // namespace partiemc
