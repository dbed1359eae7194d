#include "space_images/body_images.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <limits>
#include <variant>

#include "base/bits.h"
#include "base/cancellation.h"
#include "space/crossings.h"

namespace partiemc::space {
namespace {

using Image = BodyImageScratch::Image;

std::uint32_t RootOf(std::vector<Image>& images, std::uint32_t body) {
  return partiemc::RootOf(images, body, &Image::set);
}

/// Extends the box of an image by its nodes in one brick. `origin`: the brick's lowest node.
void IncludePart(const Vec3& origin, const BrickBits& nodes, Image& image) {
  std::uint64_t columns = 0;
  int first = kBrickSize, last = 0;
  for (int k = 0; k < kBrickSize; ++k) {
    if (nodes[k] == 0) continue;
    columns |= nodes[k];
    first = std::min(first, k);
    last = k;
  }
  std::uint64_t row = 0;
  for (int j = 0; j < kBrickSize; ++j) row |= columns >> (kBrickSize * j) & 0xff;
  const Vec3 low = origin + Vec3{1. * std::countr_zero(row),
                                 1. * (std::countr_zero(columns) / kBrickSize), 1. * first};
  const Vec3 high = origin + Vec3{1. * (63 - std::countl_zero(row)),
                                  1. * ((63 - std::countl_zero(columns)) / kBrickSize), 1. * last};
  image.low = Lower(image.low, low);
  image.high = Upper(image.high, high);
}

void MeasureImages(const BrickDirectory& bricks, const Bodies& bodies, std::vector<Image>& images) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  images.assign(bodies.bodies.size(), {.low = {kFar, kFar, kFar}, .high = {-kFar, -kFar, -kFar}});
  for (std::uint32_t body = 0; body < images.size(); ++body) images[body].set = body;
  for (const Bodies::Part& part : bodies.parts) {
    IncludePart(OriginOf(bricks[part.brick]), part.nodes, images[part.body]);
  }
}

Vec3 PositionOf(const Frame& frame, std::size_t particle) {
  return std::visit(
      [&](const auto& positions) -> Vec3 {
        const auto* at = &positions[3 * particle];
        return {double{at[0]}, double{at[1]}, double{at[2]}};
      },
      frame.positions);
}

bool IsWithin(const BodyImageInput& input, const Vec3& at) {
  return at.x >= input.low.x && at.y >= input.low.y && at.z >= input.low.z &&
         at.x <= input.high.x && at.y <= input.high.y && at.z <= input.high.z;
}

/// Joins the images that share a particle, and counts their particles. Ignores copies outside of
/// the planes.
void JoinImages(const BodyImageInput& input, BodyImageScratch& s, Bodies& bodies) {
  const std::size_t given = input.lifted.particles;
  const Frame& frame = input.lifted.frame;
  const auto count = static_cast<std::uint32_t>(input.bins.source.size());
  s.body_of.assign(given + input.lifted.originals.size(), kNoIndex);
  for (std::uint32_t body = 0; body < s.images.size(); ++body) {
    s.images[body].given = s.images[body].particles = bodies.bodies[body].particles;
    s.images[body].volume = bodies.bodies[body].volume;
  }
  for (std::uint32_t p = 0; p < count; ++p) {
    if (p % kItemsPerCheck == 0) ThrowIfCancelled();
    if (!input.bins.IsMirror(p)) s.body_of[input.bins.source[p]] = bodies.body_of_particle[p];
  }
  const double usual = input.spacing * input.spacing * input.spacing;
  for (std::uint32_t p = 0; p < count; ++p) {
    if (p % kItemsPerCheck == 0) ThrowIfCancelled();
    const std::uint32_t body = bodies.body_of_particle[p];
    if (body == kNoIndex || !input.bins.IsImage(p) || input.bins.IsMirror(p)) continue;
    s.images[body].has_copies = true;
    // Near the end of the copies the level set is wrong, so it may connect bodies.
    if (!IsWithin(input, PositionOf(frame, input.bins.source[p]))) continue;
    const std::uint32_t original = input.lifted.originals[input.bins.source[p] - given];
    std::uint32_t& of_given = s.body_of[original];
    if (of_given == kNoIndex) {
      of_given = body;  // Further copies join this one.
      ++s.images[body].particles;
      s.images[body].volume += frame.volumes.empty() ? usual : frame.volumes[original];
    }
    const std::uint32_t a = RootOf(s.images, body), b = RootOf(s.images, of_given);
    s.images[std::max(a, b)].set = std::min(a, b);
  }
  for (std::uint32_t p = 0; p < count; ++p) {
    if (p % kItemsPerCheck == 0) ThrowIfCancelled();
    if (bodies.body_of_particle[p] != kNoIndex || (input.bins.IsImage(p) && !input.wraps) ||
        input.bins.IsMirror(p)) {
      continue;
    }
    const std::uint32_t original = input.lifted.OriginalOf(input.bins.source[p]);
    if (s.body_of[original] != kNoIndex) bodies.body_of_particle[p] = kDroppedBody;
  }
  for (std::uint32_t body = 0; body < s.images.size(); ++body) {
    const std::uint32_t root = RootOf(s.images, body);
    if (root == body) continue;
    s.images[root].particles += s.images[body].particles;
    s.images[root].volume += s.images[body].volume;
    s.images[root].has_copies = s.images[root].has_copies || s.images[body].has_copies;
  }
}

/// Whether the surface of an image lies within the planes.
bool IsComplete(const BodyImageInput& input, const Image& image) {
  const Vec3 cell{1, 1, 1};
  const Vec3 low = input.cell_size * (image.low - cell);
  const Vec3 high = input.cell_size * (image.high + cell);
  return IsWithin(input, low) && IsWithin(input, high);
}

/// Finds the image of each body that remains whole.
void FindBest(const BodyImageInput& input, const Bodies& bodies, std::vector<Image>& images) {
  for (std::uint32_t body = 0; body < images.size(); ++body) {
    Image& set = images[RootOf(images, body)];
    if (!set.has_copies || !IsComplete(input, images[body])) continue;
    if (set.best == kNoIndex || images[body].given > images[set.best].given) set.best = body;
  }
  for (Image& set : images) {
    if (set.best == kNoIndex) continue;
    const Body& best = bodies.bodies[set.best];
    // Fewer: particles are missing. More: the image has a particle and its copy.
    if (best.particles + best.copies != set.particles) set.best = kNoIndex;
  }
}

}  // namespace

void ChooseImages(const BodyImageInput& input, BodyImageScratch& s, Bodies& bodies) {
  MeasureImages(input.bins.bricks, bodies, s.images);
  JoinImages(input, s, bodies);
  FindBest(input, bodies, s.images);
  for (std::uint32_t index = 0; index < s.images.size(); ++index) {
    const std::uint32_t root = RootOf(s.images, index);
    const Image& set = s.images[root];
    Body& body = bodies.bodies[index];
    body.particles = set.particles;
    body.volume = set.volume;
    if (!set.has_copies || (set.best == index && !input.wraps)) continue;
    body.fate = input.wraps || set.best == kNoIndex ? BodyFate::kCut : BodyFate::kGone;
    body.is_complete = input.wraps && IsComplete(input, s.images[index]) &&
                       s.images[index].given + body.copies == set.particles;
    body.first_image = body.fate == BodyFate::kGone ? set.best : root;
  }
}

void RemoveGoneImages(std::span<const std::uint32_t> body_of_vertex, Bodies& bodies,
                      std::vector<VertexTriangle>& triangles) {
  std::erase_if(triangles, [&](const VertexTriangle& triangle) {
    return triangle[0] < body_of_vertex.size() && bodies.IsGone(body_of_vertex[triangle[0]]);
  });
  for (std::uint32_t& body : bodies.body_of_particle) {
    if (body != kNoIndex && body != kDroppedBody && bodies.IsGone(body)) body = kDroppedBody;
  }
}

void FindCutShells(const Bodies& bodies, std::span<const std::uint32_t> body_of_shell,
                   const Surface& surface, CutShells& shells) {
  shells.any = false;
  shells.is_cut.assign(body_of_shell.size(), 0);
  shells.outer_of.assign(body_of_shell.size(), kNoShell);
  shells.first.assign(bodies.bodies.size(), kNoShell);
  for (std::uint32_t shell = 0; shell < body_of_shell.size(); ++shell) {
    const std::uint32_t body = body_of_shell[shell];
    const bool is_outer = surface.outer_of[shell] == kNoShell;
    shells.outer_of[shell] = is_outer ? shell : surface.outer_of[shell];
    if (body == kNoIndex || !bodies.IsCut(body)) continue;
    shells.any = true;
    shells.is_cut[shell] = 1;
    std::uint32_t& first = shells.first[bodies.bodies[body].first_image];
    if (is_outer && first == kNoShell) first = shell;
  }
  for (std::uint32_t shell = 0; shell < body_of_shell.size(); ++shell) {
    if (shells.is_cut[shell] == 0) continue;
    shells.outer_of[shell] = shells.first[bodies.bodies[body_of_shell[shell]].first_image];
  }
}

}  // namespace partiemc::space
