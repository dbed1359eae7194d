#include "client/input/base/columns.h"

#include <numbers>

#include "client/input/fixtures.h"

namespace partiemc::client::input {
namespace {

using Names = std::vector<std::string>;

ColumnPlan Plan(const Names& names, const std::string& columns = "") {
  auto request = ParseColumnRequest({}, columns);
  EXPECT_TRUE(request.ok()) << request.status();
  request->is_lammps_dump = true;
  const auto plan = PlanNamedColumns(names, *request);
  EXPECT_TRUE(plan.ok()) << plan.status();
  return plan.value_or(ColumnPlan());
}

TEST(Columns, PositionsAreFoundUnderEveryUsualName) {
  for (const Names& names :
       {Names{"x", "y"}, Names{"X", "Y"}, Names{"Pos.x [m]", "Pos.y [m]"}, Names{"pos_x", "pos_y"},
        Names{"Points:0", "Points:1"}, Names{"Points_0", "Points_1"},
        Names{"Position X", "Position Y"}, Names{"xu", "yu"}, Names{"xs", "ys"},
        Names{"coords:0", "coords:1"}, Names{"x (m)", "y (m)"}}) {
    const ColumnPlan plan = Plan(names);
    EXPECT_EQ(plan.positions[0], 0u) << names[0];
    EXPECT_EQ(plan.positions[1], 1u) << names[1];
    EXPECT_FALSE(plan.positions[2].has_value());
  }
}

TEST(Columns, WrappedPositionsArePreferredToUnwrappedAndTheseToScaled) {
  EXPECT_EQ(Plan({"xs", "ys", "xu", "yu", "x", "y"}).positions[0], 4u);
  EXPECT_EQ(Plan({"xs", "ys", "xu", "yu"}).positions[0], 2u);
  EXPECT_TRUE(Plan({"id", "xs", "ys"}).scaled);
  EXPECT_FALSE(Plan({"xs", "ys", "xu", "yu"}).scaled);
}

TEST(Columns, FractionsOfABoxAreRefusedOutsideOfDumps) {
  for (const Names& names : {Names{"id", "xs", "ys"}, Names{"xsu", "ysu"}}) {
    ExpectRefused(PlanNamedColumns(names, {}).status(), absl::StatusCode::kFailedPrecondition,
                  {"LAMMPS", "--columns"});
  }
  const auto plan = PlanNamedColumns({"id", "xs", "ys"}, *ParseColumnRequest({}, "xs,ys"));
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->positions[0], 1u);
  EXPECT_FALSE(plan->scaled);
}

TEST(Columns, WhatTheCallerNamesGoesBeforeWhatIsRecognised) {
  const ColumnPlan by_name = Plan({"xs", "ys", "xu", "yu", "x", "y"}, "xs,ys");
  EXPECT_EQ(by_name.positions[0], 0u);
  EXPECT_TRUE(by_name.scaled);
  EXPECT_EQ(Plan({"a", "b", "c"}, "3,1").positions[0], 2u);
  EXPECT_EQ(Plan({"a", "b", "c"}, "3,1").positions[1], 0u);
}

TEST(Columns, NamedPositionsKeepTheirAxesSoThatVelocitiesFit) {
  const ColumnPlan plan =
      Plan({"Points:0", "Points:1", "Points:2", "Vel:0", "Vel:1", "Vel:2"}, "Points:0,Points:2");
  EXPECT_EQ(plan.positions[0], 0u);
  EXPECT_FALSE(plan.positions[1].has_value());
  EXPECT_EQ(plan.positions[2], 2u);
  EXPECT_EQ(plan.velocities[2], 5u);
}

TEST(Columns, NamedPositionsOfUnknownAxesTakeNoVelocities) {
  const ColumnPlan plan = Plan({"p", "q", "vx", "vy"}, "q,p");
  EXPECT_EQ(plan.positions[0], 1u);
  EXPECT_FALSE(plan.velocities[0].has_value());
}

TEST(Columns, NumberDensitiesAreNoVolumes) {
  // PySPH's V is the reciprocal of the volume.
  EXPECT_FALSE(Plan({"x", "y", "V"}).volume.has_value());
  EXPECT_EQ(Plan({"x", "y", "Volume"}).volume, 2u);
  EXPECT_EQ(Plan({"x", "y", "area [m2]"}).volume, 2u);
}

TEST(Columns, SizesComeFromVolumesElseDiametersElseRadii) {
  const auto plan = [](const std::vector<std::string>& names, bool needs_sizes = true) {
    ColumnRequest request;
    request.needs_sizes = needs_sizes;
    return *PlanNamedColumns(names, request);
  };
  EXPECT_FALSE(plan({"x", "y", "radius"}, false).volume.has_value());
  EXPECT_EQ(plan({"x", "y", "radius"}).VolumeOf(3), 36);
  EXPECT_EQ(plan({"x", "y", "radius", "Diameter"}).volume, 3u);
  EXPECT_EQ(plan({"x", "y", "radius", "diameter"}).VolumeOf(3), 9);
  EXPECT_EQ(plan({"x", "y", "radius", "volume"}).volume, 3u);
  EXPECT_EQ(plan({"x", "y", "radius", "volume"}).VolumeOf(3), 3);
  EXPECT_LT(plan({"x", "y", "radius"}).VolumeOf(-3), 0);
  ColumnRequest request{.needs_sizes = true, .in_space = true};
  EXPECT_EQ(PlanNamedColumns({"x", "y", "z", "radius"}, request)->VolumeOf(3), 216);
  EXPECT_EQ(PlanNamedColumns({"x", "y", "z", "volume"}, request)->VolumeOf(3), 3);
}

TEST(Columns, DiametersOfGrainsComeFromDiametersElseRadiiElseAreas) {
  const auto plan = [](const std::vector<std::string>& names) {
    ColumnRequest request;
    request.needs_diameters = true;
    return *PlanNamedColumns(names, request);
  };
  EXPECT_EQ(plan({"x", "y", "volume", "radius", "diameter"}).VolumeOf(3), 9);
  EXPECT_EQ(plan({"x", "y", "volume", "radius"}).volume, 3u);
  EXPECT_EQ(plan({"x", "y", "volume", "radius"}).VolumeOf(3), 36);
  EXPECT_DOUBLE_EQ(plan({"x", "y", "volume"}).VolumeOf(std::numbers::pi), 4);
  EXPECT_FALSE(plan({"x", "y"}).volume.has_value());
}

TEST(Columns, WhatIsMissingIsNamedWithWhatIsThere) {
  ExpectRefused(PlanNamedColumns({"rho", "p"}, {}).status(), absl::StatusCode::kFailedPrecondition,
                {"rho,p", "--columns"});
  const auto request = ParseColumnRequest({"type=1"}, "");
  ExpectRefused(PlanNamedColumns({"x", "y"}, *request).status(),
                absl::StatusCode::kFailedPrecondition, {"'type'", "x,y"});
  ExpectRefused(PlanUnnamedColumns(6, {}).status(), absl::StatusCode::kFailedPrecondition,
                {"6 columns", "--columns"});
}

TEST(Columns, OptionsThatAreNoneAreRefused) {
  for (const char* select : {"type", "=1", "type=", ""}) {
    ExpectRefused(ParseColumnRequest({select}, "").status(), absl::StatusCode::kInvalidArgument,
                  {"--select", "COLUMN=VALUE"});
  }
  for (const char* columns : {"x,", ",", "x,,y"}) {
    ExpectRefused(ParseColumnRequest({}, columns).status(), absl::StatusCode::kInvalidArgument,
                  {"--columns"});
  }
}

TEST(Columns, AConditionComparesNumbersAsNumbersAndTextAsText) {
  const auto request = ParseColumnRequest({"type=1", "element=Si"}, "");
  EXPECT_TRUE(request->conditions[0].Holds(std::string_view("1.0")));
  EXPECT_FALSE(request->conditions[0].Holds(std::string_view("10")));
  EXPECT_TRUE(request->conditions[1].Holds(std::string_view("Si")));
  EXPECT_FALSE(request->conditions[1].Holds(std::string_view("si")));
}

}  // namespace
}  // namespace partiemc::client::input
