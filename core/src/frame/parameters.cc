#include "partiemc/parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "frame/calibration.h"
#include "frame/frame_view.h"
#include "frame/phase_rules.h"
#include "frame/placement_traits.h"
#include "frame/wall_rules.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

constexpr auto kAllPlacements = [] {
  std::array<Placement, kPlacements.size()> placements;
  std::ranges::transform(kPlacements, placements.begin(), &PlacementTraits::placement);
  return placements;
}();
// The least component of a plane's normal that is not 0: its square stays above 0.
constexpr double kMinNormal = 1e-60;

constexpr std::array kFills = {Fill::kNone, Fill::kGrid, Fill::kGreedy, Fill::kConforming,
                               Fill::kPolygon};

// Names, in the order of the enumerators.
constexpr std::array<std::string_view, 5> kFillNames = {"none", "grid", "greedy", "conforming",
                                                        "polygon"};
constexpr std::array<std::string_view, 3> kPlaneNames = {"xy", "xz", "yz"};

template <std::size_t kCount, typename Enum>
std::string_view NameOf(const std::array<std::string_view, kCount>& names, Enum value) {
  const auto k = static_cast<std::size_t>(value);
  return k < kCount ? names[k] : "";
}

bool Within(double value, double low, double high) { return value >= low && value <= high; }

// Checks a slice. `of`: the path of its section in errors; empty for the slice of the stream.
absl::Status CheckSlice(const std::string& of, const SlicePlane& slice) {
  constexpr std::string_view kAxes = "xyz";
  for (std::size_t k = 0; k < 3; ++k) {
    for (const auto& [name, value] :
         {std::pair("origin", slice.origin[k]), std::pair("normal", slice.normal[k])}) {
      if (std::abs(value) <= kMaxCoordinate) continue;
      return InvalidParameter(absl::StrCat(of, "slice.", name, "_", std::string(1, kAxes[k])),
                              value, "must be finite and at most 1e69 in magnitude");
    }
  }
  const auto& normal = slice.normal;
  if (std::max({std::abs(normal[0]), std::abs(normal[1]), std::abs(normal[2])}) < kMinNormal) {
    return InvalidParameter(absl::StrCat(of, "slice.normal"), 0,
                            "must have a component of 1e-60 or more in magnitude");
  }
  return absl::OkStatus();
}

absl::Status CheckIsovalue(const std::string& of, double isovalue) {
  using P = ReconstructionParameters;
  if (Within(isovalue, P::kMinIsovalue, P::kMaxIsovalue)) return absl::OkStatus();
  return InvalidParameter(absl::StrCat(of, "isovalue"), isovalue,
                          "must be in [0.01, 10]: the density is about 1 inside of bodies");
}

// Checks the phase of a section, and that no other parameter excludes it.
absl::Status CheckPhase(const ReconstructionParameters& p, std::size_t section) {
  const Section& of = p.sections[section];
  const std::string field = absl::StrCat("sections[", section, "].phase");
  const auto refused = [&](const std::string& rule) {
    return InvalidParameter(field, absl::StrCat(*of.phase), rule);
  };
  if (p.output == Output::kSurface) {
    return refused("must be absent for a surface: surfaces have no phases");
  }
  if (p.slice || of.slice) return refused("must be absent with a slice");
  if (p.isovalue || of.isovalue) return refused("must be absent with an isovalue");
  if (p.boundary == Boundary::kGrains) return refused("must be absent with grains");
  if (p.placement != Placement::kVirtualPlane) {
    return refused("must be absent unless the placement is virtual-plane");
  }
  if (auto status = CheckPhaseNumber(field, *of.phase); !status.ok()) return status;
  if (auto status = CheckPhaseAttribute(p.phase_attribute, "a section has a phase"); !status.ok()) {
    return status;
  }
  for (std::size_t k = 0; k < section; ++k) {
    if (p.sections[k].phase == of.phase) {
      return refused(absl::StrCat("must differ from sections[", k, "].phase"));
    }
  }
  return absl::OkStatus();
}

// Checks slices, isovalues and sections, and the parameters that these require.
absl::Status CheckOutlines(const ReconstructionParameters& p) {
  bool is_isoline = p.isovalue.has_value();
  if (p.slice) {
    if (auto status = CheckSlice("", *p.slice); !status.ok()) return status;
  }
  if (p.isovalue) {
    if (auto status = CheckIsovalue("", *p.isovalue); !status.ok()) return status;
  }
  const bool is_surface = p.output == Output::kSurface;
  if (p.sections.size() > p.kMaxSections) {
    return InvalidParameter("sections", absl::StrCat(p.sections.size()),
                            absl::StrCat("must be at most ", p.kMaxSections));
  }
  for (std::size_t k = 0; k < p.sections.size(); ++k) {
    const Section& section = p.sections[k];
    const std::string of = absl::StrCat("sections[", k, "].");
    if (section.phase) {
      if (auto status = CheckPhase(p, k); !status.ok()) return status;
    }
    if (is_surface && !section.slice) {
      return InvalidParameter(of + "slice", "absent", "must be present: the stream has a surface");
    }
    if (section.slice && !p.slice && !is_surface) {
      return InvalidParameter(of + "slice", "present",
                              "must be absent unless parameters.slice is set");
    }
    if (section.slice) {
      if (auto status = CheckSlice(of, *section.slice); !status.ok()) return status;
    }
    if (section.isovalue) {
      is_isoline = true;
      if (auto status = CheckIsovalue(of, *section.isovalue); !status.ok()) return status;
    }
  }
  if (p.slice && !p.spacing) {
    return InvalidParameter("spacing", "absent",
                            "must be given for a slice, which does not show it");
  }
  if (KeepsGuarantees(p.placement)) return absl::OkStatus();
  if (p.slice) {
    return InvalidParameter(
        "placement", std::string(Name(p.placement)),
        "must be another one for a slice: its vertices are particles, which are not on "
        "the plane");
  }
  if (is_isoline) {
    return InvalidParameter(
        "placement", std::string(Name(p.placement)),
        "must be another one for an isovalue: its vertices are particles, which are not "
        "on the isoline");
  }
  return absl::OkStatus();
}

// Least length of a box, in kernel radii. Neighbours in a body are at most two kernel radii apart;
// in a box of four, each particle has only one image that near.
constexpr double kMinBoxLength = 4;
constexpr double kRoundingOfSizes = 1e-6;

// Checks the box, and that slices and the placement do not exclude it.
absl::Status CheckBox(const ReconstructionParameters& p) {
  if (!p.box) return absl::OkStatus();
  const double kernel_radius =
      p.boundary == Boundary::kGrains ? kGrainKernelRadius : p.kernel_radius;
  if (auto status = Validate(*p.box, kernel_radius, p.spacing.value_or(0)); !status.ok()) {
    return status;
  }
  if (p.box->wraps && !KeepsGuarantees(p.placement)) {
    return InvalidParameter("box.wraps", "true",
                            "must be false for farthest-particle, whose rings cannot be cut");
  }
  constexpr std::string_view kRule =
      "must be absent with a periodic box: a plane cuts only one image of a body";
  if (p.slice) return InvalidParameter("slice", "present", std::string(kRule));
  for (std::size_t k = 0; k < p.sections.size(); ++k) {
    if (!p.sections[k].slice) continue;
    return InvalidParameter(absl::StrCat("sections[", k, "].slice"), "present", std::string(kRule));
  }
  return absl::OkStatus();
}

// Checks that no other parameter excludes own sizes.
absl::Status CheckSizes(const ReconstructionParameters& p) {
  if (p.sizes == Sizes::kEqual) return absl::OkStatus();
  const auto refused = [&](const std::string& with) {
    return InvalidParameter("sizes", std::string(Name(p.sizes)), "must be equal " + with);
  };
  const bool has_slice = p.slice || std::ranges::any_of(p.sections, [](const Section& section) {
                           return section.slice.has_value();
                         });
  if (has_slice) return refused("for a slice");
  if (p.noise_filter) return refused("with a noise filter");
  if (!KeepsGuarantees(p.placement)) {
    return refused("for the placement " + std::string(Name(p.placement)));
  }
  return absl::OkStatus();
}

// Checks the parameters that grains require and exclude.
absl::Status CheckBoundary(const ReconstructionParameters& p) {
  if (p.boundary == Boundary::kBulk) return absl::OkStatus();
  const bool is_isoline = p.isovalue || std::ranges::any_of(p.sections, [](const Section& s) {
                            return s.isovalue.has_value();
                          });
  if (p.output == Output::kSurface) {
    return InvalidParameter("boundary", std::string(Name(p.boundary)),
                            "must be bulk for a surface");
  }
  if (p.sizes == Sizes::kOwn && !is_isoline) {
    // Without a spacing, the smallest grain is the spacing, 2 / cell_size cells wide.
    if (p.spacing || p.cell_size * p.kSmallestGrain <= 2) return absl::OkStatus();
    return InvalidParameter("cell_size", p.cell_size,
                            "must be at most 1.408 half spacings for grains without a spacing");
  }
  return InvalidParameter(
      "boundary", std::string(Name(p.boundary)),
      is_isoline ? "must be bulk with an isovalue" : "must be bulk unless sizes are own");
}

// Checks SurfaceOptions, and the parameters that surfaces require and exclude.
absl::Status CheckSurface(const ReconstructionParameters& p) {
  const auto check = [](const char* field, double value, const char* rule) {
    if (value >= 0 && std::isfinite(value)) return absl::OkStatus();
    return InvalidParameter(field, value, rule);
  };
  if (auto status = check("surface.thinning_distance", p.surface.thinning_distance,
                          "must be 0 or more spacings, and finite");
      !status.ok()) {
    return status;
  }
  if (auto status = check("surface.min_component_volume", p.surface.min_component_volume,
                          "must be 0 or more cubed spacings, and finite");
      !status.ok()) {
    return status;
  }
  // A larger error would remove details as large as particles.
  if (!Within(p.surface.simplify, 0, 1)) {
    return InvalidParameter("surface.simplify", p.surface.simplify, "must be in [0, 1] spacings");
  }
  if (p.output != Output::kSurface) return absl::OkStatus();
  if (!p.spacing) return InvalidParameter("spacing", "absent", "must be given for a surface");
  if (p.slice) {
    return InvalidParameter("slice", "present",
                            "must be absent for a surface: add a section with the slice");
  }
  if (p.isovalue) return InvalidParameter("isovalue", "present", "must be absent for a surface");
  if (!KeepsGuarantees(p.placement)) {
    return InvalidParameter("placement", std::string(Name(p.placement)),
                            "must be another one for a surface");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status Validate(const ReconstructionParameters& parameters) {
  const auto& p = parameters;
  if (p.spacing && !Within(*p.spacing, p.kMinSpacing, p.kMaxSpacing)) {
    return InvalidParameter("spacing", *p.spacing, "must be in [1e-60, 1e60]");
  }
  if (!Within(p.kernel_radius, 1.5, 8)) {
    return InvalidParameter("kernel_radius", p.kernel_radius, "must be in [1.5, 8] spacings");
  }
  if (!Within(p.cell_size, 0.25, 4)) {
    return InvalidParameter("cell_size", p.cell_size, "must be in [0.25, 4] spacings");
  }
  if (p.reference_radius && !(*p.reference_radius > 0 && *p.reference_radius < p.kernel_radius)) {
    return InvalidParameter("reference_radius", *p.reference_radius,
                            absl::StrCat("must be above 0 and below the kernel radius of ",
                                         ShortestNumber(p.kernel_radius), " spacings"));
  }
  if (!Within(p.surface_offset, -1, 1)) {
    return InvalidParameter("surface_offset", p.surface_offset, "must be in [-1, 1] spacings");
  }
  if (!Within(p.attribute_tolerance, 0, 1)) {
    return InvalidParameter("attribute_tolerance", p.attribute_tolerance,
                            "must be in [0, 1], a fraction of the attribute's range");
  }
  if (!(p.min_component_area >= 0 && std::isfinite(p.min_component_area))) {
    return InvalidParameter("min_component_area", p.min_component_area,
                            "must be 0 or more squared spacings, and finite");
  }
  if (p.noise_filter && !(*p.noise_filter > 0 && *p.noise_filter <= 1)) {
    return InvalidParameter("noise_filter", *p.noise_filter,
                            "must be in (0, 1]: the weight of given positions");
  }
  if (p.phase_attribute.size() > kMostNameBytes) {
    return InvalidParameter("phase_attribute", absl::StrCat(p.phase_attribute.size(), " bytes"),
                            absl::StrCat("must be at most ", kMostNameBytes));
  }
  if (absl::Status status = CheckSurface(p); !status.ok()) return status;
  if (absl::Status status = CheckBox(p); !status.ok()) return status;
  if (absl::Status status = CheckSizes(p); !status.ok()) return status;
  if (absl::Status status = CheckBoundary(p); !status.ok()) return status;
  if (absl::Status status = CheckWalls(p); !status.ok()) return status;
  return CheckOutlines(p);
}

absl::Status Validate(const PeriodicBox& box, double kernel_radius, double spacing) {
  constexpr std::string_view kAxes = "xyz";
  bool any = false;
  for (std::size_t k = 0; k < box.axes.size(); ++k) {
    if (!box.axes[k]) continue;
    any = true;
    const auto [origin, length] = *box.axes[k];
    const std::string field = absl::StrCat("box.", std::string(1, kAxes[k]), ".");
    if (!(std::abs(origin) <= kMaxCoordinate)) {
      return InvalidParameter(field + "origin", origin,
                              "must be finite and at most 1e69 in magnitude");
    }
    if (!(length > 0 && length <= kMaxCoordinate)) {
      return InvalidParameter(field + "length", length, "must be above 0 and at most 1e69");
    }
    if (spacing == 0) continue;
    const double least = kMinBoxLength * kernel_radius * spacing;
    // Sizes are roots of float32 volumes.
    if (length < (1 - kRoundingOfSizes) * least) {
      return InvalidParameter(field + "length", length,
                              absl::StrCat("must be at least four kernel radii, ", least));
    }
    if (length > box.kMostSpacings * spacing) {
      return InvalidParameter(field + "length", length, "must be at most 1e8 spacings");
    }
  }
  if (!any) return InvalidParameter("box", "no axis", "must have one of the axes x, y, z");
  return absl::OkStatus();
}

ReconstructionParameters Resolve(ReconstructionParameters parameters) {
  if (parameters.boundary == Boundary::kGrains) {
    parameters.kernel_radius = kGrainKernelRadius;
    parameters.reference_radius = kGrainReferenceRadius;
  }
  if (!parameters.reference_radius) {
    const double kernel_radius = parameters.kernel_radius;
    parameters.reference_radius =
        parameters.output == Output::kSurface ? CalibratedSurfaceRadius(kernel_radius)
        : parameters.slice                    ? CalibratedSliceRadius(kernel_radius)
                           : CalibratedReferenceRadius(parameters.placement, kernel_radius);
  }
  if (!parameters.clean) {
    parameters.clean = TraitsOf(parameters.placement).cleans && !parameters.isovalue;
  }
  return parameters;
}

bool KeepsGuarantees(Placement placement) { return !TraitsOf(placement).takes_particles; }

std::string_view Name(Placement placement) { return TraitsOf(placement).name; }

std::string_view Name(Output output) { return output == Output::kOutline ? "outline" : "surface"; }

std::string_view Name(Fill fill) { return NameOf(kFillNames, fill); }

std::string_view Name(SpacingRule rule) {
  return rule == SpacingRule::kFirstFrame ? "first-frame" : "every-frame";
}

std::string_view Name(Sizes sizes) { return sizes == Sizes::kEqual ? "equal" : "own"; }

std::string_view Name(Boundary boundary) { return boundary == Boundary::kBulk ? "bulk" : "grains"; }

std::string_view Name(Plane plane) { return NameOf(kPlaneNames, plane); }

std::span<const Placement> AllPlacements() { return kAllPlacements; }
std::span<const Fill> AllFills() { return kFills; }

std::optional<Placement> FindPlacement(std::string_view name) {
  for (const PlacementTraits& traits : kPlacements) {
    if (traits.name == name) return traits.placement;
  }
  return std::nullopt;
}

std::optional<Fill> FindFill(std::string_view name) {
  for (const Fill fill : kFills) {
    if (Name(fill) == name) return fill;
  }
  return std::nullopt;
}

}  // namespace partiemc
