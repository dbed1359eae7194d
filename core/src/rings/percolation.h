// The bodies of a periodic box after ChooseBodies: whole, cut or gone.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "partiemc/parameters.h"
#include "rings/rings.h"

namespace partiemc {

/// The fate of a component of inside nodes (rings/components.h).
enum class Fate : std::uint8_t {
  kWhole,  ///< The component remains as it is.
  kCut,    ///< Only the part in the box (Window) remains.
  kGone,   ///< The component is removed: it is spray, or another image of the body remains.
};

/// The part of the plane in which cut bodies remain. World units.
struct Window {
  std::array<std::optional<PeriodicAxis>, 2> axes;  ///< Absent: no ends along this axis.
};

/// A frame with copies of particles (periodic/lift.h).
struct Percolation {
  Window window;
  std::uint32_t particles;                ///< Number of given particles; copies follow them.
  std::span<const Fate> fates;            ///< By component.
  std::span<const std::uint32_t> bodies;  ///< By component: BodyChoice::bodies.
  /// World units, by axis: farther beyond the window, nodes may miss copies (Prepared::reach).
  std::array<double, 2> reach{};

  /// The outer ring that represents the body of a component.
  std::uint32_t OuterOf(const RingTopology& topology, std::uint32_t component) const {
    return topology.outer_ring[bodies[component]];
  }
  bool IsCut(const RingTopology& topology, std::size_t ring) const {
    return fates[topology.component_of_ring[ring]] == Fate::kCut;
  }
  bool IsGone(const RingTopology& topology, std::size_t ring) const {
    return fates[topology.component_of_ring[ring]] == Fate::kGone;
  }
  /// False for copies of particles of a body that is cut.
  bool Counts(std::uint32_t source, std::uint32_t component) const {
    return source < particles || fates[component] != Fate::kCut;
  }
};

}  // namespace partiemc
