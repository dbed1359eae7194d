#include "partiemc/virtual_plane_constants.h"

namespace partiemc {

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

}  // namespace partiemc
