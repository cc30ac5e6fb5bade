// Who may connect, judged by the request alone.
#pragma once

#include <boost/beast/http.hpp>
#include <string>
#include <vector>

namespace pocd::view {

using HttpRequest = boost::beast::http::request<boost::beast::http::string_body>;

struct RequestRules {
  std::string address;  ///< that the server listens on
  std::string token;    ///< empty: none
  std::vector<std::string> allowed_origins;
};

/// Of a server on a loopback address the Host has to be one, or localhost: a page of somebody else
/// whose name was made to mean this address (DNS rebinding) is turned away.
bool host_allowed(const HttpRequest& request, const std::string& address);
/// Why a WebSocket client is not let in; empty when it is. Browsers let any page connect anywhere:
/// so its Origin, if there is one, has to be this server or an allowed one.
std::string refusal(const HttpRequest& request, const RequestRules& rules);
/// The first known one that the client offers; empty when there is none.
std::string chosen_subprotocol(const HttpRequest& request);
/// Nothing from elsewhere is loaded, run or embedded.
void set_safety_headers(boost::beast::http::response<boost::beast::http::string_body>& response);

}  // namespace pocd::view
