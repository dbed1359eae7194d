// A surface with a cavity, a handle and attributes.
#pragma once

#include "partiemc/surface.h"

namespace partiemc::client {

/// A hollow ball and a ring-shaped body, reconstructed: two bodies, one cavity, genus 1.
/// Attributes: "height" (z) and "a,b" (x, y, z). `shift` moves all particles along x.
Surface HollowBallAndTorus(double shift = 0);

/// The same one, reconstructed once.
inline const Surface& Scene() {
  static const Surface scene = HollowBallAndTorus();
  return scene;
}

/// The surface with its triangles above z = 2 as cuts, as if a wall were there.
Surface WithCuts(Surface surface);

}  // namespace partiemc::client
