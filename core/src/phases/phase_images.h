// The images of regions in a periodic box, in frames with copies of particles (core/PHASES.md,
// "Periodic boxes").
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"
#include "phases/phase_field.h"
#include "phases/phase_rings.h"
#include "rings/percolation.h"

namespace partiemc {

/// A region is a component of a phase. Regions have numbers: those of the first phase, then those
/// of the second phase, and so on.
class PhaseImages {
 public:
  /// Numbers the regions of a frame. `body`: of the outline that the phases divide, or null without
  /// copies of particles. A region has the fate of the component of the body in which it lies. Sets
  /// up the window, and the groups of rings. Cost: linear in rings and in runs of inside nodes.
  void Build(const Percolation* body, const BodyOutline& outline, double cell_size,
             std::span<const PhaseRings> phases);

  /// Joins the regions that will be cut and are images of one region. Those share a particle. Those
  /// without particles of their phase share a node, up to whole lengths of the window. `region_of`:
  /// by particle of the frame, the region of its phase in which it lies, or kNoComponent, also if
  /// it does not decide (DecidesImages). `originals`: by copy, its particle. Changes `region_of`.
  /// Cost: linear in particles; in runs of inside nodes if a region has no particles.
  void JoinImages(std::span<const std::uint32_t> originals, const TileDirectory& directory,
                  std::span<const PhaseRings> phases, std::span<std::uint32_t> region_of);

  std::uint32_t RegionCount() const { return first_.back(); }
  std::uint32_t RegionOf(std::size_t phase, std::uint32_t component) const {
    return first_[phase] + component;
  }
  /// The first of the images of a region.
  std::uint32_t RootOf(std::uint32_t region) const {
    return root_.empty() ? region : root_[region];
  }

  bool HasCopies() const { return has_copies_; }
  bool IsCut(std::uint32_t region) const { return has_copies_ && fates_[region] == Fate::kCut; }
  /// False for copies of particles in a region that will be cut.
  bool Counts(std::uint32_t source, std::uint32_t region) const {
    return source < particles_ || !IsCut(region);
  }
  /// The box along the axes along which bodies percolate, in cells.
  const Window& window() const { return window_; }
  /// Whether the region of a particle decides which regions are images of each other. False for
  /// copies so far from the window that copies around them are missing: their regions may be wrong.
  /// `at`: the particle's place in cells.
  bool DecidesImages(std::uint32_t source, const Point& at) const {
    return source < particles_ || IsInReach(at);
  }
  /// The group of a ring of the body, by its first ring. The outer rings of a body that will be cut
  /// are a group. Each other ring is one, too.
  std::uint32_t GroupOf(std::uint32_t ring) const {
    return ring_groups_.empty() || ring_groups_[ring] == kNoRing ? ring : ring_groups_[ring];
  }
  /// Whether a ring is an outer ring of a body that will be cut.
  bool IsRingCut(std::uint32_t ring) const {
    return !ring_groups_.empty() && ring_groups_[ring] != kNoRing;
  }

  /// The percolation of a phase. `body`: as for Build. Requires: JoinImages.
  Percolation OfPhase(const Percolation& body, std::size_t phase) const;

 private:
  void GroupRings(const Percolation& body, const BodyOutline& outline);
  bool IsInReach(const Point& at) const;
  void JoinByParticles(std::span<const std::uint32_t> originals,
                       std::span<std::uint32_t> region_of);
  void JoinByNodes(const TileDirectory& directory, std::span<const PhaseRings> phases,
                   std::span<const std::uint32_t> region_of);
  void Join(std::uint32_t a, std::uint32_t b);

  std::vector<std::uint32_t> first_{0};  // By phase: its first region. Then the number of regions.
  bool has_copies_ = false;
  std::uint32_t particles_ = 0;        // Number of given particles.
  std::vector<Fate> fates_;            // By region.
  std::vector<std::uint32_t> root_;    // By region: an earlier image, or itself. Empty: themselves.
  std::vector<std::uint32_t> bodies_;  // By region: the component of the first image.
  std::vector<std::uint8_t> is_empty_;      // By region: will be cut, has no particles. Scratch.
  std::vector<std::uint32_t> ring_groups_;  // By ring of the body: its group, or kNoRing.
  std::vector<std::uint32_t> first_ring_;   // By component of the body. Scratch.
  Window window_;
  std::array<double, 2> reach_{};  // By axis: Percolation::reach in cells.
};

/// The length of the part of a segment in a window. An axis that is absent has no ends.
double LengthInWindow(const Point& from, const Point& to, const Window& window);

}  // namespace partiemc
