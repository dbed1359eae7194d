// The nine stages of a frame and their names, which are the same in code, metrics and messages.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace partiemc {

enum class Stage : std::uint8_t {
  kBins,        ///< Particles sorted into tiles of the lattice.
  kField,       ///< Level set at every node of every tile (paper, Eq. 1-5).
  kCrossings,   ///< Cells on the outline and the segments through them (marching squares).
  kRings,       ///< Segments joined to closed rings; nesting, cleaning.
  kNormals,     ///< Stabilised cell normals (paper, Eq. 9-11).
  kVertices,    ///< Vertices placed (paper, sections 3.4-3.5).
  kIdentities,  ///< Rings related to rings of the last frame (core/IDENTITIES.md).
  kMesh,        ///< Inside filled with triangles (paper, sections 3.7-3.8).
  kAttributes,  ///< Attributes interpolated to the vertices, if the frame has any.
};

inline constexpr std::size_t kStageCount = 9;
inline constexpr std::array<std::string_view, kStageCount> kStageNames = {
    "bins",     "field",      "crossings", "rings",     "normals",
    "vertices", "identities", "mesh",      "attributes"};

constexpr std::string_view Name(Stage stage) {
  return kStageNames[static_cast<std::size_t>(stage)];
}

/// Receives the begin and the end of each stage, on the thread that calls Reconstruct. A stage may
/// run several times in a frame. The core reads no clock, so only an observer can measure times.
class StageObserver {
 public:
  virtual ~StageObserver() = default;
  virtual void StageBegins(Stage stage) = 0;
  virtual void StageEnds(Stage stage) = 0;
};

}  // namespace partiemc
