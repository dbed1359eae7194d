#include "check/triangle_contact.h"

#include <algorithm>

#include "base/point.h"
#include "base/predicates.h"
#include "base/predicates_in_space.h"

namespace partiemc {
namespace {

/// The shadow of a point: its projection along axis 0, 1 or 2.
Point ShadowOf(const Vec3& a, int axis) {
  if (axis == 0) return {a.y, a.z};
  if (axis == 1) return {a.z, a.x};
  return {a.x, a.y};
}

/// An axis along which the shadow of the triangle is not a segment; 3 if there is no such axis.
int AxisOf(const Vec3& a, const Vec3& b, const Vec3& c) {
  int axis = 0;
  while (axis < 3 && Orientation(ShadowOf(a, axis), ShadowOf(b, axis), ShadowOf(c, axis)) == 0) {
    ++axis;
  }
  return axis;
}

/// Whether p lies in the closed triangle abc. Requires: abc is not degenerate.
bool LiesInTriangle(const Point& p, const std::array<Point, 3>& abc) {
  bool is_left = false, is_right = false;
  for (int k = 0; k < 3; ++k) {
    const int side = Orientation(abc[k], abc[(k + 1) % 3], p);
    is_left = is_left || side > 0;
    is_right = is_right || side < 0;
  }
  return !(is_left && is_right);
}

bool TouchInPlane(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& abc) {
  const int axis = AxisOf(abc[0], abc[1], abc[2]);
  const std::array<Point, 3> shadow{ShadowOf(abc[0], axis), ShadowOf(abc[1], axis),
                                    ShadowOf(abc[2], axis)};
  const Point from = ShadowOf(p, axis), to = ShadowOf(q, axis);
  if (LiesInTriangle(from, shadow) || LiesInTriangle(to, shadow)) return true;
  for (int k = 0; k < 3; ++k) {
    if (SegmentsTouch(from, to, shadow[k], shadow[(k + 1) % 3])) return true;
  }
  return false;
}

std::array<Vec3, 3> CornersOf(std::span<const double> points, const Triangle& triangle) {
  return {Vec3At(points, triangle[0]), Vec3At(points, triangle[1]), Vec3At(points, triangle[2])};
}

/// Whether triangles with the common edge uv and the third corners a and b overlap.
bool OverlapAtEdge(const Vec3& u, const Vec3& v, const Vec3& a, const Vec3& b) {
  if (SideOfPlane(u, v, a, b) != 0) return false;
  const int axis = AxisOf(u, v, a);
  const Point from = ShadowOf(u, axis), to = ShadowOf(v, axis);
  return Orientation(from, to, ShadowOf(a, axis)) == Orientation(from, to, ShadowOf(b, axis));
}

}  // namespace

bool AreCollinear(const Vec3& a, const Vec3& b, const Vec3& c) { return AxisOf(a, b, c) == 3; }

bool SegmentTouchesTriangle(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& abc) {
  const int p_side = SideOfPlane(abc[0], abc[1], abc[2], p);
  const int q_side = SideOfPlane(abc[0], abc[1], abc[2], q);
  if (p_side * q_side > 0) return false;
  if (p_side == 0 && q_side == 0) return TouchInPlane(p, q, abc);
  // The segment meets the plane in one point. This point is in the triangle unless the line pq
  // passes sides of the triangle both on the left and on the right.
  bool is_left = false, is_right = false;
  for (int k = 0; k < 3; ++k) {
    const int side = SideOfPlane(p, q, abc[k], abc[(k + 1) % 3]);
    is_left = is_left || side > 0;
    is_right = is_right || side < 0;
  }
  return !(is_left && is_right);
}

bool TrianglesCollide(std::span<const double> points, const Triangle& first,
                      const Triangle& second) {
  // Moves the corners that the triangles share to the front.
  Triangle a = first, b = second;
  int shared = 0;
  for (int k = 0; k < 3; ++k) {
    const auto same = std::find(b.begin() + shared, b.end(), a[k]);
    if (same == b.end()) continue;
    std::swap(a[k], a[shared]);
    std::iter_swap(same, b.begin() + shared);
    ++shared;
  }
  const std::array<Vec3, 3> p = CornersOf(points, a), q = CornersOf(points, b);
  switch (shared) {
    case 0:
      for (int k = 0; k < 3; ++k) {
        if (SegmentTouchesTriangle(p[k], p[(k + 1) % 3], q)) return true;
        if (SegmentTouchesTriangle(q[k], q[(k + 1) % 3], p)) return true;
      }
      return false;
    case 1:
      // If the triangles also meet elsewhere, a ray from the common corner through such a point
      // leaves one triangle first, through the side opposite to the corner. This side touches the
      // other triangle.
      return SegmentTouchesTriangle(p[1], p[2], q) || SegmentTouchesTriangle(q[1], q[2], p);
    case 2:
      return OverlapAtEdge(p[0], p[1], p[2], q[2]);
    default:
      return true;
  }
}

}  // namespace partiemc
