#include "server/web/status_text.h"

#include <boost/beast/http/status.hpp>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "common/json_text.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

constexpr std::uint16_t kNormalClose = 1000, kFirstOwnClose = 4000;
constexpr std::size_t kMostCloseReason = 120;  // A close frame has room for 123.

}  // namespace

std::string StatusJson(const absl::Status& status) {
  std::string text =
      absl::StrCat("{\"code\": ", static_cast<int>(status.code()),
                   ", \"status\": ", JsonString(absl::StatusCodeToString(status.code())));
  const auto add = [&](const char* name, std::string_view value) {
    absl::StrAppend(&text, ", \"", name, "\": ", JsonString(value));
  };
  if (const auto violation = FindViolation(status)) {
    add("reason", violation->reason);
    add("field", violation->field);
    add("value", violation->value);
    add("rule", violation->rule);
  }
  const absl::string_view message = status.message();
  if (!message.empty()) add("message", {message.data(), message.size()});
  return text + "}";
}

unsigned HttpStatusOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return 200;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kOutOfRange:
      return 400;
    case absl::StatusCode::kUnauthenticated:
      return 401;
    case absl::StatusCode::kPermissionDenied:
      return 403;
    case absl::StatusCode::kNotFound:
      return 404;
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kAborted:
      return 409;
    case absl::StatusCode::kResourceExhausted:
      return 429;
    case absl::StatusCode::kCancelled:
      return 499;
    case absl::StatusCode::kUnimplemented:
      return 501;
    case absl::StatusCode::kUnavailable:
      return 503;
    case absl::StatusCode::kDeadlineExceeded:
      return 504;
    default:
      return 500;
  }
}

std::string HttpReasonOf(unsigned http_status) {
  if (http_status == 499) return "Client Closed Request";
  const auto text =
      boost::beast::http::obsolete_reason(static_cast<boost::beast::http::status>(http_status));
  return {text.data(), text.size()};
}

std::uint16_t CloseCodeOf(const absl::Status& status) {
  if (status.ok()) return kNormalClose;
  return static_cast<std::uint16_t>(kFirstOwnClose + static_cast<int>(status.code()));
}

std::string CloseReasonOf(const absl::Status& status) {
  if (status.ok()) return {};
  const auto violation = FindViolation(status);
  return (violation ? violation->reason : absl::StatusCodeToString(status.code()))
      .substr(0, kMostCloseReason);
}

}  // namespace partiemc::server
