// The monitor's server with its threads and real sockets on the loopback; tools/check runs it under
// ThreadSanitizer. What a client may ask for is tested without sockets (outward_session_test.cc).

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "bridge/outward/outward_server.h"

namespace morphbus::bridge {
namespace {

using nlohmann::json;

constexpr int kClients = 3;    ///< At one time.
constexpr int kRounds = 8;     ///< How often each of them comes and goes.
constexpr int kMessages = 20;  ///< That each of them waits for.
/// A client that hears nothing for so long gives up, seconds: far more than any machine takes.
constexpr time_t kPatience = 60;

/// Thrown by a client whose server has closed the connection.
struct Closed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A client by the letter of RFC 6455, as small as can be; what goes wrong is thrown.
class SmallClient {
 public:
  explicit SmallClient(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval patience = {kPatience, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      throw std::runtime_error("connect");
    }
    Write("GET /?token=token-of-the-test HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
          "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
          "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n");
    std::string head;
    while (!head.ends_with("\r\n\r\n")) head += Read(1);
    if (!head.starts_with("HTTP/1.1 101")) throw std::runtime_error(head);
  }
  ~SmallClient() { close(socket_); }
  SmallClient(const SmallClient&) = delete;
  SmallClient& operator=(const SmallClient&) = delete;

  /// A message of fewer than 126 bytes, under a mask of zeros.
  void Send(const std::string& message, bool binary) {
    std::string frame = {static_cast<char>(binary ? 0x82 : 0x81),
                         static_cast<char>(0x80 | message.size())};
    Write(frame + std::string(4, '\0') + message);
  }
  /// The next message, and whether it is a binary one.
  std::string Receive(bool* binary) {
    const std::string head = Read(2);
    *binary = (head[0] & 0x0F) == 2;
    size_t size = static_cast<unsigned char>(head[1]);
    const size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (more > 0) size = 0;
    for (const char c : Read(more)) size = size << 8 | static_cast<unsigned char>(c);
    return Read(size);
  }

 private:
  void Write(const std::string& bytes) const {
    if (send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) !=
        static_cast<ssize_t>(bytes.size())) {
      throw std::runtime_error("send");
    }
  }
  [[nodiscard]] std::string Read(size_t size) const {
    std::string bytes(size, '\0');
    for (size_t have = 0; have < size;) {
      const ssize_t got = recv(socket_, bytes.data() + have, size - have, 0);
      // Of a connection that was closed with something unread in it the other end learns by an
      // error.
      if (got == 0 || (got < 0 && errno == ECONNRESET)) throw Closed("the server closed it");
      if (got < 0) throw std::runtime_error(std::string("recv: ") + std::strerror(errno));
      have += static_cast<size_t>(got);
    }
    return bytes;
  }

  int socket_;
};

/// Comes, subscribes, reads messages, calls the service, and goes. "" or what went wrong.
std::string OneVisit(int port) {
  try {
    SmallClient client(port);
    client.Send(R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1}]})", false);
    client.Send(std::string("\x02\1\0\0\0\x05\0\0\0\4\0\0\0json{}", 19), true);
    // Messages come in order, and the answer to the call among them.
    int messages = 0;
    bool answered = false;
    uint64_t last = 0;
    while (messages < kMessages || !answered) {
      bool binary = false;
      const std::string message = client.Receive(&binary);
      if (!binary) continue;
      answered |= message[0] == 3;
      if (message[0] != 1) continue;
      uint64_t time = 0;
      std::memcpy(&time, message.data() + 5, sizeof(time));
      if (time <= last && messages > 0) return "a message came again or too late";
      if (message.substr(13) != "message " + std::to_string(time)) return "another message's body";
      last = time;
      ++messages;
    }
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// A server with one topic that is a state, and one service.
Result<std::unique_ptr<OutwardServer>> StartedServer() {
  ServerOptions options;
  options.gate.token = "token-of-the-test";
  auto server = OutwardServer::Open(options);
  if (!server) return server;
  Catalogue catalogue;
  catalogue.name = "test";
  catalogue.channels = {{"/a/state", "S", "schema", true}};
  catalogue.services = {"/a/pause"};
  (*server)->Start(catalogue);
  return server;
}

TEST(OutwardServer, PublishesAndAnswersWhileClientsComeAndGo) {
  auto server = StartedServer();
  ASSERT_TRUE(server) << server.error().message;
  SessionHub& hub = (*server)->hub();
  // The clients, each in a thread of its own.
  std::atomic<int> under_way = kClients;
  std::vector<std::string> wrong(kClients);
  std::vector<std::thread> clients;
  for (int c = 0; c < kClients; ++c) {
    clients.emplace_back([&, c] {
      for (int round = 0; round < kRounds && wrong[c].empty(); ++round) {
        wrong[c] = OneVisit((*server)->port());
      }
      --under_way;
    });
  }
  // Meanwhile this thread is the source: it publishes, answers, and tells a parameter.
  int gone = 0, calls = 0;
  for (int64_t time = 1; under_way > 0 || gone < kClients * kRounds; ++time) {
    hub.Publish(0, time, "message " + std::to_string(time));
    hub.SetParameter("/a/tick", time);
    for (const ClientRequest& request : hub.TakeRequests(1)) {
      gone += request.kind == ClientRequest::Kind::kDisconnected;
      if (request.kind != ClientRequest::Kind::kCall) continue;
      ++calls;
      hub.AnswerCall(request, json::object());
    }
    if (under_way == 0 && wrong != std::vector<std::string>(kClients)) break;
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(wrong, std::vector<std::string>(kClients));
  EXPECT_EQ(calls, kClients * kRounds);
  EXPECT_EQ(gone, kClients * kRounds);
  EXPECT_TRUE(hub.refused().empty());
}

TEST(OutwardServer, EndsWhileClientsAreConnected) {
  auto server = StartedServer();
  ASSERT_TRUE(server) << server.error().message;
  SmallClient client((*server)->port());
  bool binary = false;
  EXPECT_NE(client.Receive(&binary).find("serverInfo"), std::string::npos);
  server->reset();
  // What was under way may still come, and then the end does.
  EXPECT_THROW(while (true) client.Receive(&binary), Closed);
}

}  // namespace
}  // namespace morphbus::bridge
