// GeoJSON files: one polygon per outer ring.
#include <limits>

#include "client/output/fixtures.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<double> Flat(const json& ring) {
  std::vector<double> points;
  for (const json& point : ring) {
    points.push_back(point.at(0).get<double>());
    points.push_back(point.at(1).get<double>());
  }
  return points;
}

TEST(GeoJson, HasOnePolygonPerOuterRing) {
  const Result result = SquareWithHoleAndIsland();
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.index = 3, .result = result}));
  EXPECT_EQ(file.at("type"), "FeatureCollection");
  const json& features = file.at("features");
  ASSERT_EQ(features.size(), 2u);
  EXPECT_EQ(features[0].at("type"), "Feature");
  EXPECT_EQ(features[0].at("geometry").at("type"), "Polygon");
  ASSERT_EQ(features[0].at("geometry").at("coordinates").size(), 2u);
  EXPECT_EQ(Flat(features[0]["geometry"]["coordinates"][1]),
            (std::vector<double>{1, 1, 1, 2, 2, 2, 2, 1, 1, 1}));
  EXPECT_EQ(features[1].at("geometry").at("coordinates").size(), 1u);
}

TEST(GeoJson, EveryRingEndsWithItsFirstPoint) {
  const Result result = SquareWithHoleAndIsland();
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  int rings = 0;
  for (const json& feature : file["features"]) {
    for (const json& ring : feature["geometry"]["coordinates"]) {
      EXPECT_EQ(ring.front(), ring.back());
      EXPECT_GE(ring.size(), 4u);
      ++rings;
    }
  }
  EXPECT_EQ(rings, 3);
}

TEST(GeoJson, OrientsOuterRingsAndHoles) {
  Result reversed;
  AddRing(reversed.rings, {0, 4, 4, 4, 4, 0, 0, 0}, kNoRing);
  AddRing(reversed.rings, {2, 1, 2, 2, 1, 2, 1, 1}, 0);
  for (const Result& result : {SquareWithHoleAndIsland(), reversed}) {
    const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
    for (const json& feature : file["features"]) {
      const json& rings = feature["geometry"]["coordinates"];
      for (std::size_t k = 0; k < rings.size(); ++k) {
        const double area = TwiceArea(Flat(rings[k]));
        EXPECT_TRUE(k == 0 ? area > 0 : area < 0) << "ring " << k << " of " << feature;
      }
    }
  }
}

TEST(GeoJson, OrientsRingsFarFromTheOrigin) {
  constexpr double kFar = 1e12;
  Result result;
  AddRing(result.rings, {kFar, kFar + 0.5, kFar + 0.5, kFar + 0.5, kFar + 0.5, kFar, kFar, kFar},
          kNoRing);
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  const std::vector<double> ring = Flat(file["features"][0]["geometry"]["coordinates"][0]);
  EXPECT_THAT(ring, ElementsAre(kFar, kFar + 0.5, kFar, kFar, kFar + 0.5, kFar, kFar + 0.5,
                                kFar + 0.5, kFar, kFar + 0.5));
}

TEST(GeoJson, HasPropertiesOfEachPolygon) {
  const Result result = SquareWithHoleAndIsland();
  const json file =
      json::parse(Encode(FrameFormat::kGeoJson, {.index = 12, .time = 0.1, .result = result}));
  EXPECT_EQ(file.at("frame"), 12);
  EXPECT_EQ(file.at("time"), 0.1);
  EXPECT_EQ(file["features"][0].at("properties"), (json{{"area", 15.0},
                                                        {"perimeter", 20.0},
                                                        {"particles", 150},
                                                        {"ring", 0},
                                                        {"identity", 7},
                                                        {"parents", {3, 7}},
                                                        {"frame", 12},
                                                        {"time", 0.1}}));
}

TEST(GeoJson, CoordinatesReadBackTheSame) {
  const double third = 1.0 / 3, tiny = std::numeric_limits<double>::denorm_min();
  Result result;
  AddRing(result.rings, {third, tiny, 1e300, 0.1 + 0.2, -2.0 / 3, 5}, kNoRing);
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  EXPECT_THAT(Flat(file["features"][0]["geometry"]["coordinates"][0]),
              ElementsAre(third, tiny, 1e300, 0.1 + 0.2, -2.0 / 3, 5, third, tiny));
}

TEST(GeoJson, WritesAnEmptyFrameAsAnEmptyCollection) {
  const Result result;
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  EXPECT_THAT(file.at("features"), IsEmpty());
}

TEST(GeoJson, WritesASelfIntersectingRingUnchanged) {
  Result bow_tie;
  AddRing(bow_tie.rings, {0, 0, 2, 2, 2, 0, 0, 2}, kNoRing);
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = bow_tie}));
  EXPECT_EQ(file["features"][0]["geometry"]["coordinates"][0].size(), 5u);
}

TEST(GeoJson, ATimeThatIsNotFiniteIsNull) {
  const Result result;
  const json file = json::parse(Encode(
      FrameFormat::kGeoJson, {.time = std::numeric_limits<double>::quiet_NaN(), .result = result}));
  EXPECT_TRUE(file.at("time").is_null());
}

TEST(GeoJson, PolygonsHaveTheMeanAndTheRangeOfTheirAttributes) {
  const Result result = WithAttributes();
  const json file = json::parse(Encode(FrameFormat::kGeoJson, {.result = result}));
  const json properties = file["features"][0].at("properties");
  // The square has the heights 0, 0, 4, 4, and its hole is inside.
  EXPECT_EQ(properties.at("height_min"), 0);
  EXPECT_EQ(properties.at("height_max"), 4);
  EXPECT_GT(properties.at("height_mean"), 1);
  EXPECT_LT(properties.at("height_mean"), 3);
  EXPECT_EQ(properties.at("a,b:0_max"), 4);
  EXPECT_TRUE(properties.contains("a,b:1_mean"));
}

}  // namespace
}  // namespace partiemc::client
