#include <cmath>

#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

RecordedFrame ReadCsv(const std::string& content, const SequenceOptions& options = {}) {
  const support::TemporaryFolder directory;
  return ReadOne(directory.Write("frame.csv", content), options);
}

absl::Status CsvRefusal(const std::string& content, const SequenceOptions& options = {}) {
  const support::TemporaryFolder directory;
  return ReadAll(directory.Write("frame.csv", content), options).status;
}

TEST(Csv, EveryDialectOfTheSameTableReadsTheSame) {
  for (const char* content : {
           "id,x,y,vx,vy\n7,1.5,-2,3,4\n9,2.5,1e1,5,6\n",
           "id;x;y;vx;vy\n7;1.5;-2;3;4\n9;2.5;1e1;5;6\n",
           "id\tx\ty\tvx\tvy\n7\t1.5\t-2\t3\t4\n9\t2.5\t1e1\t5\t6\n",
           "id x  y vx vy\n  7 1.5 -2 3 4\n9   2.5 1e1 5 6\n",
           "id, x, y, vx, vy\r\n7, 1.5, -2, 3, 4\r\n9, 2.5, 1e1, 5, 6\r\n",
           "\xEF\xBB\xBFid,x,y,vx,vy\n7,1.5,-2,3,4\n9,2.5,1e1,5,6",
           "# made by hand\n\nid,x,y,vx,vy\n7,1.5,-2,3,4\n# between\n9,2.5,1e1,5,6\n\n",
           "# id x y vx vy\n7 1.5 -2 3 4\n9 2.5 1e1 5 6\n",
           "% id,x,y,vx,vy\n7,1.5,-2,3,4\n9,2.5,1e1,5,6\n",
           "id,x,y,vx,vy,\n7,1.5,-2,3,4,\n9,2.5,1e1,5,6,\n",
           "\"Vel:0\",\"Vel:1\",\"Idp\",\"Points:0\",\"Points:1\"\n3,4,7,1.5,-2\n5,6,9,2.5,1e1\n",
           "Pos.x [m];Pos.y [m];Idp;Vel.x [m/s];Vel.y [m/s]\n1.5;-2;7;3;4\n2.5;1e1;9;5;6\n",
           "\"x, east\",id,x,y,vx,vy\n0,7,1.5,-2,3,4\n0,9,2.5,+10,5,6\n",
       }) {
    const RecordedFrame frame = ReadCsv(content);
    EXPECT_THAT(frame.positions, ElementsAre(1.5, -2, 2.5, 10)) << content;
    EXPECT_THAT(frame.velocities, ElementsAre(3, 4, 5, 6)) << content;
    EXPECT_THAT(frame.ids, ElementsAre(7, 9)) << content;
    EXPECT_FALSE(frame.float32);
  }
}

TEST(Csv, WithoutHeaderTwoColumnsAreXAndY) {
  EXPECT_THAT(ReadCsv("1,2\n3,4\n").positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadCsv("1 2 5\n3 4 5\n").positions, ElementsAre(1, 2, 3, 4));
}

TEST(Csv, WithoutHeaderMoreColumnsNeedAWord) {
  const std::string rows = "0 1 2 3 4 5\n1 6 7 8 9 5\n";
  ExpectRefused(CsvRefusal(rows), absl::StatusCode::kFailedPrecondition,
                {"frame.csv", "6 columns", "--columns"});
  EXPECT_THAT(ReadCsv(rows, {.columns = "2,3"}).positions, ElementsAre(1, 2, 6, 7));
  const RecordedFrame named = ReadCsv(rows, {.columns = "id,x,y,vx,vy"});
  EXPECT_THAT(named.positions, ElementsAre(1, 2, 6, 7));
  EXPECT_THAT(named.velocities, ElementsAre(3, 4, 8, 9));
  EXPECT_THAT(named.ids, ElementsAre(0, 1));
  EXPECT_THAT(ReadCsv(rows, {.columns = "-,-,-,y,x"}).positions, ElementsAre(4, 3, 9, 8));
}

TEST(Csv, OnlySelectedParticlesAreRead) {
  const std::string rows = "x,y,type,mk\n1,2,fluid,1\n3,4,wall,1\n5,6,fluid,2\n";
  EXPECT_THAT(ReadCsv(rows, {.select = {"type=fluid"}}).positions, ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(ReadCsv(rows, {.select = {"type=fluid", "mk=2.0"}}).positions, ElementsAre(5, 6));
}

TEST(Csv, AHeaderWithoutRowsIsAFrameWithoutParticles) {
  const RecordedFrame frame = ReadCsv("x,y\n");
  EXPECT_EQ(frame.ParticleCount(), 0u);
}

TEST(Csv, WhatIsNotFiniteIsPassedOnForTheCoreToJudge) {
  const RecordedFrame frame = ReadCsv("x,y\nnan,1\n2,-inf\n");
  EXPECT_TRUE(std::isnan(frame.positions[0]));
  EXPECT_TRUE(std::isinf(frame.positions[3]));
}

TEST(Csv, RepeatedIdsAreNoIds) {
  EXPECT_THAT(ReadCsv("x,y,gid\n1,2,4294967295\n3,4,4294967295\n").ids, IsEmpty());
  EXPECT_THAT(ReadCsv("x,y,id\n1,2,0.5\n3,4,1\n").ids, IsEmpty());
  const support::TemporaryFolder directory;
  directory.Write("a0.csv", "x,y,id\n1,2,7\n3,4,7\n");
  directory.Write("a1.csv", "x,y,id\n1,2,7\n3,4,7\n");
  const ReadSequence read = ReadAll(directory.Write("a2.csv", "x,y,id\n1,2,7\n3,4,7\n"));
  EXPECT_THAT(read.notices, ElementsAre(testing::HasSubstr("ids are ignored")));
}

TEST(Csv, VelocitiesAreTakenOnlyWhereAllAreFinite) {
  const support::TemporaryFolder directory;
  const ReadSequence read =
      ReadAll(directory.Write("a.csv", "x,y,vx,vy\n1,2,0.25,1\n3,4,nan,0\n5,6,1e99,0\n"));
  EXPECT_THAT(read.frames.at(0).velocities, IsEmpty());
  EXPECT_EQ(read.frames.at(0).ParticleCount(), 3u);
  EXPECT_THAT(read.notices, ElementsAre(testing::HasSubstr("velocities are ignored")));
}

TEST(Csv, VolumesAreTakenOnlyWhereAllArePositive) {
  EXPECT_THAT(ReadCsv("x,y,vol\n1,2,0.25\n3,4,0.5\n").volumes, ElementsAre(0.25f, 0.5f));
  const support::TemporaryFolder directory;
  const ReadSequence read = ReadAll(directory.Write("a.csv", "x,y,vol\n1,2,0.25\n3,4,0\n"));
  EXPECT_THAT(read.frames.at(0).volumes, IsEmpty());
  EXPECT_THAT(read.notices, ElementsAre(testing::HasSubstr("volumes are ignored")));
}

TEST(Csv, ABadRowIsNamedByFileAndLine) {
  ExpectRefused(CsvRefusal("x,y\n1,2\n3,four\n"), absl::StatusCode::kDataLoss,
                {"frame.csv:3", "'four' is not a number"});
  ExpectRefused(CsvRefusal("id,x,y\n1,2,3\n4,5\n"), absl::StatusCode::kDataLoss,
                {"frame.csv:3", "2 of 3 values"});
  ExpectRefused(CsvRefusal("x;y\n1,5;2,5\n"), absl::StatusCode::kDataLoss,
                {"'1,5' is not a number"});
}

TEST(Csv, DegenerateFilesAreRefusedInOneLine) {
  ExpectRefused(CsvRefusal(""), absl::StatusCode::kDataLoss, {"frame.csv", "empty"});
  ExpectRefused(CsvRefusal("# only a comment\n"), absl::StatusCode::kDataLoss, {"empty"});
  ExpectRefused(CsvRefusal("t,energy\n0,1\n"), absl::StatusCode::kFailedPrecondition,
                {"no position columns", "t,energy"});
  ExpectRefused(CsvRefusal("x,y\n" + std::string(2 << 20, '1') + "\n"), absl::StatusCode::kDataLoss,
                {"frame.csv:2", "1 MiB"});
}

TEST(Csv, AttributesAreColumnsOfTheirNamesOrArrays) {
  const RecordedFrame frame =
      ReadCsv("x,y,p,T:0,T:1,Vel_x,Vel_y\n1,2,.5,3,4,7,8\n3,4,1.5,5,6,9,10\n",
              {.attributes = {"T", "p", "velocity"}});
  ASSERT_EQ(frame.attributes.size(), 2);  // Velocities are not attributes.
  EXPECT_EQ(frame.attributes[0], (ParticleAttribute{"T", 2, {3, 4, 5, 6}}));
  EXPECT_EQ(frame.attributes[1], (ParticleAttribute{"p", 1, {.5, 1.5}}));
  EXPECT_THAT(frame.velocities, ElementsAre(7, 8, 9, 10));
  EXPECT_THAT(ReadCsv("x,y,p\n1,2,.5\n").attributes, IsEmpty());
}

TEST(Csv, ItsSelectionHoldsForAttributesToo) {
  const RecordedFrame frame =
      ReadCsv("type,x,y,p\n1,1,2,.5\n2,3,4,1.5\n", {.select = {"type=2"}, .attributes = {"p"}});
  EXPECT_THAT(frame.attributes[0].values, ElementsAre(1.5));
}

TEST(Csv, AMissingAttributeIsToldWithTheColumnsThereAre) {
  ExpectRefused(CsvRefusal("x,y,p\n1,2,3\n", {.attributes = {"density"}}),
                absl::StatusCode::kFailedPrecondition,
                {"frame.csv", "no column 'density'", "x,y,p"});
  ExpectRefused(CsvRefusal("x,y,p\n1,2,3\n", {.attributes = {"velocity"}}),
                absl::StatusCode::kFailedPrecondition, {"'velocity'"});
  ExpectRefused(CsvRefusal("x,y,p\n1,2,high\n", {.attributes = {"p"}}), absl::StatusCode::kDataLoss,
                {"'high' is not a number"});
}

TEST(Csv, AnEmptyLastCellIsACell) {
  EXPECT_THAT(ReadCsv("x,y,note\n1,2,\n3,4,wet\n").positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(ReadCsv("made by hand\nx,y,note\n1,2,\n").positions, ElementsAre(1, 2));
  EXPECT_THAT(ReadCsv("x,y,note,\n1,2,,\n3,4,,\n").positions, ElementsAre(1, 2, 3, 4));
  ExpectRefused(CsvRefusal("x,p,y\n0.1,0,\n"), absl::StatusCode::kDataLoss, {"frame.csv:2", "''"});
  ExpectRefused(CsvRefusal("x,y,note\n1,2\n"), absl::StatusCode::kDataLoss, {"2 of 3 values"});
}

TEST(Csv, LinesBeforeTheHeaderAreSkipped) {
  const std::string rows = "1,2,3\n4,5,6\n";
  for (const std::string preamble : {"[Name]\nPoints\n\n[Data]\n", "time,0.5\n",
                                     "Case: dam, dt: 1e-3\n\n", "587\n", "a title\n1 2 3 4\n"}) {
    const RecordedFrame frame = ReadCsv(preamble + "X [ m ], Y [ m ], id\n" + rows);
    EXPECT_THAT(frame.positions, ElementsAre(1, 2, 4, 5)) << preamble;
    EXPECT_THAT(frame.ids, ElementsAre(3, 6)) << preamble;
  }
  EXPECT_THAT(ReadCsv("a title\n\nright;up;id\n1;2;3\n", {.columns = "right,up"}).positions,
              ElementsAre(1, 2));
}

TEST(Csv, OnlyAHeaderWithRowsEndsAPreamble) {
  const support::TemporaryFolder directory;
  const auto refusal = [&](const std::string& content) {
    return ReadAll(directory.Write("a.csv", content)).status;
  };
  // A damaged row is no preamble, and a table without a header has none.
  ExpectRefused(refusal("a,b,c\n1,2\n3,4\n"), absl::StatusCode::kFailedPrecondition,
                {"no position columns"});
  ExpectRefused(refusal("a title\nx,y\n1,2,3\n"), absl::StatusCode::kFailedPrecondition,
                {"no position columns"});
  ExpectRefused(refusal("a title\nx,y\n1,2\n3\n"), absl::StatusCode::kDataLoss, {"a.csv:4"});
}

}  // namespace
}  // namespace partiemc::client
