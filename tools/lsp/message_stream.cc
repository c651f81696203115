#include "tools/lsp/message_stream.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>

#include "tools/base/print.h"

namespace morphbus::tools {
namespace {

/// No header is longer, bytes.
constexpr size_t kMostHeaderBytes = 4096;
constexpr std::string_view kEndOfHeader = "\r\n\r\n";
constexpr std::string_view kLength = "content-length:";

/// The length that one line of a header says; nothing if it is another line, or says none.
std::optional<size_t> LengthIn(std::string_view line) {
  if (line.size() <= kLength.size()) return std::nullopt;
  // Names of fields have no case (RFC 7230, as the protocol says).
  if (strncasecmp(line.data(), kLength.data(), kLength.size()) != 0) return std::nullopt;
  std::string_view number = line.substr(kLength.size());
  number.remove_prefix(std::min(number.find_first_not_of(" \t"), number.size()));
  size_t length = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), length);
  const bool whole =
      std::string_view(end, number.data() + number.size()).find_first_not_of(" \t") ==
      std::string_view::npos;
  return error == std::errc() && whole ? std::optional(length) : std::nullopt;
}

}  // namespace

Result<std::optional<std::string>> MessageReader::Next() {
  const size_t end = bytes_.find(kEndOfHeader);
  if (end == std::string::npos) {
    if (bytes_.size() > kMostHeaderBytes) return Fail("the input is no message with a header");
    return std::optional<std::string>();
  }
  // The header's lines; those other than the length say how the text is encoded, which is UTF-8.
  std::optional<size_t> length;
  for (size_t begin = 0; begin < end;) {
    const size_t line_end = std::min(bytes_.find("\r\n", begin), end);
    const std::string_view line = std::string_view(bytes_).substr(begin, line_end - begin);
    if (const std::optional<size_t> said = LengthIn(line)) length = said;
    begin = line_end + 2;
  }
  if (!length) return Fail("a message does not say its Content-Length");
  if (*length > kMostBytes) {
    return Fail(fmt::format("a message has {} bytes, the most is {}", *length, kMostBytes));
  }
  const size_t body = end + kEndOfHeader.size();
  if (bytes_.size() - body < *length) return std::optional<std::string>();
  std::string message = bytes_.substr(body, *length);
  bytes_.erase(0, body + *length);
  return std::optional(std::move(message));
}

Result<MessageStream::Input> MessageStream::Read(bool wait, std::string* message) {
  while (true) {
    Result<std::optional<std::string>> next = reader_.Next();
    if (!next) return Fail(next.error().message);
    if (*next) {
      *message = *std::move(*next);
      return Input::kMessage;
    }
    if (ended_) return Input::kEnd;
    pollfd ready = {in_, POLLIN, 0};
    const int found = poll(&ready, 1, wait ? -1 : 0);
    if (found == 0) return Input::kNothing;
    // A signal woke us up: whoever waits looks again.
    if (found < 0) continue;
    std::array<char, 65536> bytes;
    const ssize_t size = read(in_, bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    // A client that is gone sends nothing any more, however its end of the pipe is closed.
    if (size <= 0) ended_ = true;
    if (size > 0) reader_.Add({bytes.data(), static_cast<size_t>(size)});
  }
}

bool MessageStream::Write(const Json& message) {
  const std::string text = JsonText(message);
  PrintText(fmt::format("Content-Length: {}\r\n\r\n{}", text.size(), text));
  return FlushResult() == 0;
}

}  // namespace morphbus::tools
