// Token files, and who comes in with which token.
#include "server/bearer_tokens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "partiemc/status.h"
#include "server/authentication.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kAlice[] = "alice-0123456789+/=._~";
constexpr char kBob[] = "bob-0123456789abcdef";

std::string File(const std::string& text) {
  const auto tokens = BearerTokens::Parse(text);
  return tokens.ok() ? "accepted" : std::string(tokens.status().message());
}

TEST(BearerTokens, AreFoundByTheirWholeTextAndNamed) {
  const auto tokens =
      BearerTokens::Parse(std::string("# who may come in\n\n") + kAlice + "\talice\r\n" + kBob);
  ASSERT_TRUE(tokens.ok()) << tokens.status();
  EXPECT_EQ(tokens->size(), 2u);
  EXPECT_EQ(tokens->ClientOf(kAlice), "alice");
  EXPECT_EQ(tokens->ClientOf(kBob), "token-4");
  const std::string bob = kBob;
  for (const std::string& other : {std::string(), bob.substr(1), bob.substr(0, bob.size() - 1),
                                   bob + "x", bob + '\0', " " + bob, std::string("alice")}) {
    EXPECT_EQ(tokens->ClientOf(other), std::nullopt) << other;
  }
}

TEST(BearerTokens, AFileThatIsNoneIsRefusedByLineAndRuleWithoutShowingAToken) {
  const std::string token = kAlice;
  EXPECT_THAT(File(""), HasSubstr("no token"));
  EXPECT_THAT(File("# nothing\n \n"), HasSubstr("no token"));
  EXPECT_THAT(File(token + "\n" + token + " twice\n"), HasSubstr("line 2: must not repeat"));
  EXPECT_THAT(File("\nshort-secret\n"), HasSubstr("line 2: must begin with a token of 16"));
  EXPECT_THAT(File(std::string(513, 'a')), HasSubstr("line 1"));
  EXPECT_THAT(File("secret\"with\"quotes\"in\"it"), HasSubstr("line 1"));
  EXPECT_THAT(File(token + " two names"), HasSubstr("line 1: after the token"));
  EXPECT_THAT(File(token + " na/me"), HasSubstr("line 1: after the token"));
  for (const std::string& wrong : {token + "\n" + token, token + " two names",
                                   std::string("short-secret"), token + " na/me"}) {
    EXPECT_THAT(File(wrong), Not(HasSubstr("alice"))) << wrong;
    EXPECT_THAT(File(wrong), Not(HasSubstr("secret"))) << wrong;
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
  EXPECT_EQ(*authentication.Authenticate(std::nullopt), "");
  authentication.Set(*BearerTokens::Parse(std::string(kAlice) + " alice"));
  EXPECT_TRUE(authentication.required());
  EXPECT_EQ(*authentication.Authenticate(std::string("Bearer ") + kAlice), "alice");
  EXPECT_EQ(*authentication.Authenticate(std::string("bEARER ") + kAlice), "alice");
}

TEST(Authentication, TurnsAwayWithAReasonAndWithoutRepeatingWhatItWasGiven) {
  Authentication authentication;
  authentication.Set(*BearerTokens::Parse(kAlice));
  const auto reason = [&](std::optional<std::string> header) {
    const auto client = authentication.Authenticate(header);
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
