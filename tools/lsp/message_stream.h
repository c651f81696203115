#pragma once
// Messages of the Language Server Protocol on a pair of descriptors: JSON behind a header that says
// how long it is (LSP 3.17, Base Protocol).

#include <optional>
#include <string>

#include "compiler/base/result.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// Takes messages out of bytes as they come. It knows nothing of where they come from.
class MessageReader {
 public:
  /// No message is longer, bytes: a text of 64 MiB, as the compilers take, with its escapes.
  static constexpr size_t kMostBytes = size_t{160} << 20;

  /// Adds bytes to those that wait.
  void Add(std::string_view bytes) { bytes_.append(bytes); }
  /// The next whole message; nothing while it has not come whole. Fails, for good, where a header
  /// says no length or one that is too large: what follows cannot be told apart.
  Result<std::optional<std::string>> Next();

 private:
  std::string bytes_;
};

/// Messages that come from one descriptor and go to standard output.
class MessageStream {
 public:
  explicit MessageStream(int in) : in_(in) {}

  /// What there is to read.
  enum class Input { kMessage, kNothing, kEnd };
  /// Takes the next message. Waits for it if `wait`, else looks whether it is there. Fails where
  /// the input cannot be understood.
  Result<Input> Read(bool wait, std::string* message);
  /// Sends a message; false if nobody reads any more.
  static bool Write(const Json& message);

 private:
  int in_;
  bool ended_ = false;
  MessageReader reader_;
};

}  // namespace morphbus::tools
