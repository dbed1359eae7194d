#include "client/input/plane.h"

#include <cmath>
#include <limits>

#include "client/input/fixtures.h"

namespace partiemc::client::input {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Point3 = std::array<double, 3>;

ParticleRows Rows(const std::vector<Point3>& points) {
  ParticleRows rows;
  rows.source = "frame.csv";
  rows.count = points.size();
  rows.has_position = {true, true, true};
  rows.has_velocity = {true, true, true};
  for (const Point3& point : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rows.positions[axis].push_back(point[axis]);
      rows.velocities[axis].push_back(static_cast<float>(10 + axis));
    }
  }
  return rows;
}

struct Projected {
  absl::Status status;
  RecordedFrame frame;
  std::vector<std::string> notices;
};

Projected Project(const std::vector<Point3>& points) {
  Projected projected;
  PlaneProjection projection;
  projected.status = projection.Project(Rows(points), projected.frame, projected.notices);
  return projected;
}

TEST(Plane, TheConstantAxisIsDroppedAndItsVelocityWithIt) {
  const Projected xy = Project({{1, 2, 7}, {3, 4, 7}});
  EXPECT_THAT(xy.frame.positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(xy.frame.velocities, ElementsAre(10, 11, 10, 11));
  EXPECT_THAT(xy.notices, IsEmpty());
  const Projected xz = Project({{1, 0, 2}, {3, 0, 4}});
  EXPECT_THAT(xz.frame.positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(xz.frame.velocities, ElementsAre(10, 12, 10, 12));
  EXPECT_THAT(xz.notices, ElementsAre(HasSubstr("x-z plane (y = 0)")));
  const Projected yz = Project({{5, 1, 2}, {5, 3, 4}});
  EXPECT_THAT(yz.frame.positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(yz.notices, ElementsAre(HasSubstr("y-z plane (x = 5)")));
}

TEST(Plane, ThreeDimensionsAreRefusedWithTheirExtents) {
  ExpectRefused(Project({{0, 0, 0}, {4, 2, 1}}).status, absl::StatusCode::kFailedPrecondition,
                {"frame.csv: is 3D", "4 x 2 x 1", "--slice z=0"});
}

TEST(Plane, FlatMeansAMillionthOfTheExtent) {
  EXPECT_TRUE(Project({{0, 0, 1}, {1000, 5, 1.0009}}).status.ok());
  EXPECT_FALSE(Project({{0, 0, 1}, {1000, 5, 1.0011}}).status.ok());
}

TEST(Plane, OfSeveralConstantAxesTheLastIsDropped) {
  EXPECT_THAT(Project({{1, 2, 3}}).frame.positions, ElementsAre(1, 2));
  EXPECT_THAT(Project({{1, 0, 0}, {2, 0, 0}}).frame.positions, ElementsAre(1, 0, 2, 0));
  EXPECT_THAT(Project({{0, 0, 1}, {0, 0, 2}}).frame.positions, ElementsAre(0, 1, 0, 2));
}

TEST(Plane, TheFirstFrameWithParticlesDecidesForTheOthers) {
  PlaneProjection projection;
  RecordedFrame frame;
  std::vector<std::string> notices;
  ASSERT_TRUE(projection.Project(Rows({}), frame, notices).ok());
  EXPECT_THAT(frame.positions, IsEmpty());
  ASSERT_TRUE(projection.Project(Rows({{1, 0, 2}, {3, 0, 4}}), frame, notices).ok());
  ASSERT_TRUE(projection.Project(Rows({{1, 0, 9}, {1, 0, 9}}), frame, notices).ok());
  EXPECT_THAT(frame.positions, ElementsAre(1, 9, 1, 9));
  ExpectRefused(projection.Project(Rows({{1, 0, 2}, {3, 0.5, 4}}), frame, notices),
                absl::StatusCode::kFailedPrecondition,
                {"frame.csv", "leaves the plane", "y was 0", "0 to 0.5"});
  EXPECT_EQ(notices.size(), 1u);
}

TEST(Plane, AParticleThatIsSpoiledOffThePlaneStaysSpoiled) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Projected projected = Project({{1, 2, 0}, {3, 4, nan}, {5, 6, 0}});
  ASSERT_TRUE(projected.status.ok()) << projected.status;
  EXPECT_TRUE(std::isnan(projected.frame.positions[2]));
  EXPECT_EQ(projected.frame.positions[4], 5);
}

TEST(Plane, TwoComponentsNeedNoDecision) {
  ParticleRows rows = Rows({{1, 0, 2}, {3, 0, 4}});
  rows.has_position[1] = false;
  rows.positions[1].clear();
  PlaneProjection projection;
  RecordedFrame frame;
  std::vector<std::string> notices;
  ASSERT_TRUE(projection.Project(rows, frame, notices).ok());
  EXPECT_THAT(frame.positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(frame.velocities, ElementsAre(10, 12, 10, 12));
}

TEST(Plane, InSpaceAllAxesStay) {
  ParticleRows rows = Rows({{1, 2, 50}, {3, 4, -60}});
  PlaneProjection projection(true);
  RecordedFrame frame;
  std::vector<std::string> notices;
  ASSERT_TRUE(projection.Project(rows, frame, notices).ok());
  EXPECT_EQ(frame.components, 3);
  EXPECT_EQ(frame.ParticleCount(), 2u);
  EXPECT_THAT(frame.positions, ElementsAre(1, 2, 50, 3, 4, -60));
  EXPECT_EQ(frame.velocities.size(), rows.has_velocity[2] ? 6u : 0u);
  rows.has_position[2] = false;
  const absl::Status flat = projection.Project(rows, frame, notices);
  EXPECT_EQ(flat.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(flat.message(),
            "frame.csv: has two coordinates; must have x, y and z for a slice or a surface");
}

}  // namespace
}  // namespace partiemc::client::input
