#include "client/output/report.h"

#include <bit>

#include "absl/strings/escaping.h"
#include "client/output/fixtures.h"
#include "client/output/report_geometry.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {
namespace {

using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Key;
using ::testing::Not;

/// The text between `begin` and `end`, for each `begin`.
std::vector<std::string> Between(const std::string& text, const std::string& begin,
                                 const std::string& end) {
  std::vector<std::string> found;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at)) {
    at += begin.size();
    found.push_back(text.substr(at, text.find(end, at) - at));
  }
  return found;
}

std::vector<std::string> Numbers(const std::string& page) {
  return Between(page, "<script type=\"application/json\" class=\"frame-numbers\">", "</script>");
}

std::vector<std::string> Geometries(const std::string& page) {
  return Between(page, "<script type=\"text/plain\" class=\"frame-geometry\">", "</script>");
}

std::string Page(const ReportOptions& options, const std::vector<FrameRecord>& frames) {
  support::TemporaryFolder directory;
  auto report = ReportWriter::Create(directory / "report.html", options);
  EXPECT_TRUE(report.ok()) << report.status();
  Summary summary;
  for (const FrameRecord& frame : frames) {
    EXPECT_TRUE(report->Add(frame).ok());
    summary.Add(frame);
  }
  EXPECT_THAT(directory.Entries(), Not(::testing::Contains("report.html")));
  EXPECT_TRUE(report->Finish(summary, 2).ok());
  EXPECT_THAT(directory.Entries(), ElementsAre("report.html"));
  return ReadFile(directory / "report.html");
}

/// Reads the format of report_geometry.h, written from its description.
class Reader {
 public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)) {}

  double Float64() {
    std::uint64_t bits = 0;
    for (int shift = 0; shift < 64; shift += 8) bits |= std::uint64_t{Byte()} << shift;
    return std::bit_cast<double>(bits);
  }
  std::uint64_t Count() {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint8_t byte = Byte();
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
  }
  std::int64_t Signed() {
    const std::uint64_t value = Count();
    return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
  }
  std::uint8_t Byte() { return static_cast<std::uint8_t>(bytes_.at(next_++)); }
  bool AtEnd() const { return next_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t next_ = 0;
};

struct Decoded {
  double step = 0;
  std::vector<std::uint64_t> ring_sizes, outer_of;
  std::vector<double> points, mesh_points, particles, particle_sizes;
  bool are_discs = false;
  std::vector<std::uint8_t> normals;
  std::vector<std::int64_t> triangles, interior;
  std::vector<std::vector<std::uint64_t>> section_sizes;
  std::vector<double> section_points;
  std::vector<std::vector<std::uint8_t>> colors, particle_colors;  // By channel.
};

Decoded Decode(const std::string& bytes) {
  Reader reader(bytes);
  Decoded out;
  const double origin_x = reader.Float64(), origin_y = reader.Float64();
  out.step = reader.Float64();
  std::int64_t x = 0, y = 0;
  const auto points = [&](std::uint64_t count, std::vector<double>& into) {
    for (; count > 0; --count) {
      x += reader.Signed();
      y += reader.Signed();
      into.push_back(origin_x + out.step * static_cast<double>(x));
      into.push_back(origin_y + out.step * static_cast<double>(y));
    }
  };
  std::uint64_t ring_points = 0;
  for (std::uint64_t rings = reader.Count(); rings > 0; --rings) {
    out.ring_sizes.push_back(reader.Count());
    out.outer_of.push_back(reader.Count());
    ring_points += out.ring_sizes.back();
  }
  points(ring_points, out.points);
  for (std::uint64_t count = reader.Count(); count > 0; --count) {
    out.normals.push_back(reader.Byte());
  }
  const std::uint64_t own = reader.Count();
  std::vector<double> own_points;
  points(own, own_points);
  if (reader.Count() == 1) out.mesh_points = out.points;
  out.mesh_points.insert(out.mesh_points.end(), own_points.begin(), own_points.end());
  std::int64_t a = 0;
  for (std::uint64_t count = reader.Count(); count > 0; --count) {
    const std::int64_t packed = reader.Signed();
    a += packed >> 1;
    out.interior.push_back(packed & 1);
    const std::int64_t b = a + reader.Signed();
    const std::int64_t c = a + reader.Signed();
    out.triangles.insert(out.triangles.end(), {a, b, c});
  }
  points(reader.Count(), out.particles);
  out.are_discs = reader.Count() == 1;
  for (std::uint64_t count = reader.Count(); count > 0; --count) {
    out.particle_sizes.push_back(out.step * static_cast<double>(reader.Count()));
  }
  for (std::uint64_t sections = reader.Count(); sections > 0; --sections) {
    std::uint64_t section_points = 0;
    std::vector<std::uint64_t>& sizes = out.section_sizes.emplace_back();
    for (std::uint64_t rings = reader.Count(); rings > 0; --rings) {
      sizes.push_back(reader.Count());
      reader.Count();  // The outer ring.
      section_points += sizes.back();
    }
    points(section_points, out.section_points);
  }
  const auto shares = [&reader] {
    std::vector<std::uint8_t> all;
    for (std::uint64_t count = reader.Count(); count > 0; --count) all.push_back(reader.Byte());
    return all;
  };
  for (std::uint64_t channels = reader.Count(); channels > 0; --channels) {
    out.colors.push_back(shares());
    out.particle_colors.push_back(shares());
  }
  EXPECT_TRUE(reader.AtEnd());
  return out;
}

Decoded DecodeFrame(const FrameRecord& frame, std::size_t max_particles = 1000,
                    std::size_t max_triangles = 1000, const std::string& color_by = "") {
  return Decode(EncodeReportGeometry(frame, {max_particles, max_triangles, color_by}));
}

void ExpectNear(const std::vector<double>& found, const std::vector<double>& expected,
                double tolerance) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k], expected[k], tolerance);
}

TEST(Report, HasNumbersAndGeometryOfEveryFrame) {
  const Result full = SquareWithHoleAndIsland();
  const Result empty;
  const std::string page =
      Page({.title = "t"}, {{.index = 4, .time = 0.5, .result = full, .total_ms = 3},
                            {.index = 5, .result = empty},
                            {.index = 9, .result = full}});
  const auto numbers = Numbers(page);
  ASSERT_EQ(numbers.size(), 3u);
  ASSERT_EQ(Geometries(page).size(), 3u);
  const json first = json::parse(numbers[0]);
  EXPECT_EQ(first.at("frame"), 4);
  EXPECT_EQ(first.at("time"), 0.5);
  EXPECT_EQ(first.at("triangles"), 9);
  EXPECT_EQ(first.at("milliseconds"), 3);
  EXPECT_EQ(first.at("stages").size(), kStageCount);
  EXPECT_TRUE(first.at("stages").contains(kStageNames[0]));
  EXPECT_TRUE(first.at("doubts").empty());
  EXPECT_EQ(first.at("measures").size(), 3u);
  EXPECT_EQ(first.at("measures")[0], (json{16.0, 16.0, 150, "7", {"3", "7"}}));
  EXPECT_TRUE(first.at("measures")[1][4].empty());
  EXPECT_EQ(first.at("box"), (json{0.0, 0.0, 11.0, 4.0}));
  EXPECT_TRUE(json::parse(numbers[1]).at("box").is_null());
  std::string bytes;
  ASSERT_TRUE(absl::Base64Unescape(Geometries(page)[2], &bytes));
  EXPECT_EQ(Decode(bytes).points.size(), full.rings.points.size());
}

TEST(Report, ExplainsDoubts) {
  Result result;
  result.statistics.doubts.Add(Doubt::kPositionsCoarse);
  const std::string page = Page({.title = "t"}, {{.result = result}});
  EXPECT_EQ(json::parse(Numbers(page).at(0)).at("doubts"),
            json{std::string(Explanation(Doubt::kPositionsCoarse))});
}

TEST(Report, RefersToNoOtherResource) {
  const Result result = SquareWithHoleAndIsland();
  std::string page = Page({.title = "t"}, {{.result = result}});
  // The name of a namespace is not a reference.
  const std::string name = "http://www.w3.org/2000/svg";
  for (std::size_t at; (at = page.find(name)) != std::string::npos;) page.erase(at, name.size());
  for (const char* reference :
       {"http://", "https://", " src=", " href=", "@import", "url(", "//cdn"}) {
    EXPECT_THAT(page, Not(HasSubstr(reference)));
  }
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
}

TEST(Report, HasNoMarkOfTheTemplate) {
  const std::string page = Page({.title = "t"}, {});
  EXPECT_THAT(page, Not(HasSubstr("{{")));
  EXPECT_THAT(page, HasSubstr("</html>"));
}

TEST(Report, EscapesForeignText) {
  const std::string hostile =
      "</title></script><script>alert('1')</script><img onerror=\"x\">&{{script}}";
  const std::string page =
      Page({.title = hostile, .subtitle = hostile, .parameters = {{hostile, hostile}}}, {});
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  const std::string escaped =
      "&lt;/title&gt;&lt;/script&gt;&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;"
      "&lt;img onerror=&quot;x&quot;&gt;&amp;{{script}}";
  EXPECT_EQ(Between(page, escaped, "").size(), 5u) << "title twice, subtitle, parameter";
}

TEST(Report, HasSummaryAndParameters) {
  const Result result = SquareWithHoleAndIsland();
  const std::string page = Page({.title = "t", .parameters = {{"kernel radius", "3 spacings"}}},
                                {{.result = result, .total_ms = 1.25}});
  EXPECT_THAT(page, HasSubstr("<th scope=\"row\">kernel radius</th><td>3 spacings</td>"));
  EXPECT_THAT(page, HasSubstr("1 frame in 2.00 s, 0.5 frames per second"));
  EXPECT_THAT(page, HasSubstr("<th scope=\"row\">reduction</th><td>75.0 %</td>"));
  EXPECT_THAT(page, HasSubstr("whole frame</th><td>1.250</td>"));
}

TEST(Report, WritesNonFiniteNumbersAsNull) {
  Result result;
  result.statistics.area = std::nan("");
  const std::string page = Page({.title = "t"}, {{.time = std::nan(""), .result = result}});
  const json numbers = json::parse(Numbers(page).at(0));
  EXPECT_TRUE(numbers.at("area").is_null());
  EXPECT_TRUE(numbers.at("time").is_null());
}

TEST(Report, LeavesNoFileWithoutFinish) {
  support::TemporaryFolder directory;
  const Result result = SquareWithHoleAndIsland();
  {
    auto report = ReportWriter::Create(directory / "report.html", {.title = "t"});
    ASSERT_TRUE(report.ok());
    ASSERT_TRUE(report->Add({.result = result}).ok());
  }
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

TEST(Report, RefusesAMissingDirectoryAtOnce) {
  support::TemporaryFolder directory;
  const auto report = ReportWriter::Create(directory / "missing/report.html", {.title = "t"});
  EXPECT_EQ(report.status().code(), absl::StatusCode::kNotFound);
}

TEST(Report, HasNameAndRangeOfTheAttribute) {
  Result result = SquareWithHoleAndIsland();
  result.attributes.resize(1);
  result.attributes[0] = {.name = "<p>", .values = std::vector<float>(11, 1.0f)};
  result.attributes[0].values[3] = 3;
  const std::string page = Page({.title = "t", .color_by = "<p>"}, {{.result = result}});
  EXPECT_EQ(json::parse(Numbers(page).at(0)).at("colors"), (json{{1.0, 3.0}}));
  EXPECT_THAT(page, HasSubstr("data-color=\"&lt;p&gt;\""));
  const std::string plain = Page({.title = "t"}, {{.result = result}});
  EXPECT_FALSE(json::parse(Numbers(plain).at(0)).contains("colors"));
}

TEST(Report, DescribesSections) {
  const auto lines = DescribeParameters(
      {.slice = SlicePlane{.origin = {0, 0, 0.5}},
       .isovalue = 0.25,
       .sections = {{.isovalue = 0.5},
                    {.slice = SlicePlane{.origin = {1, 2, 3}, .normal = {1, 0, 0}}}}});
  EXPECT_THAT(lines, Contains(std::pair("slice", "through (0, 0, 0.5), normal (0, 0, 1)")));
  EXPECT_THAT(lines, Contains(std::pair("isovalue", "0.25")));
  EXPECT_THAT(lines, Contains(std::pair("section 1", "isovalue 0.5")));
  EXPECT_THAT(lines, Contains(std::pair("section 2", "slice through (1, 2, 3), normal (1, 0, 0)")));
}

TEST(Report, DescribesWalls) {
  const auto lines =
      DescribeParameters({.walls = {{.points = {0, 0, 1, 0}}, {.points = {0.1, 2, 3, 4, 5, 6}}}});
  EXPECT_THAT(lines, Contains(std::pair("wall 1", "0,0,1,0")));
  EXPECT_THAT(lines, Contains(std::pair("wall 2", "0.1,2,3,4,5,6")));
}

TEST(Report, DescribesParameters) {
  const auto lines = DescribeParameters({.placement = Placement::kFarthestParticle,
                                         .fill = Fill::kGrid,
                                         .spacing = 0.0303,
                                         .reference_radius = 1.25,
                                         .clean = false,
                                         .min_component_area = 2.5,
                                         .min_component_particles = 3});
  EXPECT_THAT(
      lines,
      ElementsAre(std::pair("placement", "farthest-particle"), std::pair("fill", "grid"),
                  std::pair("spacing", "0.0303"), std::pair("kernel radius", "3 spacings"),
                  std::pair("cell size", "1 spacings"),
                  std::pair("reference radius", "1.25 spacings"),
                  std::pair("surface offset", "0 spacings"), std::pair("normal memory", "on"),
                  std::pair("clean", "off"), std::pair("smallest area", "2.5 squared spacings"),
                  std::pair("fewest particles", "3")));
}

TEST(ReportGeometry, RoundsToHalfAStep) {
  const Result result = SquareWithHoleAndIsland();
  const std::vector<double> particles = {3.1, 3.2, 0.1, 0.3, 1.23, 0.31};
  const Decoded decoded = DecodeFrame({.result = result, .particles = particles});
  EXPECT_DOUBLE_EQ(decoded.step, result.statistics.spacing / 128);
  const double half = decoded.step * 0.5001;
  EXPECT_THAT(decoded.ring_sizes, ElementsAre(4, 3, 4));
  EXPECT_THAT(decoded.outer_of, ElementsAre(0, 0, 1));
  ExpectNear(decoded.points, result.rings.points, half);
  ExpectNear(decoded.mesh_points, result.mesh.points, half);
  EXPECT_EQ(decoded.triangles,
            std::vector<std::int64_t>(result.mesh.triangles.begin(), result.mesh.triangles.end()));
  EXPECT_THAT(decoded.interior, ElementsAre(0, 0, 1, 0, 0, 0, 0, 0, 0));
  // Rows of two spacings, x within a row.
  ExpectNear(decoded.particles, {0.1, 0.3, 1.23, 0.31, 3.1, 3.2}, half);
}

// The square, a larger square around it, and a triangle outside the picture.
Result WithSections() {
  Result result = SquareWithHoleAndIsland();
  result.sections.resize(2);
  AddRing(result.sections[0].rings, {9, 9, 10, 9, 9, 10}, kNoRing);
  AddRing(result.sections[1].rings, {-1, -1, 5, -1, 5, 5, -1, 5}, kNoRing);
  return result;
}

TEST(ReportGeometry, HasAllSections) {
  const Result result = WithSections();
  const Decoded decoded = DecodeFrame({.result = result});
  EXPECT_THAT(decoded.section_sizes, ElementsAre(ElementsAre(3), ElementsAre(4)));
  std::vector<double> points = result.sections[0].rings.points;
  points.insert(points.end(), result.sections[1].rings.points.begin(),
                result.sections[1].rings.points.end());
  ExpectNear(decoded.section_points, points, decoded.step * 0.5001);
}

TEST(Report, HasNumbersOfSections) {
  Result result = WithSections();
  result.sections[1].statistics.area = 36;
  const OutlineDigests digests[] = {{.rings = 1}, {.rings = 0xab}};
  const std::string page = Page({.title = "t"}, {{.result = result, .section_digests = digests}});
  const json sections = json::parse(Numbers(page).at(0)).at("sections");
  ASSERT_EQ(sections.size(), 2u);
  EXPECT_EQ(sections[1].at("area"), 36.0);
  EXPECT_EQ(sections[1].at("rings_digest"), "00000000000000ab");
  EXPECT_EQ(sections[1].at("measures").size(), 1u);
}

TEST(ReportGeometry, ColoursAreSharesOfTheRange) {
  Result result = SquareWithHoleAndIsland();
  result.attributes.resize(2);
  result.attributes[0] = {.name = "p", .values = std::vector<float>(11, 1.0f)};
  result.attributes[0].values[3] = 3;
  result.attributes[0].values[4] = 2;
  result.attributes[1] = {.name = "v", .components = 2, .values = std::vector<float>(22, 0.0f)};
  result.attributes[1].values[1] = -5;
  const auto colors = [&](const std::string& name, std::size_t max_triangles = 1000) {
    return DecodeFrame({.result = result}, 1000, max_triangles, name).colors;
  };
  EXPECT_THAT(colors("p"), ElementsAre(ElementsAre(0, 0, 0, 255, 128, 0, 0, 0, 0, 0, 0)));
  ASSERT_EQ(colors("v").size(), 3u) << "length, x, y";
  EXPECT_EQ(colors("v")[0][0], 255) << "length of a vector";
  EXPECT_EQ(colors("v")[1][0], 128) << "the x component is constant";
  EXPECT_EQ(colors("v")[2][0], 0) << "-5 is the least y component";
  EXPECT_EQ(colors("v")[2][1], 255);
  EXPECT_THAT(colors("q"), IsEmpty());
  EXPECT_THAT(colors(""), IsEmpty());
  EXPECT_EQ(colors("p", 8)[0].size(), result.rings.PointCount()) << "outline only, without a mesh";
}

TEST(ReportGeometry, ColoursParticlesInTheRangeOfBoth) {
  Result result = SquareWithHoleAndIsland();
  result.attributes = {{.name = "p", .values = std::vector<float>(11, 1.0f)}};
  const std::vector<double> particles = {3.1, 3.2, 0.1, 0.3};
  const AttributeValues values = {.name = "p", .values = {3, 2}};
  const FrameRecord frame = {.result = result, .particles = particles, .particle_color = &values};
  const Decoded decoded = DecodeFrame(frame, 1000, 1000, "p");
  EXPECT_EQ(decoded.colors[0][0], 0) << "1 in the range 1 to 3";
  EXPECT_THAT(decoded.particle_colors[0], ElementsAre(128, 255)) << "in the order of the particles";
  const AttributeValues other = {.name = "q", .values = {3, 2}};
  const FrameRecord unknown = {.result = result, .particles = particles, .particle_color = &other};
  EXPECT_THAT(DecodeFrame(unknown, 1000, 1000, "p").particle_colors[0], IsEmpty());
}

TEST(ReportGeometry, ParticlesHaveTheirOwnSizes) {
  const Result result = SquareWithHoleAndIsland();
  const std::vector<double> particles = {3.1, 3.2, 0.1, 0.3};
  const std::vector<float> sizes = {.5, 1.5};
  const Decoded decoded = DecodeFrame(
      {.result = result, .particles = particles, .particle_sizes = sizes, .are_discs = true});
  ExpectNear(decoded.particle_sizes, {1.5, .5}, decoded.step);
  EXPECT_TRUE(decoded.are_discs);
  const Decoded equal = DecodeFrame({.result = result, .particles = particles});
  EXPECT_THAT(equal.particle_sizes, IsEmpty());
  EXPECT_FALSE(equal.are_discs);
}

TEST(ReportGeometry, NormalsHave256Directions) {
  Result result;
  AddRing(result.rings, {1, 0, 0, 1, -1, 0, 0, -1}, kNoRing);
  EXPECT_THAT(DecodeFrame({.result = result}).normals, ElementsAre(0, 64, 128, 192));
}

TEST(ReportGeometry, KeepsAMeshWithOwnPoints) {
  Result result = SquareWithHoleAndIsland();
  result.mesh.points[0] = -1;
  const Decoded decoded = DecodeFrame({.result = result});
  ExpectNear(decoded.mesh_points, result.mesh.points, decoded.step * 0.5001);
}

TEST(ReportGeometry, KeepsTheFrameBesideADistantParticle) {
  const Result result = SquareWithHoleAndIsland();
  const std::vector<double> particles = {1e9, -1e9};
  const Decoded decoded = DecodeFrame({.result = result, .particles = particles});
  ExpectNear(decoded.points, result.rings.points, decoded.step);
  ExpectNear(decoded.particles, particles, decoded.step);
}

TEST(ReportGeometry, KeepsTheShapeFarFromTheOrigin) {
  Result result;
  AddRing(result.rings, {1e8, 1e8, 1e8 + 1, 1e8, 1e8, 1e8 + 1}, kNoRing);
  result.statistics.spacing = 0.1;
  const Decoded decoded = DecodeFrame({.result = result});
  ExpectNear(decoded.points, result.rings.points, decoded.step);
}

TEST(ReportGeometry, ThinsParticlesAndDropsLargeMeshes) {
  const Result result = SquareWithHoleAndIsland();
  std::vector<double> particles;
  for (int k = 0; k < 100; ++k) particles.insert(particles.end(), {0.04 * k, 0.0});
  const Decoded decoded =
      DecodeFrame({.result = result, .particles = particles}, /*max_particles=*/4,
                  /*max_triangles=*/8);
  ExpectNear(decoded.particles, {0, 0, 1, 0, 2, 0, 3, 0}, decoded.step);
  EXPECT_THAT(decoded.triangles, IsEmpty());
}

TEST(ReportGeometry, DropsNonFiniteParticles) {
  const Result result;
  const std::vector<double> particles = {std::nan(""), 1, 2, 3};
  const Decoded decoded = DecodeFrame({.result = result, .particles = particles});
  EXPECT_THAT(decoded.particles, ElementsAre(2, 3));
}

}  // namespace
}  // namespace partiemc::client
