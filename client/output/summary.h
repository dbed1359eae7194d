// The summary of a replay: the table at its end.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "client/output/frame_record.h"

namespace partiemc::client {

/// One line of the table, with numbers as text. A heading has no numbers.
struct SummaryRow {
  std::string label;
  std::string mean, p50, p99;
};

/// Collects the numbers of a replay. Memory: about 120 bytes per frame.
class Summary {
 public:
  void Add(const FrameRecord& frame);

  /// Counts a refused frame.
  void AddRefused() { ++refused_; }

  /// Makes the headline state that the replay ended early, with the reason.
  void EndEarly(std::string why) { ended_early_ = std::move(why); }

  std::uint64_t frame_count() const { return particles_.size(); }
  std::uint64_t refused_count() const { return refused_; }

  /// Whether frames have particles, but no frame has a ring or a body.
  bool is_empty() const;

  /// Mean of 1 - triangles / triangles_grid, in percent, over the frames with triangles_grid > 0. 0
  /// without such frames.
  double MeanReductionPercent() const;

  /// Mean, median and 99th percentile (nearest rank) over frames. Outlines: particles, rings,
  /// vertices, triangles unmerged and merged, reduction, milliseconds by stage and in total.
  /// Surfaces: particles, bodies, cavities, points, triangles, milliseconds in total. A replay has
  /// only outlines or only surfaces. Cost: n log n in the frames.
  std::vector<SummaryRow> Rows() const;

  /// One line per kind of doubt: number of frames, explanation.
  std::vector<std::string> Warnings() const;

  /// One line: frames, refused frames, seconds, frames per second, reason of an early end, numbers
  /// of self-intersections and folded triangles. Leaves out what is zero or absent.
  /// `wall_seconds`: of the whole replay.
  std::string Headline(double wall_seconds) const;

  /// The headline, then the rows as an aligned plain-text table; every line ends in '\n'.
  std::string Table(double wall_seconds) const;

 private:
  void AddOutline(const FrameRecord& frame);
  std::vector<SummaryRow> SurfaceRows() const;

  std::vector<double> bodies_, cavities_;  // Empty for outlines.
  std::vector<double> particles_, rings_, vertices_, triangles_grid_, triangles_, reduction_;
  std::array<std::vector<double>, kStageCount> stages_ms_;
  std::vector<double> total_ms_;
  std::array<std::uint64_t, kAllDoubts.size()> doubted_{};  // Frames, by kind of doubt.
  std::uint64_t self_intersections_ = 0, folded_triangles_ = 0, refused_ = 0;
  std::string ended_early_;
};

}  // namespace partiemc::client
