#include "tools/machine/network.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <functional>

#include "bridge/bus/lcm_url.h"

namespace morphbus::tools {
namespace {

/// Runs `body` in a process of its own (namespaces cannot be left again); true if it returned true.
bool InChild(const std::function<bool()>& body) {
  const pid_t pid = fork();
  if (pid == 0) _exit(body() ? 0 : 1);
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool MulticastEchoes() {
  const int receiver = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(7667);
  ip_mreq group = {};
  inet_pton(AF_INET, "239.255.76.67", &group.imr_multiaddr);
  address.sin_addr = group.imr_multiaddr;
  sockaddr generic = {};
  memcpy(&generic, &address, sizeof generic);
  if (bind(receiver, &generic, sizeof generic) != 0) return false;
  if (setsockopt(receiver, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) return false;
  const int sender = socket(AF_INET, SOCK_DGRAM, 0);
  if (sendto(sender, "x", 1, 0, &generic, sizeof generic) != 1) return false;
  char byte = 0;
  return recv(receiver, &byte, 1, 0) == 1 && byte == 'x';
}

bool HasRoute() {
  const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl("");
  return url && bridge::CheckMulticastRoute(*url).has_value();
}

TEST(NetworkTest, APrivateNetworkCarriesMulticast) {
  EXPECT_TRUE(InChild([] {
    const Result<void> entered = EnterPrivateNetwork();
    if (!entered) fprintf(stderr, "%s\n", entered.error().message.c_str());
    return entered.has_value() && HasRoute() && MulticastEchoes();
  }));
}

TEST(NetworkTest, APrivateNetworkKeepsTheUser) {
  const uid_t uid = geteuid();
  EXPECT_TRUE(InChild([&] { return EnterPrivateNetwork().has_value() && geteuid() == uid; }));
}

TEST(NetworkTest, WithoutARouteOneSentenceSaysWhatToDo) {
  EXPECT_TRUE(InChild([] {
    if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
    const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl("");
    const Result<void> checked = url ? bridge::CheckMulticastRoute(*url) : Fail("");
    return !checked && checked.error().message.find("--isolate") != std::string::npos;
  }));
}

TEST(NetworkTest, AnotherRunsNetworkCanBeJoined) {
  int ready[2];
  int done[2];
  ASSERT_EQ(pipe(ready), 0);
  ASSERT_EQ(pipe(done), 0);
  const pid_t owner = fork();
  if (owner == 0) {
    close(done[1]);
    const bool good = EnterPrivateNetwork().has_value();
    char byte = good ? 'y' : 'n';
    const bool told = write(ready[1], &byte, 1) == 1;
    const bool released = read(done[0], &byte, 1) == 0;
    _exit(told && released ? 0 : 1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  ASSERT_EQ(byte, 'y');
  EXPECT_TRUE(InChild([&] { return JoinNetworkOf(owner).has_value() && MulticastEchoes(); }));
  close(done[1]);
  waitpid(owner, nullptr, 0);
}

}  // namespace
}  // namespace morphbus::tools
