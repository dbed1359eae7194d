// One reconstructed frame, as input of the writers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/stage.h"
#include "partiemc/surface.h"

namespace partiemc::client {

/// Owns nothing. All views must stay valid during the call that receives the record.
struct FrameRecord {
  std::uint64_t index = 0;  ///< Index in the input, from 0; part of file names.
  double time = 0;          ///< Simulation time, in the simulation's own unit.
  const Result& result;
  /// Null: the frame is the outline `result`. Otherwise the frame is this surface in space, and
  /// writers use only the statistics and the sections of `result`.
  const Surface* surface = nullptr;
  std::span<const double> particles = {};           ///< x0, y0, x1, y1, ...; or empty.
  std::span<const double> particles_in_space = {};  ///< Of a surface: x0, y0, z0, ...; or empty.
  std::span<const float> particle_areas = {};       ///< One for each of `particles`, or empty.
  /// With own sizes, the size of each of `particles` in world units: the side of a square with its
  /// volume. Empty: all have the spacing.
  std::span<const float> particle_sizes = {};
  bool are_discs = false;  ///< Particles are discs (grains), and `particle_sizes` their diameters.
  std::array<double, kStageCount> stages_ms = {};  ///< Wall time by stage.
  double total_ms = 0;                             ///< Wall time of the whole frame.
  std::uint64_t rings_digest = 0;
  std::uint64_t mesh_digest = 0;
  std::uint64_t surface_digest = 0;
  std::span<const OutlineDigests> section_digests = {};  ///< For each of result.sections, or empty.
  /// Indices of the sections that the picture of the frame shows as thin lines.
  std::span<const std::size_t> sections_in_plane = {};
  /// The attribute that colours the particles in a report, with its values at the particles. Null
  /// if there is none.
  const AttributeValues* particle_color = nullptr;
  std::size_t section = 0;  ///< Number of the section, from 1; 0: the frame itself.

  bool HasParticleSizes() const {
    return !particles.empty() && particle_sizes.size() == particles.size() / 2;
  }
};

/// Numbers of a surface, over all of its shells.
struct SurfaceTotals {
  std::uint64_t bodies = 0, cavities = 0;
  double area = 0;         ///< Sum over bodies and cavities.
  double volume = 0;       ///< Bodies minus their cavities.
  std::int64_t genus = 0;  ///< Handles: the sum over shells.
};

inline SurfaceTotals TotalsOf(const Surface& surface) {
  SurfaceTotals totals;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    ++(surface.outer_of[shell] == kNoShell ? totals.bodies : totals.cavities);
    totals.area += surface.measures[shell].area;
    totals.volume += surface.measures[shell].volume;
    // Two triangles share each edge, so there are 3/2 edges per triangle. The Euler characteristic
    // is points - edges + triangles = points - triangles / 2.
    const std::int64_t points =
        std::int64_t{surface.point_offsets[shell + 1]} - surface.point_offsets[shell];
    const std::int64_t triangles =
        std::int64_t{surface.triangle_offsets[shell + 1]} - surface.triangle_offsets[shell];
    totals.genus += 1 - (points - triangles / 2) / 2;
  }
  return totals;
}

/// Returns section `k` of a frame, from 0 on, as a record. The record has no particles, because
/// they may lie outside the section's plane. It has no wall times, because they belong to the whole
/// frame.
inline FrameRecord SectionOf(const FrameRecord& frame, std::size_t k) {
  const OutlineDigests digests =
      k < frame.section_digests.size() ? frame.section_digests[k] : OutlineDigests();
  return {.index = frame.index,
          .time = frame.time,
          .result = frame.result.sections[k],
          .rings_digest = digests.rings,
          .mesh_digest = digests.mesh,
          .section = k + 1};
}

/// The areas of particles with these volumes. In a plane a volume is an area, except for grains:
/// the volume of a grain is its squared diameter.
inline std::vector<float> AreasOf(std::span<const float> volumes, Boundary boundary) {
  std::vector<float> areas(volumes.begin(), volumes.end());
  if (boundary == Boundary::kGrains) {
    for (float& area : areas) area *= std::numbers::pi_v<float> / 4;
  }
  return areas;
}

/// FrameRecord::particle_sizes of particles with these volumes.
inline std::vector<float> SizesOf(std::span<const float> volumes, Sizes sizes) {
  std::vector<float> of;
  if (sizes == Sizes::kEqual) return of;
  for (const float volume : volumes) of.push_back(std::sqrt(volume));
  return of;
}

/// Indices of the sections that lie in the plane of the stream's own outline: isolines and phases.
inline std::vector<std::size_t> SectionsInPlane(const ReconstructionParameters& parameters) {
  std::vector<std::size_t> sections;
  for (std::size_t k = 0; k < parameters.sections.size(); ++k) {
    const auto& slice = parameters.sections[k].slice;
    if (!slice || slice == parameters.slice) sections.push_back(k);
  }
  return sections;
}

/// The names of doubts, separated by blanks.
inline std::string DoubtsText(Doubts doubts) {
  std::string text;
  for (const Doubt doubt : kAllDoubts) {
    if (!doubts.Has(doubt)) continue;
    if (!text.empty()) text += ' ';
    text += Name(doubt);
  }
  return text;
}

/// An axis-parallel box in world units; initially empty.
struct Box {
  double min_x = std::numeric_limits<double>::infinity();
  double min_y = std::numeric_limits<double>::infinity();
  double max_x = -std::numeric_limits<double>::infinity();
  double max_y = -std::numeric_limits<double>::infinity();

  bool Empty() const { return !(min_x <= max_x && min_y <= max_y); }
  double Width() const { return Empty() ? 0 : max_x - min_x; }
  double Height() const { return Empty() ? 0 : max_y - min_y; }
  double Side() const { return std::max(Width(), Height()); }

  void Include(double x, double y) {
    min_x = std::min(min_x, x);
    min_y = std::min(min_y, y);
    max_x = std::max(max_x, x);
    max_y = std::max(max_y, y);
  }
  /// Includes points: x0, y0, x1, y1, ...
  void Include(std::span<const double> points) {
    for (std::size_t k = 0; k + 1 < points.size(); k += 2) Include(points[k], points[k + 1]);
  }
  void Include(const Box& other) {
    if (other.Empty()) return;
    Include(other.min_x, other.min_y);
    Include(other.max_x, other.max_y);
  }
};

}  // namespace partiemc::client
