#include "identities/relations.h"

#include <algorithm>
#include <cstddef>
#include <tuple>

#include "base/bits.h"
#include "partiemc/state.h"

namespace partiemc {
namespace {

// Two pieces that share fewer than a quarter of the nodes of the smaller one are neighbours: one of
// them moved to where the other was.
constexpr std::uint64_t kSmallestPart = 4;

// For a full set of 16 samples: the largest difference between the share of the samples and the
// share of the nodes, in samples. This is three standard deviations of the samples of a piece that
// splits in halves.
constexpr std::uint64_t kTolerance = 6;

// A piece of the last frame may share nodes with a new piece, but have no samples in it. The old
// piece is then not a parent if the samples of other pieces account for at least three quarters of
// the new piece's nodes.
constexpr std::uint64_t kAccountedQuarters = 3;

// Estimates the nodes that a piece passed to another piece: its number of nodes, times the share of
// its samples that are in the other piece; at most the nodes of the other piece.
std::uint64_t NodesBySamples(const Relation& relation, const Evidence& s) {
  const std::uint64_t nodes = s.nodes_before[relation.before];
  const std::uint64_t count = s.sample_count[relation.before];
  const std::uint64_t carried =
      nodes / count * relation.samples + nodes % count * relation.samples / count;
  return std::min(carried, s.nodes_now[relation.now]);
}

// Whether the samples of a piece agree with its nodes, within the statistical error. False for
// fewer than kMaxSamples: the samples are then all particles of the piece, so they are exact and
// decide alone.
bool SamplesAgree(std::span<const Relation> of_one, const Evidence& s) {
  const std::uint32_t piece = of_one.front().before;
  if (s.sample_count[piece] < kMaxSamples) return false;
  const std::uint64_t nodes = s.nodes_before[piece];
  return std::all_of(of_one.begin(), of_one.end(), [&](const Relation& relation) {
    const std::uint64_t by_nodes = relation.nodes * kMaxSamples;
    const std::uint64_t by_samples = relation.samples * nodes;
    const std::uint64_t difference =
        std::max(by_nodes, by_samples) - std::min(by_nodes, by_samples);
    return difference <= kTolerance * nodes;
  });
}

// Corrects the shared nodes of all relations of one piece of the last frame by its samples.
void CorrectBySamples(std::span<Relation> of_one, const Evidence& s) {
  const bool sampled = s.sample_count[of_one.front().before] > 0;
  // If samples and nodes agree, the nodes are more accurate than the estimate from samples.
  const bool by_nodes = !sampled || SamplesAgree(of_one, s);
  for (Relation& relation : of_one) {
    if (relation.samples > 0) {
      if (!by_nodes || relation.nodes == 0) relation.nodes = NodesBySamples(relation, s);
    } else if (!by_nodes ||
               4 * s.accounted[relation.now] >= kAccountedQuarters * s.nodes_now[relation.now]) {
      relation.nodes = 0;
    }
  }
}

}  // namespace

std::int64_t MedianOf(std::vector<std::int64_t>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void Unite(std::vector<Relation>& relations) {
  std::sort(relations.begin(), relations.end(), [](const Relation& x, const Relation& y) {
    return std::tie(x.before, x.now) < std::tie(y.before, y.now);
  });
  std::size_t kept = 0;
  for (const Relation& relation : relations) {
    if (kept > 0 && relations[kept - 1].before == relation.before &&
        relations[kept - 1].now == relation.now) {
      Relation& same = relations[kept - 1];
      same.nodes = std::max(same.nodes, relation.nodes);
      same.samples = std::max(same.samples, relation.samples);
      same.counts = same.counts || relation.counts;
    } else {
      relations[kept++] = relation;
    }
  }
  relations.resize(kept);
}

void ApplySamples(Evidence& s, std::vector<Relation>& relations) {
  s.accounted.assign(s.nodes_now.size(), 0);
  for (const Relation& relation : relations) {
    if (relation.samples > 0) s.accounted[relation.now] += NodesBySamples(relation, s);
  }
  for (std::size_t first = 0, last = 0; first < relations.size(); first = last) {
    while (last < relations.size() && relations[last].before == relations[first].before) ++last;
    CorrectBySamples(std::span(relations).subspan(first, last - first), s);
  }
  std::erase_if(relations, [](const Relation& relation) { return relation.nodes == 0; });
}

void MarkCounting(Evidence& s, std::vector<Relation>& relations) {
  for (Relation& relation : relations) {
    const std::uint64_t smaller =
        std::min(s.nodes_before[relation.before], s.nodes_now[relation.now]);
    relation.counts = relation.nodes >= smaller / kSmallestPart + (smaller % kSmallestPart != 0);
    if (relation.counts) s.linked_before[relation.before] = s.linked_now[relation.now] = 1;
  }
}

void DropNeighbours(const Evidence& s, std::vector<Relation>& relations) {
  std::erase_if(relations, [&](const Relation& relation) {
    return !relation.counts && (s.linked_before[relation.before] || s.linked_now[relation.now]);
  });
}

void FindContinued(std::size_t pieces_before, std::size_t pieces_now,
                   std::vector<std::uint8_t>& is_continued, std::vector<Relation>& relations,
                   std::vector<std::uint32_t>& continues) {
  std::sort(relations.begin(), relations.end(), [](const Relation& x, const Relation& y) {
    return std::tie(y.nodes, x.before, x.now) < std::tie(x.nodes, y.before, y.now);
  });
  is_continued.assign(pieces_before, 0);
  continues.assign(pieces_now, kNoIndex);
  for (const Relation& pair : relations) {
    if (is_continued[pair.before] || continues[pair.now] != kNoIndex) continue;
    is_continued[pair.before] = 1;
    continues[pair.now] = pair.before;
  }
  std::sort(relations.begin(), relations.end(), [](const Relation& x, const Relation& y) {
    return std::tie(x.now, x.before) < std::tie(y.now, y.before);
  });
}

}  // namespace partiemc
