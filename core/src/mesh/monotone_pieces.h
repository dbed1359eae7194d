// Triangulates monotone polygons whose vertices arrive from bottom to top: the second half of the
// triangulation by a sweep (triangulate.h).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/bits.h"
#include "base/point.h"
#include "base/predicates.h"

namespace partiemc {

/// A set of monotone polygons, called pieces. A left and a right chain bound a piece; both rise in
/// the order of SweepsBefore from a common first vertex to a common last one. The caller adds the
/// vertices of both chains in this order. Each triangle is emitted as early as possible.
/// Cost: linear in the vertices. Allocates nothing once warm. Use one object per thread.
class MonotonePieces {
 public:
  struct Vertex {
    Point point;
    std::uint32_t index = 0;
  };

  /// The part of a piece that is not triangulated yet, as a stack. The bottom of the stack is the
  /// last vertex of one chain; the vertices above are the end of the other chain. This end never
  /// turns towards the inside, so no triangle can be cut off there. Valid only with the object that
  /// started the piece.
  struct Piece {
    std::uint32_t top = kNoIndex;
    bool is_left_chain =
        false;  ///< Whether the stack is on the left chain; one vertex alone is on both.

    bool IsEmpty() const { return top == kNoIndex; }
  };

  /// Drops all pieces. Later calls append triangles to `triangles`: three indices each,
  /// counter-clockwise.
  void Clear(std::vector<std::uint32_t>& triangles) {
    triangles_ = &triangles;
    nodes_.clear();
    unused_ = kNoIndex;
  }

  Piece Start(Vertex first) {
    Piece piece;
    PushNode(piece, first);
    return piece;
  }

  /// The vertex added last. Requires, as all methods below: the piece is not empty.
  Vertex LastVertex(const Piece& piece) const { return nodes_[piece.top].vertex; }

  void AddToLeftChain(Piece& piece, const Vertex& vertex) { Add(piece, vertex, true); }
  void AddToRightChain(Piece& piece, const Vertex& vertex) { Add(piece, vertex, false); }

  /// Adds the common last vertex of both chains. The whole stack is visible from it, so it forms a
  /// triangle with each side of the stack. The piece is empty afterwards.
  void Finish(Piece& piece, const Vertex& last) {
    while (nodes_[piece.top].below != kNoIndex) {
      EmitTopmost(piece, last);
      PopNode(piece);
    }
    PopNode(piece);
  }

 private:
  struct Node {
    Vertex vertex;
    std::uint32_t below = kNoIndex;  // Next node of the stack, or of the list of unused nodes.
  };

  void Add(Piece& piece, const Vertex& vertex, bool to_left_chain) {
    if (piece.is_left_chain != to_left_chain) {
      // The whole stack is visible from a vertex of the other chain. The last vertex stays on the
      // stack, because it is visible from later vertices, too.
      const Vertex last = LastVertex(piece);
      Finish(piece, vertex);
      PushNode(piece, last);
      piece.is_left_chain = to_left_chain;
    } else {
      while (nodes_[piece.top].below != kNoIndex && TopmostTurnsInward(piece, vertex)) {
        EmitTopmost(piece, vertex);
        PopNode(piece);
      }
    }
    PushNode(piece, vertex);
  }

  /// Whether the two topmost vertices and `vertex`, the next vertex of their chain, form a triangle
  /// inside the piece.
  bool TopmostTurnsInward(const Piece& piece, const Vertex& vertex) const {
    const Node& upper = nodes_[piece.top];
    const int turn =
        Orientation(nodes_[upper.below].vertex.point, upper.vertex.point, vertex.point);
    return piece.is_left_chain ? turn < 0 : turn > 0;
  }

  void EmitTopmost(const Piece& piece, const Vertex& vertex) {
    const Node& upper = nodes_[piece.top];
    std::uint32_t first = nodes_[upper.below].vertex.index;
    std::uint32_t second = upper.vertex.index;
    if (piece.is_left_chain) std::swap(first, second);
    triangles_->insert(triangles_->end(), {first, second, vertex.index});
  }

  // Takes `vertex` by value: it may refer to an element of nodes_, which may reallocate.
  void PushNode(Piece& piece, Vertex vertex) {
    std::uint32_t node = unused_;
    if (node == kNoIndex) {
      node = static_cast<std::uint32_t>(nodes_.size());
      nodes_.emplace_back();
    } else {
      unused_ = nodes_[node].below;
    }
    nodes_[node] = {vertex, piece.top};
    piece.top = node;
  }

  void PopNode(Piece& piece) {
    const std::uint32_t node = piece.top;
    piece.top = nodes_[node].below;
    nodes_[node].below = unused_;
    unused_ = node;
  }

  std::vector<std::uint32_t>* triangles_ = nullptr;
  std::vector<Node> nodes_;
  std::uint32_t unused_ = kNoIndex;
};

}  // namespace partiemc
