// Finds the pairs of related pieces of two successive frames, and the number of nodes they share.
//
// For rings and for shells (state/pieces.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/bits.h"
#include "identities/relations.h"
#include "identities/run_overlaps.h"
#include "state/pieces.h"

namespace partiemc {

/// A sample of the last frame whose particle is in a piece of this frame.
template <typename Pieces>
struct FoundSample {
  /// Index of its piece in the history, and number of its piece in this frame.
  std::uint32_t before = 0, now = 0;
  CellShift<Pieces::kDimensions> displacement{};  ///< From the last frame to this one.
};

/// The pieces of this frame, by number.
template <typename Pieces>
struct PiecesNow {
  std::span<const typename Pieces::Run> runs;      ///< Their pieces are numbers.
  std::span<const typename Pieces::Known> pieces;  ///< `outer` is a number.
  std::span<const FoundSample<Pieces>> found;      ///< Sorted by `before`, then `now`.
  bool has_ids = false;
  double time = 0;
  double cell_size = 1;  ///< World units.
  LatticePeriods periods = {};
};

/// Scratch of RelatePieces.
template <typename Pieces>
struct RelationScratch {
  using Shifts = std::vector<CellShift<Pieces::kDimensions>>;
  using Runs = std::vector<typename Pieces::Run>;

  Shifts shift_before, shift_now;
  std::vector<std::int64_t> displacements;
  Runs moved, wrapped;
  Runs wrapped_before, wrapped_now;  // Used only with a periodic box.
  std::vector<SharedNodes> shared;
  std::vector<std::uint32_t> newest;  // For FindSharedNodes.
  Evidence evidence;
};

/// The steps of RelatePieces.
template <typename Pieces>
class PieceRelations {
 public:
  using History = typename Pieces::History;
  using Known = typename Pieces::Known;
  using Run = typename Pieces::Run;
  using Scratch = RelationScratch<Pieces>;
  using Shift = CellShift<Pieces::kDimensions>;

  PieceRelations(const History& previous, const PiecesNow<Pieces>& now, Scratch& scratch,
                 std::vector<Relation>& relations)
      : previous_(previous), now_(now), s_(scratch), relations_(relations) {}

  void Find() {
    Evidence& e = s_.evidence;
    const std::size_t count_before = PiecesOf(previous_).size(), count_now = now_.pieces.size();
    relations_.clear();
    CountNodes(previous_.runs, count_before, e.nodes_before);
    CountNodes(now_.runs, count_now, e.nodes_now);
    s_.shift_before.assign(count_before, {});
    s_.shift_now.assign(count_now, {});
    e.sample_count.clear();
    const bool by_samples = now_.has_ids && !previous_.samples.empty();
    if (by_samples) ShiftBySamples();
    ShiftByVelocities(by_samples);
    MoveInnerAlong(PiecesOf(previous_), s_.shift_before);
    MoveInnerAlong(now_.pieces, s_.shift_now);

    const ComparedRuns runs = RunsToCompare();
    RelateByNodes(runs);
    if (by_samples) {
      e.sample_count.assign(count_before, 0);
      for (const auto& sample : previous_.samples) ++e.sample_count[PieceOf(sample)];
      AddFoundSamples(now_.found, relations_);
      ApplySamples(e, relations_);
    }
    e.linked_before.assign(count_before, 0);
    e.linked_now.assign(count_now, 0);
    MarkCounting(e, relations_);
    if (AnyMoves(s_.shift_before) || AnyMoves(s_.shift_now)) {
      AddUnmoved(runs);
      MarkCounting(e, relations_);
    }
    DropNeighbours(e, relations_);
  }

 private:
  // The runs of both frames, unmoved, wrapped into the box if there is one.
  struct ComparedRuns {
    std::span<const Run> before, now;
  };

  static void CountNodes(std::span<const Run> runs, std::size_t pieces,
                         std::vector<std::uint64_t>& nodes) {
    nodes.assign(pieces, 0);
    for (const Run& run : runs) nodes[PieceOf(run)] += NodeCount(run.first, run.last);
  }

  // Moves inner pieces with their outer pieces.
  static void MoveInnerAlong(std::span<const Known> pieces, std::vector<Shift>& shifts) {
    for (std::size_t piece = 0; piece < shifts.size(); ++piece) {
      if (pieces[piece].outer != kNoIndex) shifts[piece] = shifts[pieces[piece].outer];
    }
  }

  // Moves each outer piece by the median displacement of its samples.
  void ShiftBySamples() {
    const auto found = now_.found;
    for (std::size_t first = 0, last = 0; first < found.size(); first = last) {
      while (last < found.size() && found[last].before == found[first].before) ++last;
      for (std::size_t axis = 0; axis < Pieces::kDimensions; ++axis) {
        s_.displacements.clear();
        for (std::size_t k = first; k < last; ++k) {
          s_.displacements.push_back(found[k].displacement[axis]);
        }
        s_.shift_before[found[first].before][axis] = MedianOf(s_.displacements);
      }
    }
  }

  // The shift of a piece by its velocity; 0 if a component exceeds kMaxShift. `cells`: the shift in
  // cells of the velocity 1.
  static Shift ShiftOf(const Known& piece, double cells) {
    Shift shift{};
    const auto velocity = VelocityOf(piece);
    for (std::size_t axis = 0; axis < shift.size(); ++axis) {
      const double moved = velocity[axis] * cells;
      if (!(std::abs(moved) <= kMaxShift)) return {};
      shift[axis] = static_cast<std::int64_t>(std::floor(moved + 0.5));
    }
    return shift;
  }

  // Moves the pieces of the last frame forward, unless both frames have ids (`by_samples`), and the
  // pieces of this frame backward.
  void ShiftByVelocities(bool by_samples) {
    if (!previous_.time || !std::isfinite(now_.time) || !(now_.time > *previous_.time)) return;
    const double cells = (now_.time - *previous_.time) / now_.cell_size;
    for (std::size_t piece = 0; piece < s_.shift_before.size() && !by_samples; ++piece) {
      s_.shift_before[piece] = ShiftOf(PiecesOf(previous_)[piece], cells);
    }
    for (std::size_t piece = 0; piece < s_.shift_now.size(); ++piece) {
      s_.shift_now[piece] = ShiftOf(now_.pieces[piece], -cells);
    }
  }

  static bool AnyMoves(const std::vector<Shift>& shifts) {
    return std::ranges::any_of(shifts, [](const Shift& shift) { return shift != Shift{}; });
  }

  bool AreOfOneKind(std::uint32_t before, std::uint32_t number) const {
    return IsInner(PiecesOf(previous_)[before]) == IsInner(now_.pieces[number]);
  }

  // Moves runs, then wraps them into the box if there is one. Valid until the next call.
  std::span<const Run> Moved(std::span<const Run> runs, const std::vector<Shift>& shifts) {
    MoveRuns(runs, shifts, s_.moved);
    if (!now_.periods.Any()) return s_.moved;
    WrapRuns<Run>(s_.moved, now_.periods, s_.wrapped);
    return s_.wrapped;
  }

  ComparedRuns RunsToCompare() {
    if (!now_.periods.Any()) return {previous_.runs, now_.runs};
    WrapRuns<Run>(previous_.runs, now_.periods, s_.wrapped_before);
    WrapRuns(now_.runs, now_.periods, s_.wrapped_now);
    return {s_.wrapped_before, s_.wrapped_now};
  }

  // Relates pieces by the nodes that they share after moving the last frame's pieces forward, or
  // this frame's pieces backward.
  void RelateByNodes(const ComparedRuns& runs) {
    const auto add = [&](std::uint32_t before, std::uint32_t number, std::uint64_t nodes) {
      if (AreOfOneKind(before, number)) relations_.push_back({before, number, nodes});
    };
    FindSharedNodes(Moved(previous_.runs, s_.shift_before), runs.now, s_.newest, s_.shared);
    for (const SharedNodes& pair : s_.shared) add(pair.a, pair.b, pair.nodes);
    if (AnyMoves(s_.shift_now)) {
      FindSharedNodes(Moved(now_.runs, s_.shift_now), runs.before, s_.newest, s_.shared);
      for (const SharedNodes& pair : s_.shared) add(pair.b, pair.a, pair.nodes);
    }
    Unite(relations_);
  }

  // Relates two pieces by their nodes where they are, if moving found no relation that counts for
  // either piece: a hole may not follow the body around it, and velocities may be wrong. Skips
  // outer pieces with samples.
  void AddUnmoved(const ComparedRuns& runs) {
    const Evidence& e = s_.evidence;
    FindSharedNodes(runs.before, runs.now, s_.newest, s_.shared);
    for (const SharedNodes& pair : s_.shared) {
      if (!AreOfOneKind(pair.a, pair.b)) continue;
      if (e.linked_before[pair.a] || e.linked_now[pair.b]) continue;
      if (!e.sample_count.empty() && e.sample_count[pair.a] > 0) continue;
      relations_.push_back({pair.a, pair.b, pair.nodes});
    }
    Unite(relations_);
  }

  const History& previous_;
  const PiecesNow<Pieces>& now_;
  Scratch& s_;
  std::vector<Relation>& relations_;
};

/// Finds the related pieces (core/IDENTITIES.md) by the nodes that they share after a movement.
/// Pieces of the last frame move forward: by their samples if both frames have ids, else by their
/// velocities. In a second comparison, pieces of this frame move backward by their velocities.
/// Pieces without a relation that counts are compared once more where they are, except sampled
/// pieces. If samples contradict the nodes, the samples decide. In a periodic box, nodes are
/// wrapped first, because a piece may change its image. `relations` has each pair once, in no
/// particular order. Cost: n log n in runs, pieces and samples.
template <typename Pieces>
void RelatePieces(const typename Pieces::History& previous, const PiecesNow<Pieces>& now,
                  RelationScratch<Pieces>& scratch, std::vector<Relation>& relations) {
  PieceRelations<Pieces>(previous, now, scratch, relations).Find();
}

}  // namespace partiemc
