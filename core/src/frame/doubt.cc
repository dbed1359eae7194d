#include "partiemc/doubt.h"

namespace partiemc {

std::string_view Name(Doubt doubt) {
  switch (doubt) {
    case Doubt::kSpacingProvisional:
      return "spacing-provisional";
    case Doubt::kSpacingContradicted:
      return "spacing-contradicted";
    case Doubt::kVolumesContradictSpacing:
      return "volumes-contradict-spacing";
    case Doubt::kPositionsCoarse:
      return "positions-coarse";
    case Doubt::kWallsHideFluid:
      return "walls-hide-fluid";
  }
  return "";
}

std::string_view Explanation(Doubt doubt) {
  switch (doubt) {
    case Doubt::kSpacingProvisional:
      return "particles do not agree on a spacing yet, lengths are estimates; give the spacing";
    case Doubt::kSpacingContradicted:
      return "particles are about twice or half as far apart as the spacing says; give the right "
             "one";
    case Doubt::kVolumesContradictSpacing:
      return "volumes are above twice or below half the squared (in space cubed) spacing; check "
             "the unit";
    case Doubt::kPositionsCoarse:
      return "float32 positions are coarse for the spacing; send float64, or relative to an origin";
    case Doubt::kWallsHideFluid:
      return "most of the fluid is behind walls, or all particles are wall particles; the fluid is "
             "on "
             "the left of a wall (tanks are counter-clockwise, obstacles clockwise), and on the "
             "fluid side of a wall plane";
  }
  return "";
}

}  // namespace partiemc
