#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

// In the format of old SPHinXsys: "Format" with a capital letter, no header_type.
std::string Vtp(const std::string& count, const std::string& positions,
                const std::string& arrays = "") {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
         "byte_order=\"LittleEndian\">\n <PolyData>\n  <Piece Name =\"WaterBlock\" "
         "NumberOfPoints=\"" +
         count +
         "\" NumberOfVerts=\"0\">\n   <Points>\n    <DataArray Name=\"Position\" type=\"Float32\"  "
         "NumberOfComponents=\"3\" Format=\"ascii\">\n    " +
         positions + "\n    </DataArray>\n   </Points>\n   <PointData  Vectors=\"vector\">\n" +
         arrays + "   </PointData>\n  </Piece>\n </PolyData>\n</VTKFile>\n";
}

#ifdef PARTIEMC_HAVE_VTK

using testing::ElementsAre;

std::string Array(const std::string& name, const std::string& type, const std::string& components,
                  const std::string& values) {
  return "<DataArray Name=\"" + name + "\" type=\"" + type + "\" NumberOfComponents=\"" +
         components + "\" Format=\"ascii\">" + values + "</DataArray>\n";
}

TEST(Vtk, AFileOfOldSphinxsysIsRead) {
  const support::TemporaryFolder directory;
  const RecordedFrame frame =
      ReadOne(directory.Write("WaterBlock_0000000000.vtp",
                              Vtp("2", "1 2 0 3 4.5 0",
                                  Array("OriginalID", "Int32", "1", "5 3") +
                                      Array("Velocity", "Float32", "3", "1 2 0 3 4 0") +
                                      Array("VolumetricMeasure", "Float32", "1", "0.25 0.5"))));
  EXPECT_THAT(frame.positions, ElementsAre(1, 2, 3, 4.5));
  EXPECT_THAT(frame.velocities, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(frame.ids, ElementsAre(5, 3));
  EXPECT_THAT(frame.volumes, ElementsAre(0.25f, 0.5f));
  EXPECT_TRUE(frame.float32);
}

TEST(Vtk, PointsAreSelectedByTheirArrays) {
  const support::TemporaryFolder directory;
  const std::string path =
      directory.Write("a.vtp", Vtp("2", "1 2 0 3 4 0", Array("Type", "Int32", "1", "1 2")));
  EXPECT_THAT(ReadOne(path, {.select = {"Type=2"}}).positions, ElementsAre(3, 4));
  ExpectRefused(ReadAll(path, {.select = {"mk=2"}}).status, absl::StatusCode::kFailedPrecondition,
                {"a.vtp", "'mk'", "Type"});
  ExpectRefused(ReadAll(path, {.columns = "x,y"}).status, absl::StatusCode::kInvalidArgument,
                {"--columns", "VTK"});
}

TEST(Vtk, AnArrayMayHaveTheNameOfAnotherKindOfFile) {
  const support::TemporaryFolder directory;
  const RecordedFrame frame = ReadOne(directory.Write(
      "a.vtp", Vtp("2", "1 2 0 3 4 0", Array("UnstructuredGrid", "Int32", "1", "1 2"))));
  EXPECT_THAT(frame.positions, ElementsAre(1, 2, 3, 4));
}

TEST(Vtk, AFileWithoutPointsIsAFrameWithoutParticles) {
  const support::TemporaryFolder directory;
  const std::string path = directory.Write("a.vtp", Vtp("0", ""));
  EXPECT_EQ(ReadOne(path).ParticleCount(), 0u);
  EXPECT_EQ(ReadOne(path, {.select = {"type=1"}}).ParticleCount(), 0u);
}

TEST(Vtk, LegacyFilesTellTheirTime) {
  const support::TemporaryFolder directory;
  const RecordedFrame frame = ReadOne(
      directory.Write("a.vtk",
                      "# vtk DataFile Version 4.2\nx\nASCII\nDATASET POLYDATA\nFIELD FieldData 1\n"
                      "TimeValue 1 1 double\n0.25\nPOINTS 2 double\n1 0 2\n3 0 4\n"));
  EXPECT_THAT(frame.positions, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(frame.time, 0.25);
  EXPECT_FALSE(frame.float32);
}

constexpr char kLegacy[] = "# vtk DataFile Version 4.2\nx\nASCII\nDATASET ";
constexpr char kTwoPoints[] = "POINTS 2 double\n1 2 0\n3 4 0\n";
constexpr char kMasses[] = "POINT_DATA 2\nSCALARS mass double 1\nLOOKUP_TABLE default\n5 6\n";

TEST(Vtk, CellsArePassedOver) {
  const support::TemporaryFolder directory;
  const std::string cell_data = "CELL_DATA 2\nSCALARS mass double 1\nLOOKUP_TABLE default\n7 8\n";
  const std::string before = std::string(kLegacy) + "UNSTRUCTURED_GRID\n" + kTwoPoints;
  for (const std::string& cells : {
           std::string("CELLS 2 4\n1 0\n1 1\nCELL_TYPES 2\n1\n1\n"),
           // Indices of missing points, and counts beyond the end of the cells.
           std::string("CELLS 2 4\n9 900000000\n-7 1\nCELL_TYPES 2\n1\n99\n"),
           std::string("CELLS 1 2\n5 0\nCELL_TYPES 1\n1\n"),
       }) {
    for (const std::string& data : {std::string(), cell_data}) {
      const RecordedFrame frame = ReadOne(directory.Write("a.vtk", before + cells + data + kMasses),
                                          {.select = {"mass=6"}});
      EXPECT_THAT(frame.positions, ElementsAre(3, 4)) << cells << data;
    }
  }
}

TEST(Vtk, CellsThatTheFileCannotHoldAreRefused) {
  const support::TemporaryFolder directory;
  for (const char* cells :
       {"CELLS 2 4000000000000\n", "CELLS -1 2\n", "CELLS 2\n", "CELLS 2 4\n1 0",
        "VERTICES 1 9999999\n1 0\n", "CELL_TYPES 70000000000\n1\n"}) {
    ExpectRefused(ReadAll(directory.Write("a.vtk", std::string(kLegacy) + "UNSTRUCTURED_GRID\n" +
                                                       kTwoPoints + cells))
                      .status,
                  absl::StatusCode::kDataLoss, {"a.vtk", "VTK cannot read it"});
  }
}

TEST(Vtk, DeclaredCountsAreNotBelieved) {
  const support::TemporaryFolder directory;
  for (const char* count : {"60000000", "999999999999"}) {
    ExpectRefused(ReadAll(directory.Write("a.vtp", Vtp(count, "1 2 0"))).status,
                  absl::StatusCode::kDataLoss, {"a.vtp", count, "points"});
    ExpectRefused(
        ReadAll(directory.Write("a.vtk", std::string("# vtk DataFile Version 4.2\nx\nASCII\n"
                                                     "DATASET POLYDATA\nPOINTS ") +
                                             count + " float\n1 2 0\n"))
            .status,
        absl::StatusCode::kDataLoss, {"a.vtk", count, "points"});
  }
}

TEST(Vtk, WhatVtkSaysBecomesOurErrorAndIsNotPrinted) {
  const support::TemporaryFolder directory;
  const std::string whole = Vtp("2", "1 2 0 3 4 0");
  testing::internal::CaptureStderr();
  const absl::Status cut = ReadAll(directory.Write("a.vtp", whole.substr(0, 330))).status;
  const absl::Status legacy =
      ReadAll(directory.Write("a.vtk",
                              "# vtk DataFile Version 4.2\nx\nASCII\nDATASET POLYDATA\n"
                              "POINTS 2 float\n1 2 0 3\n"))
          .status;
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ExpectRefused(cut, absl::StatusCode::kDataLoss, {"a.vtp", "VTK cannot read it"});
  ExpectRefused(legacy, absl::StatusCode::kDataLoss, {"a.vtk", "VTK cannot read it"});
}

TEST(Vtk, AGridHoldsNoParticles) {
  const support::TemporaryFolder directory;
  ExpectRefused(ReadAll(directory.Write("a.vtk",
                                        "# vtk DataFile Version 4.2\nx\nASCII\nDATASET "
                                        "STRUCTURED_POINTS\nDIMENSIONS 2 2 1\nORIGIN 0 0 "
                                        "0\nSPACING 1 1 1\n"))
                    .status,
                absl::StatusCode::kFailedPrecondition, {"no particles", "POLYDATA"});
}

#else

TEST(Vtk, ABuildWithoutVtkSaysHowToGetIt) {
  const support::TemporaryFolder directory;
  ExpectRefused(ReadAll(directory.Write("a.vtp", Vtp("1", "1 2 0"))).status,
                absl::StatusCode::kUnimplemented, {"a.vtp", "libvtk9-dev", "-DPARTIEMC_VTK=ON"});
}

#endif

}  // namespace
}  // namespace partiemc::client
