#pragma once

#include <string>
#include <vector>

namespace palpate {

/// Who may speak to the console.
struct Access {
  std::vector<std::string> hosts;  ///< names by which it may be called, without port
  std::string token;               ///< empty = none is asked for
};

/// For a server that listens on `address`: its own names, and those of this computer where it listens everywhere.
/// Another than the loopback's address asks for a token, made anew.
Access access_for(const std::string& address, bool asks_for_token);

/// "localhost:8090" -> "localhost", "[::1]:8090" -> "::1".
std::string host_without_port(const std::string& host);

/// What a request says of where it comes from; empty = it says nothing.
struct Caller {
  std::string host, origin, cookie, token;
};

/// Why this caller is refused; empty = it is not. A page of another origin may not speak, nor one that reached us by a
/// name that is not ours, nor one that does not know the token.
std::string refusal(const Access& access, const Caller& caller);

}  // namespace palpate
