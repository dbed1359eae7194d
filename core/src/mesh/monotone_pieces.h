// Triangulates monotone polygons while their vertices come in from below: the second half of the
// triangulation by a sweep (triangulate.h).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "base/bits.h"
#include "base/point.h"
#include "base/predicates.h"

namespace partiemc {

/// Pieces whose boundary is two chains, a left and a right one, that rise in the order of
/// SweepsBefore from a common first vertex to a common last one. The vertices of both chains are
/// added in that order, and every triangle is emitted as soon as it is known.
/// Cost: linear in the vertices. Allocates nothing once warm. Not safe to share between threads.
class MonotonePieces {
 public:
  struct Vertex {
    Point point;
    std::uint32_t index = 0;
  };

  /// What is not triangulated yet of a piece, as a stack: the last vertex of one chain at the
  /// bottom, and above it the end of the other chain, which turns nowhere towards the inside, so
  /// that no triangle could be cut off. A handle, to be used with the object that started it only.
  struct Piece {
    std::uint32_t top = kNoIndex;
    bool is_left_chain = false;  ///< Which chain lies on the stack; no meaning for one vertex.

    bool IsEmpty() const { return top == kNoIndex; }
  };

  /// Forgets all pieces. Triangles will be appended to `triangles`, three indices each,
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

  /// The vertex that was added last. Requires: the piece is not empty, here and below.
  Vertex LastVertex(const Piece& piece) const { return nodes_[piece.top].vertex; }

  void AddToLeftChain(Piece& piece, const Vertex& vertex) { Add(piece, vertex, true); }
  void AddToRightChain(Piece& piece, const Vertex& vertex) { Add(piece, vertex, false); }

  /// Adds the last vertex of both chains, which sees the whole stack, and leaves the piece empty.
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
    std::uint32_t below = kNoIndex;  // In a stack, or in the list of unused nodes.
  };

  void Add(Piece& piece, const Vertex& vertex, bool to_left_chain) {
    if (piece.is_left_chain != to_left_chain) {
      // From the other chain the vertex sees the whole stack, and the last vertex stays in sight.
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

  /// Whether the two topmost vertices and `vertex`, next on their chain, make a triangle inside.
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

  // By value: the vertex may be one of the nodes, which move when there are more of them.
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
