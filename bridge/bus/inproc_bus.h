#pragma once
// A bus within one process and one thread: --inproc runs and tests. Deterministic: every endpoint
// gets messages in order of publication. Nothing is lost unless a FaultyBus is put around an
// endpoint: queues are as long as robots are large.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bridge/bus/bus.h"
#include "bridge/bus/subscriptions.h"

namespace morphbus::bridge {

class InprocEndpoint;

/// Where endpoints meet: what one publishes goes into the queues of all that want it, and waits
/// there until they are handled. The hub must outlive its endpoints.
class InprocHub {
 public:
  InprocHub();
  /// All endpoints must be gone by now.
  ~InprocHub();
  // Endpoints point to their hub, which must not move.
  InprocHub(const InprocHub&) = delete;
  InprocHub& operator=(const InprocHub&) = delete;

  /// A bus of its own for one participant; receives also what it publishes itself, as on LCM.
  std::unique_ptr<Bus> Connect();

  /// Dispatches what waits now, endpoint by endpoint in order of connection.
  /// Returns the number of messages dispatched.
  int HandleRound();
  /// The same round after round until nothing waits. Returns the number of messages dispatched;
  /// does not return while participants keep answering each other.
  int HandleAll();

 private:
  // Endpoints enter themselves here and leave when they are destroyed; in order of connection.
  friend class InprocEndpoint;
  std::vector<InprocEndpoint*> endpoints_;
  /// What is under way.
  struct Message {
    std::string channel;
    std::vector<uint8_t> bytes;
    int num_waiting = 0;  ///< Queues in which it is, and handlers that have it in hand.
  };
  /// A message to be filled in: the one that was done with last, whose memory is still at hand. It
  /// is the caller's until Release takes it back.
  Message* NewMessage();
  /// One queue or handler less has it; it is deleted, or kept for NewMessage, if that was the last.
  void Release(Message* message);
  std::vector<std::unique_ptr<Message>> spare_;
  /// An endpoint, what it needs of a channel, and its subscription to it.
  struct Listener {
    InprocEndpoint* endpoint;
    Interest interest;
    const Subscriptions::Exact* subscription;
  };
  // The endpoints that listen to a channel by its name; and those that listen to many channels, by
  // how their names begin or end. So a message costs what its receivers cost, however many others
  // there are.
  std::unordered_map<std::string, std::vector<Listener>> listeners_;
  std::vector<InprocEndpoint*> broad_listeners_;
  /// Channels that endpoints listen to quietly by how they begin and end, with how many do, and the
  /// first message on each such channel since then: it is there for an endpoint that comes to
  /// subscribe to the channel by its name. So a thousand modules that do not know their neighbours
  /// yet have one message of each other in common, and not a million.
  std::map<std::pair<std::string, std::string>, int> patterns_;
  std::unordered_map<std::string, Message*> early_;
  /// Keeps a message for endpoints that may subscribe to its channel.
  void KeepEarly(Message* message);
  /// An endpoint no longer listens to these.
  void DropPattern(const std::string& prefix, const std::string& suffix);
  /// Counts the changes of what endpoints listen to; what an endpoint has looked up before one of
  /// them is looked up again.
  int64_t num_changes_ = 0;
};

}  // namespace morphbus::bridge
