// Token files, and which client a token identifies.
#include "server/security/bearer_tokens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "partiemc/status.h"
#include "server/security/authentication.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kAlice[] = "alice-0123456789+/=._~";
constexpr char kBob[] = "bob-0123456789abcdef";
constexpr char kPeer[] = "ipv4:192.0.2.7:50000";

std::string File(const std::string& text) {
  const auto tokens = BearerTokens::Parse(text);
  return tokens.ok() ? "accepted" : std::string(tokens.status().message());
}

// The name of the client with the token; "nobody" for an unknown token.
std::string ClientOf(const BearerTokens& tokens, const std::string& token) {
  const auto* const client = tokens.Find(token);
  return client == nullptr ? "nobody" : client->terms->name;
}

TEST(BearerTokens, AreFoundByTheirWholeTextAndNamed) {
  const auto tokens =
      BearerTokens::Parse(std::string("# who may come in\n\n") + kAlice + "\talice\r\n" + kBob);
  ASSERT_TRUE(tokens.ok()) << tokens.status();
  EXPECT_EQ(tokens->clients().size(), 2u);
  EXPECT_EQ(ClientOf(*tokens, kAlice), "alice");
  EXPECT_EQ(ClientOf(*tokens, kBob), "token-4");
  const std::string bob = kBob;
  for (const std::string& other : {std::string(), bob.substr(1), bob.substr(0, bob.size() - 1),
                                   bob + "x", bob + '\0', " " + bob, std::string("alice")}) {
    EXPECT_EQ(ClientOf(*tokens, other), "nobody") << other;
  }
}

TEST(BearerTokens, MayEverythingUnlessTheirLineSaysOtherwise) {
  const auto tokens = BearerTokens::Parse(std::string(kAlice) + " alice\n" + kBob +
                                          " may=watch names=tank-* watchers=2\n");
  ASSERT_TRUE(tokens.ok()) << tokens.status();
  const CallerTerms& alice = *tokens->Find(kAlice)->terms;
  EXPECT_TRUE(alice.may_produce && alice.may_watch && alice.may_list && alice.MayUse("tonk"));
  EXPECT_EQ(alice.quota, CallerQuota());
  const CallerTerms& bob = *tokens->Find(kBob)->terms;
  EXPECT_EQ(bob.name, "token-2");
  EXPECT_FALSE(bob.may_produce || bob.may_list || bob.MayUse("tonk"));
  EXPECT_EQ(bob.quota, (CallerQuota{.watchers = 2}));
}

TEST(BearerTokens, AFileThatIsNoneIsRefusedByLineWordAndRuleWithoutShowingAWord) {
  const std::string token = kAlice;
  EXPECT_THAT(File(""), HasSubstr("no token"));
  EXPECT_THAT(File("# nothing\n \n"), HasSubstr("no token"));
  const struct {
    std::string text;
    const char* told;
  } wrong[] = {
      {token + "\n" + token + " twice\n", "line 2, word 1: must not repeat"},
      {"\nshort-secret\n", "line 2, word 1: must be a token of 16"},
      {std::string(513, 'a'), "line 1, word 1"},
      {"secret\"with\"quotes\"in\"it", "line 1, word 1"},
      {token + " two names", "line 1, word 3: after the token"},
      {token + " na/me", "line 1, word 2: a name must"},
      {token + " alice " + kBob, "line 1, word 3: after the token"},
      {token + " alice streams=secret", "line 1, word 3: calls=, streams= and watchers= must"},
      {"# one\n" + token + " may=secret", "line 2, word 2: may= must"},
      {token + " names=secret,/", "line 1, word 2: names= must"},
      {token + " bytes=9secret", "line 1, word 2: bytes= must"},
  };
  for (const auto& [text, told] : wrong) {
    EXPECT_THAT(File(text), HasSubstr(told));
    EXPECT_THAT(File(text), Not(HasSubstr("alice"))) << text;
    EXPECT_THAT(File(text), Not(HasSubstr("bob"))) << text;
    EXPECT_THAT(File(text), Not(HasSubstr("secret"))) << text;
  }
}

TEST(BearerTokens, AreNoMoreThanAThousand) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "0123456789-token-" + std::to_string(i) + "\n";
  EXPECT_EQ(File(text), "accepted");
  EXPECT_THAT(File(text + kBob), HasSubstr("line 1001"));
}

TEST(Authentication, LetsEverybodyInUntilThereAreTokens) {
  Authentication authentication;
  EXPECT_FALSE(authentication.required());
  EXPECT_EQ(authentication.Authenticate(std::nullopt, kPeer)->name(), "");
  authentication.Set(*BearerTokens::Parse(std::string(kAlice) + " alice"));
  EXPECT_TRUE(authentication.required());
  EXPECT_EQ(authentication.Authenticate(std::string("Bearer ") + kAlice, kPeer)->name(), "alice");
  EXPECT_EQ(authentication.Authenticate(std::string("bEARER ") + kAlice, kPeer)->name(), "alice");
}

TEST(Authentication, TellsCallersWithoutATokenFromEachOtherByTheirAddress) {
  const Authentication authentication({.calls = 5});
  const auto account = [&](const char* peer) {
    return authentication.Authenticate(std::nullopt, peer)->account();
  };
  const auto first = account("ipv4:192.0.2.7:1");
  EXPECT_EQ(account("ipv4:192.0.2.7:2"), first);
  EXPECT_NE(account("ipv4:192.0.2.8:1"), first);
  EXPECT_EQ(first->quota(), (CallerQuota{.calls = 5}));
}

TEST(Authentication, KeepsTheAccountOfATokenWhateverItsPeerWhileItsTermsChange) {
  Authentication authentication({.calls = 50, .streams = 9});
  const auto load = [&](const std::string& text) {
    authentication.Set(*BearerTokens::Parse(text));
  };
  const auto caller = [&](const char* token, const char* peer = kPeer) {
    return *authentication.Authenticate(std::string("Bearer ") + token, peer);
  };
  load(std::string(kAlice) + " streams=2\n" + kBob);
  const Caller alice = caller(kAlice), bob = caller(kBob);
  EXPECT_NE(alice.account(), bob.account());
  EXPECT_EQ(caller(kAlice, "ipv4:192.0.2.9:1").account(), alice.account());
  EXPECT_EQ(alice.account()->quota(), (CallerQuota{.calls = 50, .streams = 2}));
  EXPECT_EQ(bob.account()->quota(), (CallerQuota{.calls = 50, .streams = 9}));
  const auto place = alice.account()->Take(CallerAccount::Kind::kStream);

  load(std::string("# other lines, other terms\n") + kBob + " bob\n" + kAlice +
       " streams=1 may=watch");
  EXPECT_EQ(caller(kAlice).account(), alice.account());
  EXPECT_EQ(caller(kBob).account(), bob.account());
  EXPECT_FALSE(alice.account()->Take(CallerAccount::Kind::kStream).ok()) << "one is held";
  EXPECT_FALSE(caller(kAlice).CheckMayProduce().ok());
  EXPECT_TRUE(alice.CheckMayProduce().ok()) << "what has begun goes on";
  EXPECT_EQ(caller(kBob).name(), "bob");
}

TEST(Authentication, TurnsAwayWithAReasonAndWithoutRepeatingWhatItWasGiven) {
  Authentication authentication;
  authentication.Set(*BearerTokens::Parse(kAlice));
  const auto reason = [&](std::optional<std::string> header) {
    const auto client = authentication.Authenticate(header, kPeer);
    EXPECT_EQ(client.status().code(), absl::StatusCode::kUnauthenticated);
    EXPECT_THAT(std::string(client.status().message()), Not(HasSubstr("0123456789")));
    return FindViolation(client.status())->reason;
  };
  EXPECT_EQ(reason(std::nullopt), kReasonTokenMissing);
  EXPECT_EQ(reason(kAlice), kReasonTokenMissing);
  EXPECT_EQ(reason(std::string("Basic ") + kAlice), kReasonTokenMissing);
  EXPECT_EQ(reason("Bearer "), kReasonTokenUnknown);
  EXPECT_EQ(reason(std::string("Bearer ") + kBob), kReasonTokenUnknown);
}

}  // namespace
}  // namespace partiemc::server
