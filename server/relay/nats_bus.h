// A MessageBus over NATS.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/relay/message_bus.h"

namespace partiemc::server {

/// Returns a bus that connects to NATS in the background, and reconnects without a limit of
/// attempts. `url` is nats://[USER:PASSWORD@|TOKEN@]HOST[:PORT] or tls://..., or several such URLs
/// separated by commas. Errors: INVALID_ARGUMENT for an invalid URL.
absl::StatusOr<std::unique_ptr<MessageBus>> ConnectToNats(const std::string& url);

}  // namespace partiemc::server
