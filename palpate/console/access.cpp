#include "palpate/console/access.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>

namespace palpate {

namespace {

std::string new_token() {
  std::array<unsigned char, 16> bytes;
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("the system gives no random numbers for a token");
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::vector<std::string> names_of_this_computer() {
  std::vector<std::string> names;
  char name[256] = {};
  if (gethostname(name, sizeof name - 1) == 0) names.emplace_back(name);
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return names;
  for (const ifaddrs* one = list; one; one = one->ifa_next) {
    if (!one->ifa_addr) continue;
    char text[INET6_ADDRSTRLEN] = {};
    const int family = one->ifa_addr->sa_family;
    if (family == AF_INET)
      inet_ntop(family, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text, sizeof text);
    if (family == AF_INET6)
      inet_ntop(family, &reinterpret_cast<const sockaddr_in6*>(one->ifa_addr)->sin6_addr, text, sizeof text);
    if (text[0]) names.emplace_back(text);
  }
  freeifaddrs(list);
  return names;
}

/// Takes as long for every wrong token.
bool same_token(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ (i < b.size() ? b[i] : 0));
  return difference == 0;
}

std::string cookie_named(const std::string& cookies, const std::string& name) {
  size_t at = 0;
  while (at < cookies.size()) {
    at = cookies.find_first_not_of(" ;", at);
    if (at == std::string::npos) break;
    const size_t end = std::min(cookies.find(';', at), cookies.size());
    if (cookies.compare(at, name.size() + 1, name + "=") == 0)
      return cookies.substr(at + name.size() + 1, end - at - name.size() - 1);
    at = end;
  }
  return {};
}

}  // namespace

Access access_for(const std::string& address, bool asks_for_token) {
  Access access{{"localhost", "127.0.0.1", "::1", host_without_port(address)}, asks_for_token ? new_token() : ""};
  if (address == "0.0.0.0" || address == "::")
    for (const std::string& name : names_of_this_computer()) access.hosts.push_back(name);
  for (std::string& host : access.hosts)
    std::transform(host.begin(), host.end(), host.begin(), [](unsigned char c) { return std::tolower(c); });
  return access;
}

std::string host_without_port(const std::string& host) {
  if (host.starts_with('[')) return host.substr(1, std::max<size_t>(host.find(']'), 1) - 1);
  const size_t colon = host.find(':');
  if (colon != host.rfind(':')) return host;  // an address of IPv6 as it is
  return host.substr(0, colon);
}

std::string refusal(const Access& access, const Caller& caller) {
  std::string host = host_without_port(caller.host);
  std::transform(host.begin(), host.end(), host.begin(), [](unsigned char c) { return std::tolower(c); });
  if (std::find(access.hosts.begin(), access.hosts.end(), host) == access.hosts.end())
    return "this console is not called by that name";
  if (!caller.origin.empty() && caller.origin != "http://" + caller.host)
    return "pages of another origin may not speak to this console";
  const bool knows_token =
      same_token(access.token, caller.token) || same_token(access.token, cookie_named(caller.cookie, "palpate"));
  if (!access.token.empty() && !knows_token)
    return "this console asks for the token that it printed when it was started";
  return {};
}

}  // namespace palpate
