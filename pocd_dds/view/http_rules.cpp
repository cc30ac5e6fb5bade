#include "view/http_rules.hpp"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <boost/beast/websocket.hpp>

namespace pocd::view {

namespace http = boost::beast::http;

namespace {

constexpr const char* kKnown[] = {"pocd.view.v1", "foxglove.sdk.v1", "foxglove.websocket.v1"};

std::string field(const HttpRequest& request, http::field name) {
  return std::string(request[name]);
}

bool loopback(std::string host) {
  if (host.size() > 1 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  if (host == "localhost") return true;
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  return !error && address.is_loopback();
}

std::string without_port(const std::string& authority) {
  const std::size_t colon = authority.rfind(':');
  const std::size_t bracket = authority.rfind(']');
  if (colon == std::string::npos || (bracket != std::string::npos && colon < bracket)) {
    return authority;
  }
  return authority.substr(0, colon);
}

/// Takes as long for every wrong token of the same length.
bool same_secret(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char differ = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    differ = static_cast<unsigned char>(differ | (a[i] ^ b[i]));
  }
  return differ == 0;
}

/// Value of "token" in the query; tokens have no characters that would be escaped.
std::string token_of(const std::string& target) {
  std::size_t at = target.find('?');
  while (at != std::string::npos) {
    const std::size_t end = std::min(target.find('&', at + 1), target.size());
    const std::string part = target.substr(at + 1, end - at - 1);
    if (part.compare(0, 6, "token=") == 0) return part.substr(6);
    at = end < target.size() ? end : std::string::npos;
  }
  return "";
}

}  // namespace

bool host_allowed(const HttpRequest& request, const std::string& address) {
  return !loopback(address) || loopback(without_port(field(request, http::field::host)));
}

std::string refusal(const HttpRequest& request, const RequestRules& rules) {
  const std::string host = field(request, http::field::host);
  if (!host_allowed(request, rules.address)) return "Host is " + host.substr(0, 100);
  const std::string origin = field(request, http::field::origin);
  const bool own = origin == "http://" + host || origin == "https://" + host;
  const auto& allowed = rules.allowed_origins;
  if (!origin.empty() && !own &&
      std::find(allowed.begin(), allowed.end(), origin) == allowed.end()) {
    return "Origin is " + origin.substr(0, 100) + ", which --allow-origin does not name";
  }
  if (!rules.token.empty() && !same_secret(token_of(std::string(request.target())), rules.token)) {
    return "the token is missing or wrong";
  }
  return "";
}

std::string chosen_subprotocol(const HttpRequest& request) {
  const std::string offered = field(request, http::field::sec_websocket_protocol);
  for (const auto& one : http::token_list(offered)) {
    for (const char* known : kKnown) {
      if (one == known) return known;
    }
  }
  return "";
}

void set_safety_headers(http::response<http::string_body>& response) {
  response.set(http::field::server, "pocd_view");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Content-Security-Policy",
               "default-src 'self'; connect-src 'self' ws: wss:; img-src 'self' data: blob:; "
               "style-src 'self' 'unsafe-inline'; object-src 'none'; base-uri 'none'; "
               "frame-ancestors 'self'");
}

}  // namespace pocd::view
