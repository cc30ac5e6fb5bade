// Asking a node of the same machine how it is.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <thread>

#include "pocd/common/check.hpp"
#include "run_command.hpp"
#include "watch/health_socket.hpp"

namespace pocd::dds {
namespace {

const HealthWord kWord{"pocd_node", "pocd_node is up: \"running\"", true, true, 0.0};

TEST(HealthSocket, SaysTheNewestWordAndHowOldItIs) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "health";
  HealthSocket socket(path);
  EXPECT_FALSE(ask_health(path, 5.0)) << "the node has said nothing yet";
  socket.update({"pocd_node", "older", false, false, 0.0});
  socket.update(kWord);
  const auto word = ask_health(path, 5.0);
  ASSERT_TRUE(word);
  EXPECT_EQ(word->name, kWord.name);
  EXPECT_EQ(word->line, kWord.line);
  EXPECT_TRUE(word->good && word->ready);
  EXPECT_GE(word->age_s, 0.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_GE(ask_health(path, 5.0)->age_s, word->age_s + 0.02) << "it does not get younger";
}

TEST(HealthSocket, WhoDoesNotReadHoldsUpNobody) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "health";
  HealthSocket socket(path);
  socket.update({"pocd_node", std::string(50'000, 'x'), true, true, 0.0});
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const int idle = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(connect(idle, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_TRUE(ask_health(path, 5.0));
  close(idle);
}

TEST(HealthSocket, NobodyThere) {
  const TemporaryFolder folder;
  EXPECT_FALSE(ask_health(folder.path() / "none", 5.0));
  std::ofstream(folder.path() / "file") << "no socket";
  EXPECT_FALSE(ask_health(folder.path() / "file", 5.0));
  EXPECT_FALSE(ask_health(folder.path() / std::string(300, 'p'), 5.0));
  const auto path = folder.path() / "health";
  { const HealthSocket socket(path); }
  EXPECT_FALSE(std::filesystem::exists(path)) << "it is taken away at the end";
}

TEST(HealthSocket, TakesThePlaceOfADeadOneAndOfNoOther) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "health";
  const int dead = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(dead);
  HealthSocket socket(path);
  socket.update(kWord);
  EXPECT_THROW(HealthSocket{path}, InputError) << "another node answers there";
  EXPECT_TRUE(ask_health(path, 5.0));
  std::ofstream(folder.path() / "file") << "of somebody";
  EXPECT_THROW(HealthSocket{folder.path() / "file"}, InputError);
  EXPECT_EQ(read_text(folder.path() / "file"), "of somebody");
  EXPECT_THROW(HealthSocket{folder.path() / "no" / "folder"}, InputError);
  EXPECT_THROW(HealthSocket{folder.path() / std::string(300, 'p')}, InputError);
}

}  // namespace
}  // namespace pocd::dds
