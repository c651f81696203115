#pragma once
// The network of what is explored (test/bridge/explored_world.h): it forgets nothing, so that any
// message may come at any time, and again.

#include <algorithm>
#include <deque>
#include <string>
#include <vector>

#include "test/bridge/explored_message.h"

namespace morphbus::bridge {

/// What all nodes have sent.
class SentMessages {
 public:
  std::vector<Message> sent;  ///< A set: sorted, each once.
  std::deque<Message> fresh;  ///< Sent since it was last emptied: resends too.

 protected:
  [[nodiscard]] bool Sent(const Message& m) const {
    return std::binary_search(sent.begin(), sent.end(), m);
  }

  void Send(const Message& m) {
    const auto at = std::lower_bound(sent.begin(), sent.end(), m);
    if (at == sent.end() || *at != m) sent.insert(at, m);
    fresh.push_back(m);
  }

  /// Appends the messages to the text of a state.
  void AddFingerprint(std::string* print) const {
    for (const Message& m : sent) {
      const char bytes[] = {static_cast<char>(m.kind), static_cast<char>(m.process),
                            static_cast<char>(m.number), static_cast<char>(m.last)};
      print->append(bytes, sizeof(bytes));
    }
  }
};

}  // namespace morphbus::bridge
