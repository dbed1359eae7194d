#include "common/address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/un.h>

#include <cstddef>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "common/text.h"

namespace partiemc {
namespace {

constexpr char kUnixScheme[] = "unix:";

absl::StatusOr<std::uint16_t> ParsePort(const std::string& text, const std::string& whole) {
  if (const auto port = ParseNumber<std::uint16_t>(text)) return *port;
  return absl::InvalidArgumentError(absl::StrCat("address \"", whole, "\": the port \"", text,
                                                 "\" must be a number from 0 to 65535"));
}

absl::StatusOr<Address> ParseUnix(const std::string& text) {
  Address address;
  address.unix_path = text.substr(sizeof(kUnixScheme) - 1);
  // gRPC accepts unix:///path, too.
  if (absl::StartsWith(address.unix_path, "//")) address.unix_path.erase(0, 2);
  if (address.unix_path.empty() || address.unix_path.size() >= sizeof(sockaddr_un::sun_path)) {
    return absl::InvalidArgumentError(absl::StrCat("address \"", text,
                                                   "\": the path of a Unix socket must have 1 to ",
                                                   sizeof(sockaddr_un::sun_path) - 1, " bytes"));
  }
  return address;
}

}  // namespace

bool Address::IsLocal() const {
  if (!unix_path.empty() || host == "localhost") return true;
  in_addr four{};
  if (inet_pton(AF_INET, host.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == 127;
  in6_addr six{};
  return inet_pton(AF_INET6, host.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six) != 0;
}

std::string Address::ToString() const {
  if (!unix_path.empty()) return absl::StrCat(kUnixScheme, unix_path);
  const bool bracketed = absl::StrContains(host, ":");
  return absl::StrCat(bracketed ? "[" : "", host, bracketed ? "]" : "", ":", port);
}

absl::StatusOr<Address> ParseAddress(const std::string& text) {
  if (absl::StartsWith(text, kUnixScheme)) return ParseUnix(text);
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("address \"", text, "\": must be HOST:PORT, [IPV6]:PORT or unix:PATH"));
  }
  Address address;
  address.host = text.substr(0, colon);
  const bool bracketed = address.host.front() == '[' && address.host.back() == ']';
  if (bracketed) address.host = address.host.substr(1, address.host.size() - 2);
  if (address.host.empty() ||
      (!bracketed && address.host.find_first_of(":/[] \t") != std::string::npos)) {
    return absl::InvalidArgumentError(
        absl::StrCat("address \"", text, "\": must be HOST:PORT, [IPV6]:PORT or unix:PATH"));
  }
  const auto port = ParsePort(text.substr(colon + 1), text);
  if (!port.ok()) return port.status();
  address.port = *port;
  return address;
}

}  // namespace partiemc
