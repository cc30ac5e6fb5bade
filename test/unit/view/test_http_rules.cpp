#include "view/http_rules.hpp"

#include <gtest/gtest.h>

namespace pocd::view::testing {
namespace {

namespace http = boost::beast::http;

HttpRequest request(const std::string& host, const std::string& origin,
                    const std::string& target = "/live") {
  HttpRequest request(http::verb::get, target, 11);
  request.set(http::field::host, host);
  if (!origin.empty()) request.set(http::field::origin, origin);
  return request;
}

const RequestRules kLocal{"127.0.0.1", "", {"https://app.foxglove.dev"}};

TEST(HttpRules, OwnPageProgramsAndAllowedOnesMayConnect) {
  EXPECT_EQ(refusal(request("localhost:8080", "http://localhost:8080"), kLocal), "");
  EXPECT_EQ(refusal(request("127.0.0.1:8080", ""), kLocal), "");
  EXPECT_EQ(refusal(request("[::1]:8080", "http://[::1]:8080"), kLocal), "");
  EXPECT_EQ(refusal(request("localhost:8080", "https://app.foxglove.dev"), kLocal), "");
}

TEST(HttpRules, PagesFromElsewhereMayNot) {
  for (const char* origin : {"http://evil.example", "http://localhost:9999", "null",
                             "http://localhost:8080.evil.example"}) {
    EXPECT_NE(refusal(request("localhost:8080", origin), kLocal).find("Origin"), std::string::npos)
        << origin;
  }
}

TEST(HttpRules, ANameThatWasMadeToMeanThisAddressIsTurnedAway) {
  EXPECT_NE(refusal(request("evil.example:8080", "http://evil.example:8080"), kLocal), "");
  EXPECT_NE(refusal(request("", ""), kLocal), "");
  EXPECT_FALSE(host_allowed(request("127.0.0.1.evil.example", ""), "127.0.0.1"));
  EXPECT_TRUE(host_allowed(request("robot-server:8080", ""), "0.0.0.0"));
}

TEST(HttpRules, TheTokenHasToFit) {
  const RequestRules rules{"0.0.0.0", "secret", {}};
  for (const char* target : {"/live", "/live?token=", "/live?token=secre", "/live?token=secrets",
                             "/live?x=secret", "/token=secret"}) {
    EXPECT_NE(refusal(request("h", "", target), rules).find("token"), std::string::npos) << target;
  }
  EXPECT_EQ(refusal(request("h", "", "/live?token=secret"), rules), "");
  EXPECT_EQ(refusal(request("h", "", "/?a=b&token=secret"), rules), "");
}

TEST(HttpRules, TheFirstKnownSubprotocolIsTaken) {
  const auto chosen = [](const std::string& offered) {
    HttpRequest asked = request("h", "");
    asked.set(http::field::sec_websocket_protocol, offered);
    return chosen_subprotocol(asked);
  };
  EXPECT_EQ(chosen("pocd.view.v1"), "pocd.view.v1");
  EXPECT_EQ(chosen("chat, foxglove.websocket.v1, foxglove.sdk.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chosen("foxglove.websocket.v2"), "");
  EXPECT_EQ(chosen(""), "");
}

}  // namespace
}  // namespace pocd::view::testing
