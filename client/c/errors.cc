#include "client/c/errors.h"

#include <string>

#include "partiemc/status.h"

namespace partiemc::c {
namespace {

// Storage behind partiemc_last_error.
struct LastError {
  std::string message;
  Violation violation;
  partiemc_error view{};

  void Set(const absl::Status& status) {
    message = std::string(status.message());
    violation = FindViolation(status).value_or(Violation{});
    view = {.code = static_cast<partiemc_code>(status.code()),
            .message = message.c_str(),
            .reason = violation.reason.c_str(),
            .field = violation.field.c_str(),
            .value = violation.value.c_str(),
            .rule = violation.rule.c_str()};
  }
};

LastError& OfThisThread() {
  thread_local LastError error;
  if (error.view.message == nullptr) error.Set(absl::OkStatus());
  return error;
}

}  // namespace

partiemc_code Keep(const absl::Status& status) {
  LastError& error = OfThisThread();
  if (!status.ok() || error.view.code != PARTIEMC_OK) error.Set(status);
  return error.view.code;
}

}  // namespace partiemc::c

const partiemc_error* partiemc_last_error(void) { return &partiemc::c::OfThisThread().view; }

const char* partiemc_version(void) { return PARTIEMC_VERSION; }
