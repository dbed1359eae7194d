// Permissions in a line of the token file, and patterns of names.
#include "server/security/caller_terms.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "server/base/name_pattern.h"

namespace partiemc::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

absl::StatusOr<CallerTerms> Parse(const std::string& line) {
  std::istringstream split(line);
  const std::vector<std::string> words(std::istream_iterator<std::string>(split), {});
  return ParseCallerTerms(words);
}

std::string Refused(const std::string& line) {
  const auto terms = Parse(line);
  return terms.ok() ? "accepted" : std::string(terms.status().message());
}

TEST(CallerTerms, OfNoWordAreEverything) {
  const auto terms = Parse("");
  ASSERT_TRUE(terms.ok()) << terms.status();
  EXPECT_EQ(terms->name, "");
  EXPECT_TRUE(terms->may_produce && terms->may_watch && terms->may_list);
  EXPECT_TRUE(terms->MayUse("tank") && terms->MayUse("") && terms->MayUse(std::string(200, 'x')));
  EXPECT_EQ(terms->quota, CallerQuota());
}

TEST(CallerTerms, SayWhatIsAllowedInAnyOrder) {
  const auto terms =
      Parse("site-7 watchers=3 names=tank-*,dam? bytes=64MB may=list,produce calls=9");
  ASSERT_TRUE(terms.ok()) << terms.status();
  EXPECT_EQ(terms->name, "site-7");
  EXPECT_TRUE(terms->may_produce && terms->may_list);
  EXPECT_FALSE(terms->may_watch);
  EXPECT_THAT(terms->names, ElementsAre("tank-*", "dam?"));
  EXPECT_TRUE(terms->MayUse("tank-") && terms->MayUse("tank-9") && terms->MayUse("dam1"));
  EXPECT_FALSE(terms->MayUse("dam") || terms->MayUse("xtank-9") || terms->MayUse(""));
  EXPECT_FALSE(terms->MayUse("tank-" + std::string(200, 'x'))) << "no name is that long";
  EXPECT_EQ(terms->quota.calls, 9u);
  EXPECT_EQ(terms->quota.streams, std::nullopt);
  EXPECT_EQ(terms->quota.watchers, 3u);
  EXPECT_EQ(terms->quota.bytes, 64u << 20);
}

TEST(CallerTerms, NeedNoName) {
  const auto terms = Parse("streams=2");
  ASSERT_TRUE(terms.ok()) << terms.status();
  EXPECT_EQ(terms->name, "");
  EXPECT_EQ(terms->quota.streams, 2u);
}

TEST(CallerTerms, CountBytesInUnitsOf1024) {
  const auto bytes = [](const std::string& text) { return *Parse("bytes=" + text)->quota.bytes; };
  EXPECT_EQ(bytes("7"), 7u);
  EXPECT_EQ(bytes("7B"), 7u);
  EXPECT_EQ(bytes("7kb"), 7u << 10);
  EXPECT_EQ(bytes("7MiB"), 7u << 20);
  EXPECT_EQ(bytes("7GB"), std::uint64_t{7} << 30);
  EXPECT_EQ(bytes("16777215TB"), std::uint64_t{16777215} << 40);
}

TEST(CallerQuotas, AreTheLimitsOfALineInAnyOrder) {
  EXPECT_EQ(*ParseCallerQuota(""), CallerQuota());
  EXPECT_EQ(*ParseCallerQuota("  bytes=64MB streams=4  watchers=16 calls=9 "),
            (CallerQuota{.calls = 9, .streams = 4, .watchers = 16, .bytes = 64u << 20}));
  for (const char* wrong :
       {"streams", "streams=", "streams=0", "streams=1.5", "=4", "streams=4,calls=9",
        "streams=4 streams=4", "may=watch", "bytes=9XB", "calls=4294967296"}) {
    const auto status = ParseCallerQuota(wrong).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << wrong;
    EXPECT_THAT(std::string(status.message()), HasSubstr(": ")) << wrong;
  }
  EXPECT_THAT(std::string(ParseCallerQuota("calls=2 name=x").status().message()),
              HasSubstr("name=x: must be calls=, streams=, watchers= or bytes="));
}

TEST(CallerTerms, ThatAreWrongAreToldByWordAndRuleWithoutShowingIt) {
  EXPECT_THAT(Refused("na/me"), HasSubstr("word 2: a name must be at most 64 characters"));
  EXPECT_THAT(Refused(std::string(65, 'n')), HasSubstr("word 2: a name"));
  EXPECT_THAT(Refused("alice bob"), HasSubstr("word 3: after the token"));
  EXPECT_THAT(Refused("streams=1 alice"), HasSubstr("word 3: after the token"));
  EXPECT_THAT(Refused("alice streams=1 streams=1"), HasSubstr("word 4: after the token"));
  EXPECT_THAT(Refused("alice stream=1"), HasSubstr("word 3: after the token"));
  EXPECT_THAT(Refused("=1"), HasSubstr("word 2: after the token"));
  for (const char* may : {"may=", "may=all", "may=watch,watch", "may=watch,", "may=Watch"}) {
    EXPECT_THAT(Refused(may), HasSubstr("word 2: may= must")) << may;
  }
  std::string many = "names=x";
  for (int i = 0; i < 32; ++i) many += ",x";
  for (const std::string& names :
       {std::string("names="), std::string("names=a,"), std::string("names=a/b"),
        std::string("names=[a]"), "names=" + std::string(129, 'x'), many}) {
    EXPECT_THAT(Refused(names), HasSubstr("word 2: names= must")) << names;
  }
  for (const char* count : {"calls=", "calls=0", "streams=-1", "watchers=+1", "calls=1.5",
                            "streams=4294967296", "calls=1k", "calls= 1"}) {
    EXPECT_THAT(Refused(count), HasSubstr("must be whole numbers from 1 on")) << count;
  }
  for (const char* bytes : {"bytes=", "bytes=0", "bytes=MB", "bytes=1.5MB", "bytes=1XB",
                            "bytes=1MBit", "bytes=1K", "bytes=16777216TB", "bytes=0MB"}) {
    EXPECT_THAT(Refused(bytes), HasSubstr("word 2: bytes= must")) << bytes;
  }
  for (const char* line : {"secret/1", "a secret", "secret=1", "may=secret", "bytes=9secret"}) {
    EXPECT_THAT(Refused(line), Not(HasSubstr("secret")));
  }
}

// Implements the definition letter by letter.
bool MatchesByDefinition(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern[0] == '*') {
    return MatchesByDefinition(pattern.substr(1), name) ||
           (!name.empty() && MatchesByDefinition(pattern, name.substr(1)));
  }
  return !name.empty() && (pattern[0] == '?' || pattern[0] == name[0]) &&
         MatchesByDefinition(pattern.substr(1), name.substr(1));
}

TEST(NamePattern, StandsForTheNamesThatItsDefinitionSays) {
  std::mt19937 random(7);
  int matches = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string pattern(random() % 7, 'a'), name(random() % 9, 'a');
    for (char& c : pattern) c = "ab*?"[random() % 4];
    for (char& c : name) c = "ab"[random() % 2];
    const bool expected = MatchesByDefinition(pattern, name);
    ASSERT_EQ(MatchesPattern(pattern, name), expected) << pattern << " of " << name;
    matches += expected ? 1 : 0;
  }
  EXPECT_GT(matches, 1000);
}

TEST(NamePattern, OfManyStarsEndsAtOnce) {
  std::string pattern;
  for (int i = 0; i < 63; ++i) pattern += "*a";
  // Exponential for a matcher that follows the definition.
  EXPECT_FALSE(MatchesPattern(pattern + "*b", std::string(128, 'a')));
  EXPECT_TRUE(MatchesPattern(pattern + "*", std::string(128, 'a')));
}

TEST(NamePattern, TakesAStarOfTheNameForItself) {
  EXPECT_TRUE(MatchesPattern("a*", "a*b"));
  EXPECT_FALSE(MatchesPattern("ab", "a*"));
  EXPECT_FALSE(MatchesPattern("", "*"));
}

}  // namespace
}  // namespace partiemc::server
