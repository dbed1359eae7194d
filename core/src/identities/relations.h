// Decides which pieces of two frames are related, by the nodes and the samples that they share.
//
// A piece is a ring of an outline or a shell of a surface. Nothing here depends on the dimension.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace partiemc {

/// Largest movement of a piece within a frame, in cells, because lattice coordinates have 32 bits.
inline constexpr double kMaxShift = 1u << 31;

/// The lower median: a few stray particles do not change it much. Sorts `values` in part. Requires:
/// not empty.
std::int64_t MedianOf(std::vector<std::int64_t>& values);

/// A piece of the last frame and a piece of this frame that may continue it. Either both are outer
/// or both are holes (cavities).
struct Relation {
  std::uint32_t before = 0, now = 0;  ///< Index in the last frame's history; number now.
  std::uint64_t nodes = 0;            ///< Shared nodes, counted or estimated from samples.
  std::uint32_t samples = 0;          ///< Samples of `before` that are in `now`.
  bool counts = false;                ///< Shares at least a quarter of the smaller piece's nodes.
};

/// The nodes and samples of all pieces, and which of them are related.
struct Evidence {
  std::vector<std::uint64_t> nodes_before, nodes_now;
  std::vector<std::uint32_t> sample_count;  ///< By piece of the last frame.
  std::vector<std::uint64_t> accounted;     ///< By number: nodes that the samples account for.
  std::vector<std::uint8_t> linked_before, linked_now;  ///< Whether a relation counts.
};

/// Merges the relations of each pair into one, with the maximum of each count.
void Unite(std::vector<Relation>& relations);

/// Adds the pairs of `found`, with the number of samples. Requires: sorted by `before`, then `now`.
template <typename Found>
void AddFoundSamples(std::span<const Found> found, std::vector<Relation>& relations) {
  for (std::size_t first = 0, last = 0; first < found.size(); first = last) {
    while (last < found.size() && found[last].before == found[first].before &&
           found[last].now == found[first].now) {
      ++last;
    }
    relations.push_back({.before = found[first].before,
                         .now = found[first].now,
                         .samples = static_cast<std::uint32_t>(last - first)});
  }
  Unite(relations);
}

/// Corrects the shared nodes of all relations by the samples (core/IDENTITIES.md, "Ids"). Removes
/// relations without nodes. Requires: `relations` are united; holes have no samples; every piece
/// has a node.
void ApplySamples(Evidence& evidence, std::vector<Relation>& relations);

/// Sets `counts` of the relations that count, and marks the pieces that these link.
void MarkCounting(Evidence& evidence, std::vector<Relation>& relations);

/// Removes the relations that do not count if one of their pieces has another that does.
void DropNeighbours(const Evidence& evidence, std::vector<Relation>& relations);

/// Passes on identities along the largest relations first: sets `continues`, by number, to the
/// piece of the last frame whose identity a piece continues, or to kNoIndex. Sorts `relations` by
/// `now`, then `before`. Ties: the piece that comes first before, then now. `is_continued` is
/// scratch.
void FindContinued(std::size_t pieces_before, std::size_t pieces_now,
                   std::vector<std::uint8_t>& is_continued, std::vector<Relation>& relations,
                   std::vector<std::uint32_t>& continues);

}  // namespace partiemc
