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
  kContact,  ///< On a wall, where a free stretch of the ring ends.
  kFixed,    ///< At its anchor, off the walls.
};

/// How the vertices of RingVertices, or the points of Rings, relate to walls. Arrays by vertex or
/// point; unused without walls.
struct WallVertices {
  std::vector<VertexKind> kind;
  std::vector<WallPlace> place;  ///< On the wall, or near it for kFixed; not set for kFree.
  /// Whether the ring runs along a wall from this vertex to the next.
  std::vector<std::uint8_t> is_wet;
  /// Tile of the vertex's cell if a wall is near the vertex, else kNoTile.
  std::vector<std::uint32_t> tile;
  std::vector<float> angle;  ///< The fluid's angle at a contact, in radians, set by FitContacts.

  void Resize(std::size_t count) {
    kind.resize(count);
    place.resize(count);
    is_wet.resize(count);
    tile.resize(count);
    angle.resize(count);
  }
  /// Copies all but `angle`.
  void Copy(const WallVertices& from, std::size_t vertex, std::size_t to) {
    kind[to] = from.kind[vertex];
    place[to] = from.place[vertex];
    is_wet[to] = from.is_wet[vertex];
    tile[to] = from.tile[vertex];
  }
};

/// Whether a vertex or point lies on a wall. `walls`: null without walls.
inline bool IsOnWall(const WallVertices* walls, std::size_t vertex) {
  return walls != nullptr && walls->kind[vertex] != VertexKind::kFree;
}

/// Sets `vertices.walls` for the vertices of a ring. Moves vertices on walls to their places: an
/// edge vertex to where its edge meets the wall, a cell vertex to the sharpest corner of the walls
/// in its cell. Without a corner, and for a contact, the place is the one nearest to the middle of
/// the cell's two edge vertices. The anchors move, too, but stay on their edges and in their cells.
/// Requires: the vertices have their roots. Returns whether a vertex of the ring is on a wall.
bool FindWallVertices(const VertexInput& input, std::size_t ring, RingVertices& vertices);

}  // namespace partiemc
