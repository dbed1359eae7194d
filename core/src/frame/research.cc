#include "core/internal/research.h"

namespace partiemc {

std::span<const NamedStep> AllSteps() {
  using S = VirtualPlaneSteps;
  static constexpr NamedStep kSteps[] = {
      {"edge-vertices", &S::edge_vertices}, {"normals", &S::normals},
      {"curvature", &S::curvature},         {"support", &S::support},
      {"smoothing", &S::smoothing},         {"area", &S::area},
  };
  static_assert(sizeof(S) == std::size(kSteps) * sizeof(bool), "one is missing");
  return kSteps;
}

std::span<const NamedConstant> AllConstants() {
  using C = VirtualPlaneConstants;
  static constexpr NamedConstant kConstants[] = {
      {"newton-step", &C::newton_step},         {"long-step", &C::long_step},
      {"normal-reach", &C::normal_reach},       {"bilateral-reach", &C::bilateral_reach},
      {"curvature-reach", &C::curvature_reach}, {"rounding", &C::rounding},
      {"support-radius", &C::support_radius},   {"support-depth", &C::support_depth},
      {"support-height", &C::support_height},   {"support-scatter", &C::support_scatter},
      {"smoothing-reach", &C::smoothing_reach}, {"thinning-distance", &C::thinning_distance},
      {"area-limit", &C::area_limit},           {"area-change", &C::area_change},
  };
  static_assert(sizeof(C) == std::size(kConstants) * sizeof(double), "one is missing");
  return kConstants;
}

VirtualPlaneVariant VariantFor(const ReconstructionParameters& parameters,
                               VirtualPlaneVariant variant) {
  VirtualPlaneSteps& steps = variant.steps;
  if (parameters.slice || parameters.isovalue) {
    steps.curvature = steps.support = steps.area = false;
  }
  if (parameters.isovalue) steps.smoothing = false;
  if (parameters.boundary == Boundary::kGrains) {
    const bool has_edge_vertices = steps.edge_vertices;
    steps = VirtualPlaneSteps::None();
    steps.edge_vertices = has_edge_vertices;
  }
  return variant;
}

}  // namespace partiemc
