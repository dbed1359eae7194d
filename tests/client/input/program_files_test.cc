// BGEO, GSD, pickles and collections that are damaged or lie. formats_of_programs.py reads good
// files of the programs' own libraries.
#include <cstring>

#include "client/input/base/pickle.h"
#include "client/input/collection.h"
#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

using input::Pickle;
using input::PickleValue;
using testing::ElementsAre;

std::string Number(std::uint64_t value, int size, bool big_endian) {
  std::string bytes;
  for (int k = 0; k < size; ++k) {
    bytes.push_back(static_cast<char>(value >> (8 * (big_endian ? size - 1 - k : k))));
  }
  return bytes;
}

std::string Big(std::uint64_t value, int size = 4) { return Number(value, size, true); }
std::string Little(std::uint64_t value, int size) { return Number(value, size, false); }

std::string BigFloat(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return Big(bits);
}

// Two points with a text index and a velocity of two components.
std::string Bgeo(std::uint64_t points = 2) {
  std::string file =
      "BgeoV" + Big(5) + Big(points) + Big(0) + Big(0) + Big(0) + Big(2) + std::string(12, '\0');
  file += Big(4, 2) + "kind" + Big(1, 2) + Big(4) + Big(2) + Big(4, 2) + "sand" + Big(3, 2) + "mud";
  file += Big(1, 2) + "v" + Big(2, 2) + Big(0) + std::string(8, '\0');
  for (const float x : {1.0F, 3.0F}) {
    file += BigFloat(x) + BigFloat(x + 1) + BigFloat(0) + BigFloat(1) + Big(x > 2) + BigFloat(-x) +
            BigFloat(x / 2);
  }
  return file;
}

TEST(Bgeo, PointsAndAttributesAreRead) {
  const support::TemporaryFolder directory;
  const std::string path = directory.Write("a.bgeo", Bgeo());
  const RecordedFrame frame = ReadOne(path);
  EXPECT_THAT(frame.positions, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(frame.velocities, ElementsAre(-1, 0.5, -3, 1.5));
  EXPECT_THAT(ReadOne(path, {.select = {"kind=1"}}).positions, ElementsAre(3, 4));
}

TEST(Bgeo, TruncatedFilesAndDeclaredCountsAreRefused) {
  const support::TemporaryFolder directory;
  const std::string whole = Bgeo();
  for (std::size_t size = 5; size < whole.size(); ++size) {
    ExpectRefused(ReadAll(directory.Write("a.bgeo", whole.substr(0, size))).status,
                  absl::StatusCode::kDataLoss, {"a.bgeo", "truncated"});
  }
  ExpectRefused(ReadAll(directory.Write("a.bgeo", Bgeo(60000000))).status,
                absl::StatusCode::kDataLoss, {"after 2 of 60000000 points"});
  ExpectRefused(ReadAll(directory.Write("a.bgeo", Bgeo(0xFFFFFFFF))).status,
                absl::StatusCode::kDataLoss, {"at most 67108864"});
}

// A GSD file with one name and index entries of 32 bytes.
std::string Gsd(const std::string& name, const std::vector<std::string>& entries,
                std::uint64_t declared_entries) {
  const std::string magic = "\xDF\x65\xDF\x65\xDF\x65\xDF\x65";
  std::string list = name;
  list.resize(64, '\0');
  std::string file = magic + Little(320, 8) + Little(declared_entries, 8) + Little(256, 8) +
                     Little(1, 8) + Little(0x10004, 4) + Little(0x20000, 4);
  file.resize(256, '\0');
  file += list;
  for (const std::string& entry : entries) file += entry;
  return file;
}

std::string GsdEntry(std::uint64_t frame, std::uint64_t rows, std::uint64_t location,
                     std::uint64_t columns, std::uint64_t id, std::uint64_t type) {
  return Little(frame, 8) + Little(rows, 8) + Little(location, 8) + Little(columns, 4) +
         Little(id, 2) + Little(type, 1) + Little(0, 1);
}

TEST(Gsd, EntriesThatLeaveTheFileAreRefused) {
  const support::TemporaryFolder directory;
  const auto refusal = [&](const std::string& content) {
    return ReadAll(directory.Write("a.gsd", content)).status;
  };
  const auto code = absl::StatusCode::kDataLoss;
  ExpectRefused(refusal(Gsd("particles/N", {}, 0)), code, {"a.gsd", "holds no frame"});
  ExpectRefused(refusal(Gsd("particles/N", {}, std::uint64_t{1} << 60)), code, {"index"});
  for (const std::string& entry : {GsdEntry(9, 1, 256, 1, 0, 3), GsdEntry(0, 1, 256, 1, 7, 3),
                                   GsdEntry(0, 1, 256, 1, 0, 0), GsdEntry(0, 1, 256, 1, 0, 12)}) {
    ExpectRefused(refusal(Gsd("particles/N", {entry}, 1)), code, {"entry 0", "broken"});
  }
  const std::uint64_t huge = std::uint64_t{1} << 61;
  for (const std::string& entry : {GsdEntry(0, huge, 256, 8, 0, 10), GsdEntry(0, 1, huge, 1, 0, 3),
                                   GsdEntry(0, 0xFFFFFFFFFFFFFFFF, 256, 0xFFFFFFFF, 0, 10)}) {
    ExpectRefused(refusal(Gsd("particles/N", {entry}, 1)), code, {"frame 0", "out of the file"});
  }
  ExpectRefused(refusal(Gsd("particles/x", {GsdEntry(0, 1, 256, 1, 0, 1)}, 1)),
                absl::StatusCode::kFailedPrecondition, {"particles/N"});
}

// Frame 1 has positions of two particles, but declares one, as frame 0.
TEST(Gsd, BrokenArraysAreNotTakenFromTheFirstFrame) {
  const support::TemporaryFolder directory;
  std::string names = std::string("particles/N") + '\0' + "particles/position" + '\0';
  const auto file = [&](std::uint64_t rows) {
    std::string content = Gsd(names,
                              {GsdEntry(0, 1, 448, 1, 0, 3), GsdEntry(0, 1, 452, 3, 1, 9),
                               GsdEntry(1, 1, 448, 1, 0, 3), GsdEntry(1, rows, 452, 3, 1, 9)},
                              4);
    EXPECT_EQ(content.size(), 448u);
    content += Little(1, 4);
    for (int k = 0; k < 6; ++k) content += Little(0x3f800000, 4);
    return directory.Write("a.gsd", content);
  };
  const ReadSequence good = ReadAll(file(1));
  EXPECT_EQ(good.frames.size(), 2u) << good.status;
  const ReadSequence broken = ReadAll(file(2));
  EXPECT_EQ(broken.frames.size(), 1u);
  ExpectRefused(broken.status, absl::StatusCode::kFailedPrecondition, {"frame 1", "position"});
}

absl::StatusOr<std::unique_ptr<Pickle>> Parse(const std::string& bytes) {
  return Pickle::Parse({bytes.begin(), bytes.end()}, "a.npz");
}

TEST(Pickle, ContainersAndNumbersAreRead) {
  using namespace std::string_literals;
  // {"t": 0.5, "n": -2, "again": the value of "n"}
  const auto pickle = Parse(
      "\x80\x03}q\0(X\x01\0\0\0tG\x3f\xe0\0\0\0\0\0\0X\x01\0\0\0nJ\xfe\xff\xff\xffq\x01"
      "X\x05\0\0\0againh\x01u."s);
  ASSERT_TRUE(pickle.ok()) << pickle.status();
  const PickleValue& root = (*pickle)->root();
  ASSERT_EQ(root.kind, PickleValue::Kind::kDict);
  EXPECT_EQ(root.Find("t")->number, 0.5);
  EXPECT_EQ(root.Find("n")->number, -2);
  EXPECT_EQ(root.Find("again"), root.Find("n"));
  EXPECT_EQ(root.Find("other"), nullptr);
}

TEST(Pickle, FunctionsAreNotCalled) {
  const auto pickle = Parse("cos\nsystem\n(X\x04" + std::string("\0\0\0true", 7) + "tR.");
  ASSERT_TRUE(pickle.ok()) << pickle.status();
  EXPECT_EQ((*pickle)->root().kind, PickleValue::Kind::kOther);
}

TEST(Pickle, BrokenOnesAreRefused) {
  using namespace std::string_literals;
  for (const std::string& bytes :
       {""s, "}"s, "."s, "t."s, "}}."s, "(."s, "a."s, "s."s, "R."s, "b."s, "h\x01."s, "q\x01."s,
        "X\xff\xff\xff\xff."s, "(}d."s, "\x8e\xff\xff\xff\xff\xff\xff\xff\x7f."s}) {
    const auto status = Parse(bytes).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  }
  ExpectRefused(Parse("I1\n.").status(), absl::StatusCode::kUnimplemented, {"operation 73"});
  ExpectRefused(Parse(std::string(std::size_t{3} << 20, '}')).status(), absl::StatusCode::kDataLoss,
                {"a million values"});
}

// Small pickles that name the same values again and again.
TEST(Pickle, MemoryIsBoundedByTheFile) {
  using namespace std::string_literals;
  std::string doubling = "X\x01\0\0\0A\x94"s;
  for (char k = 0; k < 40; ++k) doubling += "h"s + k + "h"s + k + "\x93\x94"s;
  std::string copies = "X\0\0\x10\0"s + std::string(1 << 20, 'a') +
                       "\x94\x85\x94"
                       "c_codecs\nencode\n\x94"s;
  for (int k = 0; k < 1000; ++k) copies += "h\x02h\x01R0"s;
  std::string extents = "(cnumpy.core.multiarray\n_reconstruct\n)R\x94("s;
  for (int k = 0; k < 1000; ++k) extents += "K\x01";
  extents += "t\x94"s;
  for (int k = 0; k < 1000; ++k) extents += "h\x00(Nh\x01NNNtb0"s;
  for (const std::string& bytes : {doubling, copies, extents}) {
    EXPECT_EQ(Parse(bytes).status().code(), absl::StatusCode::kDataLoss);
  }
}

TEST(Collection, FilesAreOrderedByTimeAndRelativeToTheCollection) {
  const support::TemporaryFolder directory;
  directory.Write("b.csv", "x,y\n1,2\n");
  directory.Write("a & c.csv", "x,y\n3,4\n");
  for (const std::string& path :
       {directory.Write("all.pvd",
                        "<VTKFile type=\"Collection\"><Collection>\n"
                        "<!-- <DataSet timestep=\"9\" file=\"gone.csv\"/> -->\n"
                        "<DataSet timestep='2.5' part='0' file='a &amp; c.csv'/>\n"
                        "<DataSet timestep=\"1\" file=\"b.csv\"/></Collection></VTKFile>\n"),
        directory.Write("all.csv.series",
                        "{\"file-series-version\" : \"1.0\", \"files\" : [\n"
                        "{ \"name\" : \"a & c.csv\", \"time\" : 2.5 }, "
                        "{\"time\":1,\"name\":\"b.csv\"} ] }")}) {
    const ReadSequence read = ReadAll(path);
    ASSERT_EQ(read.frames.size(), 2u) << read.status;
    EXPECT_EQ(read.frame_count, 2u);
    EXPECT_THAT(read.frames[0].positions, ElementsAre(1, 2));
    EXPECT_EQ(read.frames[0].time, 1);
    EXPECT_THAT(read.frames[1].positions, ElementsAre(3, 4));
    EXPECT_EQ(read.frames[1].time, 2.5);
  }
}

TEST(Collection, EscapedNamesInASeriesAreRead) {
  const support::TemporaryFolder directory;
  const auto read = [&](const std::string& escaped) {
    return ReadAll(directory.Write("all.csv.series",
                                   "{\"files\":[{\"name\":\"" + escaped + "\",\"time\":1}]}"));
  };
  const std::vector<std::pair<std::string, std::string>> names = {
      {R"(gr\u00f6\u00dfe\/1.csv)", "gr\u00f6\u00dfe/1.csv"},
      {R"(\u6d41\u4F53 \"a\".csv)", "\u6d41\u4f53 \"a\".csv"},
      {R"(\ud83c\udf0a\u0041.csv)", "\U0001f30aA.csv"},
      {R"(\ud83c\u0041\udf0a.csv)", "\ufffdA\ufffd.csv"},
      {R"(\u12g4.csv)", "\ufffd12g4.csv"},
  };
  std::filesystem::create_directory(directory.Path("gr\u00f6\u00dfe"));
  for (const auto& [escaped, name] : names) {
    directory.Write(name, "x,y\n1,2\n");
    const ReadSequence found = read(escaped);
    EXPECT_TRUE(found.status.ok()) << found.status;
    EXPECT_EQ(found.frames.size(), 1u) << name;
  }
  for (const char* cut : {"a\\", "a\\u", "a\\u00", "\\ud83c\\u"}) {
    EXPECT_FALSE(read(cut).status.ok()) << cut;
  }
}

TEST(Collection, WrongEntriesAreRefused) {
  const support::TemporaryFolder directory;
  directory.Write("b.csv", "x,y\n1,2\n");
  const auto refusal = [&](const std::string& entries) {
    return ReadAll(directory.Write("a.pvd", "<VTKFile type=\"Collection\">" + entries)).status;
  };
  const auto code = absl::StatusCode::kDataLoss;
  ExpectRefused(refusal(""), code, {"a.pvd", "without files"});
  ExpectRefused(refusal("<DataSet file=\"b.csv\"/>"), code, {"b.csv", "a time"});
  ExpectRefused(refusal("<DataSet timestep=\"nan\" file=\"b.csv\"/>"), code, {"b.csv", "a time"});
  ExpectRefused(refusal("<DataSet timestep=\"1\"/>"), code, {"a file and a time"});
  ExpectRefused(
      refusal("<DataSet timestep=\"1\" file=\"b.csv\"/><DataSet timestep=\"1\" part=\"1\" "
              "file=\"b.csv\"/>"),
      code, {"several files at time 1"});
  ExpectRefused(refusal("<DataSet timestep=\"1\" file=\"gone.vtp\"/>"), absl::StatusCode::kNotFound,
                {"gone.vtp"});
  const std::string dump = directory.Write("dump.txt", "ITEM: TIMESTEP\n0\n");
  ExpectRefused(refusal("<DataSet timestep=\"1\" file=\"dump.txt\"/>"),
                absl::StatusCode::kFailedPrecondition, {"LAMMPS dump", "several frames"});
}

TEST(Collection, LaterFilesWithSeveralFramesAreRefused) {
  const support::TemporaryFolder directory;
  directory.Write("b.csv", "x,y\n1,2\n");
  directory.Write("c.xyz", "1\n\n1 3 4 0\n1\n\n1 5 6 0\n");
  const std::string path = directory.Write("a.pvd",
                                           "<VTKFile type=\"Collection\">"
                                           "<DataSet timestep=\"1\" file=\"b.csv\"/>"
                                           "<DataSet timestep=\"2\" file=\"c.xyz\"/>");
  ExpectRefused(ReadAll(path).status, absl::StatusCode::kFailedPrecondition,
                {"c.xyz", "several frames"});
}

TEST(Collection, ElementsWithoutAttributesTakeLinearTime) {
  const support::TemporaryFolder directory;
  std::string text;
  for (int k = 0; k < 500000; ++k) text += "<DataSet ";
  ExpectRefused(ReadAll(directory.Write("a.pvd", text)).status, absl::StatusCode::kDataLoss,
                {"a file and a time"});
}

}  // namespace
}  // namespace partiemc::client
