// Decides which pieces of two frames are related, by the nodes and the samples that they share.
//
// A piece is a ring of an outline or a shell of a surface. Nothing here depends on the dimension.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace partiemc {

/// In cells. Lattice coordinates have 32 bits, so a piece that would move farther within a frame is
/// not moved.
inline constexpr double kMaxShift = 1u << 31;

/// The lower median, which stray particles hardly change. Reorders `values`. Requires: not empty.
std::int64_t MedianOf(std::vector<std::int64_t>& values);

/// A piece of the last frame, and a piece of this frame that may continue it. Both are outer rings
/// (shells), or both are holes (cavities).
struct Relation {
  std::uint32_t before = 0, now = 0;  ///< Index in the history; number in this frame.
  std::uint64_t nodes = 0;            ///< Shared nodes, counted or estimated from samples.
  std::uint32_t samples = 0;          ///< Samples of `before` that are in `now`.
  bool counts = false;                ///< Shares at least a quarter of the smaller piece's nodes.
};

/// The nodes and samples of all pieces, and which of them are related.
struct Evidence {
  std::vector<std::uint64_t> nodes_before, nodes_now;  ///< By piece; by number.
  std::vector<std::uint32_t> sample_count;             ///< By piece of the last frame.
  std::vector<std::uint64_t> accounted;  ///< By number: nodes that the samples account for.
  std::vector<std::uint8_t> linked_before, linked_now;  ///< A relation of the piece counts.
};

/// Merges the relations of each pair into one, with the maximum of each count.
void Unite(std::vector<Relation>& relations);

/// Adds the pairs of `found` to `relations`, each with its number of samples, and unites them.
/// Requires: `found` is sorted by `before`, then `now`.
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

/// Corrects the shared nodes of all relations by the samples (core/IDENTITIES.md, "Ids"). Then
/// removes relations without nodes. Requires: `relations` are united; holes have no samples; every
/// piece has a node.
void ApplySamples(Evidence& evidence, std::vector<Relation>& relations);

/// Sets Relation::counts, and marks both pieces of each relation that counts as linked.
void MarkCounting(Evidence& evidence, std::vector<Relation>& relations);

/// Removes each relation that does not count if one of its pieces has a relation that counts.
void DropNeighbours(const Evidence& evidence, std::vector<Relation>& relations);

/// Passes on each identity at most once, first along the relations with most nodes. Sets
/// `continues`, by number, to the piece of the last frame whose identity the piece gets, or to
/// kNoIndex. Ties: the lower `before`, then the lower `now`. Sorts `relations` by `now`, then
/// `before`. `is_continued` is scratch.
void FindContinued(std::size_t pieces_before, std::size_t pieces_now,
                   std::vector<std::uint8_t>& is_continued, std::vector<Relation>& relations,
                   std::vector<std::uint32_t>& continues);

}  // namespace partiemc
