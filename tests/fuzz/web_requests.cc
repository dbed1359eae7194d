// Untrusted requests to the gateway: a whole request header, or its fields one by one.
#include <boost/beast/http/error.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "common/printable.h"
#include "fuzz/choices.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "server/web/http_request.h"
#include "server/web/requests.h"

namespace partiemc::fuzz {
namespace {

const server::WebRules& Rules() {
  static const auto* const rules =
      new server::WebRules{.origins = {"https://viewer.example"}, .is_local = true};
  return *rules;
}

void RequireInside(const std::string& path) {
  Require(!path.empty() && path.front() != '/' && path.back() != '/', "a path names a file");
  Require(path.find_first_of(std::string_view("\0\\%\r\n", 5)) == std::string::npos,
          "a path has plain characters only");
  Require(path.front() != '.' && path.find("/.") == std::string::npos &&
              path.find("//") == std::string::npos,
          "a path stays below its folder, and shows nothing hidden");
}

void RequireSound(const server::WebRequest& request, const server::WebAnswer& answer) {
  if (const auto* const refused = std::get_if<server::WebRefused>(&answer.what)) {
    Require(refused->http_status >= 400 && refused->http_status < 500, "a refusal is the client's");
    Require(!refused->rule.empty() && refused->rule.size() < 200 &&
                refused->rule.find('\n') == std::string::npos,
            "a refusal says what was asked for in a line");
    Require(!refused->field.empty() && !refused->value.empty() && IsPrintable(refused->value) &&
                refused->value.size() < 1000,
            "the log shows a refused value in a line");
    Require(!Name(refused->refusal).empty(), "a refusal is counted");
  }
  if (const auto* const file = std::get_if<server::WebFile>(&answer.what)) {
    RequireInside(file->path);
  }
  if (const auto* const call = std::get_if<server::WebCall>(&answer.what)) {
    Require(call->from_page == !request.origins.empty(), "a page says where it comes from");
    Require(request.origins.empty() ||
                server::IsOriginAllowed(request.origins.front(), request.hosts.front(), Rules()),
            "a page of a stranger makes no call");
    Require(request.authorizations.size() < 2 || !call->authorization,
            "of several tokens none counts");
    Require(!request.is_before_1_1 || request.transfer_encodings.empty(),
            "a request has one end for every version of HTTP");
    Require(request.hosts.size() == 1, "who is asked is known");
  }
  if (!answer.allowed_origin.empty()) {
    Require(answer.allowed_origin.find_first_of("\r\n") == std::string::npos,
            "what is told back breaks no header");
  }
}

// The inverse, for checking decoded bytes.
std::string EncodeBase64Url(std::string_view bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string text;
  unsigned bits = 0;
  int count = 0;
  for (const unsigned char byte : bytes) {
    bits = bits << 8 | byte;
    for (count += 8; count >= 6; count -= 6) text += kDigits[bits >> (count - 6) & 63];
  }
  if (count > 0) text += kDigits[bits << (6 - count) & 63];
  return text;
}

void AttackHeader(std::string_view text) {
  server::HttpParser parser;
  server::SetUp(parser);
  boost::beast::error_code error;
  parser.put(boost::asio::const_buffer(text.data(), text.size()), error);
  if (error || !parser.is_header_done()) return;
  const server::WebRequest request = server::ViewOf(parser);
  RequireSound(request, server::Understand(request, Rules()));
}

void AttackFields(Choices choices) {
  static constexpr std::string_view kMethods[] = {"GET", "HEAD", "POST", "OPTIONS", "PUT"};
  server::WebRequest request;
  request.method = kMethods[choices.Below(std::size(kMethods))];
  request.is_upgrade = choices.Flip();
  request.has_body = choices.Flip();
  request.target = choices.TakeUntil('\n');
  for (auto* const headers :
       {&request.hosts, &request.origins, &request.authorizations, &request.protocols}) {
    for (std::size_t count = choices.Below(3); count > 0; --count) {
      headers->push_back(choices.TakeUntil('\n'));
    }
  }
  request.content_type = choices.TakeUntil('\n');
  request.accept_encoding = choices.TakeUntil('\n');
  RequireSound(request, server::Understand(request, Rules()));

  const std::string_view rest = choices.TakeRest();
  if (const auto decoded = server::DecodeBase64Url(rest)) {
    Require(EncodeBase64Url(*decoded) == rest, "a token is written in one way only");
  }
  if (const auto path = server::FilePathOf(rest)) RequireInside(*path);
  if (const auto origin = server::NormalOrigin(rest); origin.ok()) {
    const auto again = server::NormalOrigin(*origin);
    Require(again.ok() && *again == *origin, "an origin has one normal form");
    const std::string host = origin->substr(origin->find("//") + 2);
    Require(server::IsOriginAllowed(*origin, host, {.is_local = false, .any_host = true}),
            "a page may call where it comes from");
  }
}

}  // namespace

void AttackWebRequests(Bytes bytes) {
  Choices choices(bytes);
  if (choices.Flip()) {
    AttackFields(choices);
  } else {
    AttackHeader(choices.TakeRest());
  }
}

}  // namespace partiemc::fuzz
