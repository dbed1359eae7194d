// The token file of a server.
#include <string>

#include "absl/strings/match.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "server/security/bearer_tokens.h"

namespace partiemc::fuzz {

void AttackTokens(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto tokens = server::BearerTokens::Parse(text);
  if (!tokens.ok()) {
    Require(absl::IsInvalidArgument(tokens.status()), "a token file is refused as input");
    Require(tokens.status().message().size() < 200, "a refusal tells a rule, not the file");
    return;
  }
  Require(!tokens->clients().empty(), "a token file that is taken has a token");
  Require(tokens->Find("") == nullptr, "no token is nobody's");
  // The first word of a file without comments is one of its tokens.
  const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n\v\f"));
  if (word.empty() || word.front() == '#') return;
  const auto* const client = tokens->Find(word);
  Require(client != nullptr && !client->terms->name.empty(), "a token has its client");
}

}  // namespace partiemc::fuzz
