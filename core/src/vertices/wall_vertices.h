// The vertices of rings on walls (core/WALLS.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "walls/wall_field.h"

namespace partiemc {

struct VertexInput;
struct RingVertices;

enum class VertexKind : std::uint8_t {
  kFree,
  kWall,     ///< On a wall.
  kContact,  ///< Where a free stretch of a ring meets a wall.
};

/// What is known of vertices, of RingVertices or of Rings, if there are walls; else unused.
struct WallVertices {
  std::vector<VertexKind> kind;
  std::vector<WallPlace> place;  ///< Of vertices on walls and of contacts.
  /// Whether the ring runs along a wall from this vertex to the next.
  std::vector<std::uint8_t> is_wet;
  /// Tile of the vertex's cell if a wall is near the vertex, else kNoTile.
  std::vector<std::uint32_t> tile;
  std::vector<float> angle;  ///< Of contacts: the angle of the fluid, in radians.

  void Resize(std::size_t count) {
    kind.resize(count);
    place.resize(count);
    is_wet.resize(count);
    tile.resize(count);
    angle.resize(count);
  }
  /// Copies all that is known of a vertex.
  void Copy(const WallVertices& from, std::size_t vertex, std::size_t to) {
    kind[to] = from.kind[vertex];
    place[to] = from.place[vertex];
    is_wet[to] = from.is_wet[vertex];
    tile[to] = from.tile[vertex];
  }
};

/// Finds the kinds and places of the vertices of a ring, and moves vertices and anchors of walls
/// and contacts to their places: the vertex of a lattice edge to where the edge meets the wall,
/// that of a cell to a corner of the walls in it, else to the place of the wall nearest to its
/// middle there. Requires: the vertices have their roots. Returns whether the ring meets a wall.
bool FindWallVertices(const VertexInput& input, std::size_t ring, RingVertices& vertices);

}  // namespace partiemc
