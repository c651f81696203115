#include "bridge/outward/outward_server.h"

#include <signal.h>

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <map>
#include <thread>
#include <vector>

namespace morphbus::bridge {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using tcp = asio::ip::tcp;
using WebSocket = websocket::stream<beast::tcp_stream>;

/// What the kernel keeps for a client that does not read: little, so that it soon shows and what it
/// gets then is new.
constexpr int kSendBufferBytes = 256 << 10;
/// So long a response may take to be taken, and so long the rest of a refused request is read.
constexpr std::chrono::seconds kResponseTime(10), kLinger(2);
/// How often clients that missed something are told, if nothing else makes the server look.
constexpr std::chrono::milliseconds kTellEvery(500);

/// The clock by which sessions tell what was missed.
double NowSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string ToString(boost::string_view view) { return {view.data(), view.size()}; }

/// The head of a request as the gate judges it.
RequestHead HeadOf(const http::request<http::empty_body>& request) {
  RequestHead head;
  head.method = ToString(request.method_string());
  head.target = ToString(request.target());
  head.upgrade = websocket::is_upgrade(request);
  for (const auto& field : request) {
    const std::string value = ToString(field.value());
    // Every occurrence is kept: two Host headers are an attack, and not a choice.
    if (field.name() == http::field::host) head.hosts.push_back(value);
    if (field.name() == http::field::origin) head.origins.push_back(value);
    if (field.name() != http::field::sec_websocket_protocol) continue;
    for (const auto& token : http::token_list(field.value())) {
      head.protocols.push_back(ToString(token));
    }
  }
  return head;
}

}  // namespace

/// The server's sockets, which belong to its thread alone.
class OutwardServer::Impl {
 public:
  explicit Impl(ServerOptions options) : options_(std::move(options)) {}
  ~Impl() { Stop(); }

  Result<void> Listen();
  void Start(Catalogue catalogue);
  void Stop();
  [[nodiscard]] int port() const { return port_; }

  /// A WebSocket.
  class Client;
  /// A connection that has not become a WebSocket.
  class Request;
  /// A place among the connections, given back when the last user of it is gone.
  using Slot = std::shared_ptr<void>;

  ServerOptions options_;
  SessionHub hub_;
  std::map<uint64_t, std::shared_ptr<Client>> clients_;
  int connections_ = 0;
  /// Whether the thread was asked to look for something to send, and has not looked yet.
  std::atomic<bool> wake_posted_ = false;
  /// Behind all that its handlers use, so that it goes first, and they with it.
  asio::io_context io_{1};

 private:
  void Accept();
  void TakeConnection(tcp::socket socket);
  void TellNowAndThen();
  /// Has the server's thread look whether there is something to send.
  void Wake();

  tcp::acceptor acceptor_{io_};
  asio::steady_timer retry_{io_}, tell_{io_};
  int port_ = 0;
  std::thread thread_;
};

/// One client: reads its messages, writes what its session has.
class OutwardServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl* server, WebSocket ws, Slot slot)
      : server_(server), ws_(std::move(ws)), slot_(std::move(slot)) {}

  /// Answers the handshake; from then on the client is one of the server's.
  void Accept(http::request<http::empty_body> request, const GateAnswer& answer) {
    beast::get_lowest_layer(ws_).expires_never();
    websocket::stream_base::timeout timeout = {};
    timeout.handshake_timeout = std::chrono::milliseconds(server_->options_.head_timeout_ms);
    // Who reads nothing for a while is slow, and not gone.
    timeout.idle_timeout = websocket::stream_base::none();
    timeout.keep_alive_pings = false;
    ws_.set_option(timeout);
    ws_.read_message_max(server_->options_.most_message_bytes);
    // A message is one frame, as small clients expect.
    ws_.auto_fragment(false);
    ws_.set_option(websocket::stream_base::decorator(
        [protocol = answer.protocol](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, protocol);
          response.set(http::field::server, "morphbus");
        }));
    // The request must live until it is answered.
    request_ = std::move(request);
    ws_.async_accept(
        request_, [self = shared_from_this(), may_control = answer.has_token,
                   knows_playback = answer.protocol == kSdkProtocol](error_code error) {
          if (error) return self->server_->hub_.Count("malformed");
          // Frames go out at once, and what the client does not read soon shows.
          error_code ignored;
          tcp::socket& socket = beast::get_lowest_layer(self->ws_).socket();
          socket.set_option(tcp::no_delay(true), ignored);
          socket.set_option(asio::socket_base::keep_alive(true), ignored);
          socket.set_option(asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
          self->id_ = self->server_->hub_.Enter(may_control, knows_playback);
          self->server_->clients_[self->id_] = self;
          self->Read();
          self->Write();
        });
  }

  /// Writes one frame after the other, while there are any.
  void Write() {
    if (closed_) return;
    // Looked at also while a frame is stuck, since then nothing else would end it.
    if (server_->hub_.IsOverrun(id_)) {
      server_->hub_.Count("overrun");
      return Close();
    }
    if (writing_ || !server_->hub_.Next(id_, NowSeconds(), &frame_)) return;
    writing_ = true;
    ws_.binary(frame_.binary);
    const std::array<asio::const_buffer, 2> buffers = {
        asio::buffer(frame_.head.data(), frame_.head_size), asio::buffer(*frame_.body)};
    ws_.async_write(buffers, [self = shared_from_this()](error_code error, size_t) {
      self->writing_ = false;
      if (error) return self->Close();
      // What the message asked for may be ready at once.
      self->Write();
    });
  }

  void Close() {
    if (closed_) return;
    // Both operations that may be under way end with an error, and find this set.
    closed_ = true;
    error_code ignored;
    beast::get_lowest_layer(ws_).socket().close(ignored);
    server_->hub_.Leave(id_);
    server_->clients_.erase(id_);
  }

 private:
  void Read() {
    ws_.async_read(buffer_, [self = shared_from_this()](error_code error, size_t) {
      if (error) return self->OnReadError(error);
      const auto data = self->buffer_.data();
      const std::string_view message(static_cast<const char*>(data.data()), data.size());
      // The session judges the content; here it is only text or not.
      if (self->ws_.got_text()) {
        self->server_->hub_.TakeText(self->id_, message);
      } else {
        self->server_->hub_.TakeBinary(self->id_, message);
      }
      self->buffer_.consume(self->buffer_.size());
      self->Write();
      if (!self->closed_) self->Read();
    });
  }

  void OnReadError(error_code error) {
    // Of what a client did wrong the kind is counted; going away is no wrong.
    if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow) {
      server_->hub_.Count("too_large");
    } else if (error != websocket::error::closed &&
               error.category() == make_error_code(websocket::error::closed).category()) {
      server_->hub_.Count("malformed");
    }
    Close();
  }

  Impl* server_;
  WebSocket ws_;
  Slot slot_;
  http::request<http::empty_body> request_;
  beast::flat_buffer buffer_;
  OutgoingFrame frame_;  ///< Being written.
  uint64_t id_ = 0;      ///< By which the hub knows it.
  bool writing_ = false, closed_ = false;
};

/// Reads the head of one request and answers it, or hands the connection on to a Client.
class OutwardServer::Impl::Request : public std::enable_shared_from_this<Request> {
 public:
  Request(Impl* server, tcp::socket socket, Slot slot)
      : server_(server), stream_(std::move(socket)), slot_(std::move(slot)) {}

  void Read() {
    parser_.header_limit(static_cast<uint32_t>(server_->options_.most_head_bytes));
    // One time for the whole head, however many pieces it comes in.
    stream_.expires_after(std::chrono::milliseconds(server_->options_.head_timeout_ms));
    http::async_read_header(stream_, buffer_, parser_,
                            [self = shared_from_this()](error_code error, size_t) {
                              if (error) return self->OnReadError(error);
                              self->Judge();
                            });
  }

 private:
  void OnReadError(error_code error) {
    // A client that is too slow to ask gets no answer, which it might be as slow to take.
    if (error == beast::error::timeout) return server_->hub_.Count("timeout");
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      return Refuse(431, "too_large", "the request is too long");
    }
    // Who goes without having asked for anything is nobody's harm.
    if (error.category() != make_error_code(http::error::bad_method).category() ||
        error == http::error::end_of_stream) {
      return;
    }
    Refuse(400, "malformed", "this is no HTTP request");
  }

  void Judge() {
    // The gate decides, by the head alone; the body is never read.
    const RequestHead head = HeadOf(parser_.get());
    const GateAnswer answer = JudgeRequest(head, server_->options_.gate);
    if (!answer.refused.empty()) return Refuse(answer.status, answer.refused, answer.reason);
    if (answer.status != 101) return Respond(200, answer.file->type, answer.file->bytes);
    // Guests must not take the places of those who may control the run.
    const bool full = server_->hub_.num_guests() >= server_->options_.most_guests;
    if (full && !answer.has_token)
      return Refuse(503, "connections", "too many clients without the token");
    std::make_shared<Client>(server_, WebSocket(std::move(stream_)), slot_)
        ->Accept(parser_.release(), answer);
  }

  void Refuse(int status, const std::string& kind, const std::string& reason) {
    server_->hub_.Count(kind);
    Respond(status, "text/plain; charset=utf-8", "morphbus monitor: " + reason + "\n");
  }

  void Respond(int status, const std::string& type, const std::string& body) {
    // What browsers are told keeps the page to itself: nothing from elsewhere, in no frame.
    response_.version(11);
    response_.result(static_cast<unsigned>(status));
    response_.set(http::field::server, "morphbus");
    response_.set(http::field::content_type, type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    // The page's URL has the token, which no other site is to be told.
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("Cross-Origin-Resource-Policy", "same-origin");
    response_.set("Content-Security-Policy",
                  "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: "
                  "blob:; worker-src 'self' blob:; connect-src 'self' ws: wss:; "
                  "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
    if (status == 405) response_.set(http::field::allow, "GET");
    // One request a connection, so that none is held open for nothing.
    response_.keep_alive(false);
    response_.body() = body;
    response_.prepare_payload();
    stream_.expires_after(kResponseTime);
    http::async_write(stream_, response_, [self = shared_from_this()](error_code error, size_t) {
      if (error) return;
      // What still comes of the request is read, since closing before would cut the answer off.
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
      self->stream_.expires_after(kLinger);
      self->Drain();
    });
  }

  void Drain() {
    stream_.async_read_some(asio::buffer(rest_),
                            [self = shared_from_this()](error_code error, size_t size) {
                              // A client that sends without end is cut off after a mebibyte.
                              self->drained_ += size;
                              if (!error && self->drained_ < (size_t{1} << 20)) self->Drain();
                            });
  }

  Impl* server_;
  beast::tcp_stream stream_;
  Slot slot_;
  beast::flat_buffer buffer_{1 << 16};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
  std::array<char, 4096> rest_ = {};
  size_t drained_ = 0;
};

Result<void> OutwardServer::Impl::Listen() {
  error_code error;
  const asio::ip::address address = asio::ip::make_address(options_.address, error);
  if (error) return Fail("'" + options_.address + "' is no address of an interface as a number");
  // Each step may fail, and the first failure is the one that is told.
  const tcp::endpoint endpoint(address, static_cast<uint16_t>(options_.port));
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(128, error);
  if (error) {
    return Fail("cannot listen on " + options_.address + ", port " + std::to_string(options_.port) +
                ": " + error.message());
  }
  port_ = acceptor_.local_endpoint(error).port();
  return {};
}

void OutwardServer::Impl::Start(Catalogue catalogue) {
  hub_.Start(std::move(catalogue), [this] { Wake(); });
  Accept();
  TellNowAndThen();
  // Signals are for the thread that waits for them.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { io_.run(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void OutwardServer::Impl::Stop() {
  // The thread ends with the handler that it is in; what waits is never run.
  io_.stop();
  if (thread_.joinable()) thread_.join();
}

void OutwardServer::Impl::Accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (!error) {
      TakeConnection(std::move(socket));
      return Accept();
    }
    if (error == asio::error::operation_aborted) return;
    // Without descriptors to spare, the next one is taken when some are.
    retry_.expires_after(std::chrono::milliseconds(100));
    retry_.async_wait([this](error_code aborted) {
      if (!aborted) Accept();
    });
  });
}

void OutwardServer::Impl::TakeConnection(tcp::socket socket) {
  // Only the server's thread counts connections.
  if (connections_ >= options_.most_connections) return hub_.Count("connections");
  ++connections_;
  Slot slot(nullptr, [this](void*) { --connections_; });
  std::make_shared<Request>(this, std::move(socket), std::move(slot))->Read();
}

// A client that reads again after a pause is told what it missed even if nothing new is published.
void OutwardServer::Impl::TellNowAndThen() {
  tell_.expires_after(kTellEvery);
  tell_.async_wait([this](error_code aborted) {
    if (aborted) return;
    Wake();
    TellNowAndThen();
  });
}

void OutwardServer::Impl::Wake() {
  // Once is enough until it has looked.
  if (wake_posted_.exchange(true)) return;
  asio::post(io_, [this] {
    wake_posted_ = false;
    // Writing may close a client and take it off the list, which therefore is copied first.
    std::vector<std::shared_ptr<Client>> writers;
    for (const auto& [id, client] : clients_) writers.push_back(client);
    for (const std::shared_ptr<Client>& client : writers) client->Write();
  });
}

OutwardServer::OutwardServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

OutwardServer::~OutwardServer() {
  // The thread must rest before anything goes that its handlers use.
  impl_->Stop();
  impl_->clients_.clear();
}

Result<std::unique_ptr<OutwardServer>> OutwardServer::Open(ServerOptions options) {
  auto impl = std::make_unique<Impl>(std::move(options));
  if (Result<void> listening = impl->Listen(); !listening) return Fail(listening.error().message);
  return std::unique_ptr<OutwardServer>(new OutwardServer(std::move(impl)));
}

int OutwardServer::port() const { return impl_->port(); }

void OutwardServer::Start(Catalogue catalogue) { impl_->Start(std::move(catalogue)); }

SessionHub& OutwardServer::hub() { return impl_->hub_; }

}  // namespace morphbus::bridge
