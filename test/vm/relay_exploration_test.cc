// Explores the spread of programs exhaustively, for rows of two and three modules and packages of a
// few pieces: every order in which two modules may be handed programs, hear and fail to hear each
// other, give up what nobody offers, and begin anew without what they had.
//
// As with invocations (diffusion_exploration_test.cc), any message that a module has ever sent may
// be heard by its neighbour at any time, any number of times, or never. In every reachable state
// what a module has of a package is the package's beginning, and what is whole is the whole. For
// progress, all that is under way in a reachable state is lost and the network behaves from then
// on: all modules must then come to run the same program, and no older one than any ran.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <string>
#include <unordered_set>
#include <vector>

#include "vm/spread/program_relay.h"

namespace morphbus::vm {
namespace {

constexpr int64_t kNow = 1000;
/// Bytes of a piece: every module says that it takes no more.
constexpr uint16_t kPiece = 24;
constexpr uint32_t kRoom = 96;
const std::array<uint8_t, 8> kFirstImage = {1, 2, 3, 4, 5, 6, 7, 8};

/// A package that is handed to a module in the course of the exploration.
struct Deployment {
  int module = 0;
  uint64_t id = 0;
  uint32_t size = 0;
};

/// What is explored: a row of modules, each docked to the next.
struct Case {
  const char* name;
  int modules;
  std::vector<Deployment> deployments;
  /// The module that may begin anew, once; -1: none.
  int restarts = -1;
  /// Everything is deployed before the exploration begins.
  bool at_once = false;
};

/// The package of a deployment; the relay does not look into it.
std::vector<uint8_t> BytesOf(uint64_t id, uint32_t size) {
  std::vector<uint8_t> bytes(size);
  for (uint32_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(id + i * 7);
  return bytes;
}

/// Both places of a module.
class Places final : public PackageStore {
 public:
  [[nodiscard]] uint32_t capacity() const override { return kRoom; }
  bool Write(int place, uint32_t offset, const uint8_t* bytes, uint32_t size) override {
    std::memcpy(bytes_[place] + offset, bytes, size);
    return true;
  }
  [[nodiscard]] const uint8_t* Read(int place) const override { return bytes_[place]; }

 private:
  uint8_t bytes_[2][kRoom] = {};
};

struct Node {
  RelayState state;
  Places places;
  /// What it has ever sent, by number, a bit each.
  std::vector<bool> sent;
};

struct World {
  std::vector<Node> nodes;
  /// Deployments that have been made, a bit each; and whether the module has begun anew.
  uint32_t deployed = 0;
  bool restarted = false;
};

class Explorer {
 public:
  explicit Explorer(const Case& what) : case_(what) {}

  /// Goes through all reachable states; how many there are.
  size_t Run() {
    World first;
    first.nodes.resize(static_cast<size_t>(case_.modules));
    for (Node& node : first.nodes) Begin(&node);
    for (size_t i = 0; case_.at_once && i < case_.deployments.size(); ++i) Deploy(&first, i);
    Enqueue(first);
    while (!queue_.empty() && !::testing::Test::HasFailure()) {
      const World world = queue_.front();
      queue_.pop_front();
      Expand(world);
    }
    return seen_.size();
  }

 private:
  static ProgramRelay RelayOf(Node* node) {
    return {kFirstImage.data(), kFirstImage.size(), &node->state, &node->places};
  }
  static void Begin(Node* node) {
    node->state = RelayState();
    node->state.cut = kPiece;
    RelayOf(node).Start(1);
  }

  void Expand(const World& world) {
    for (int m = 0; m < case_.modules; ++m) {
      // It hears nothing in a tick, or any of what its neighbours have ever said; or it has heard
      // nothing for long.
      Hear(world, m, nullptr, kNow);
      Hear(world, m, nullptr, kNow + kSilentTicks + 1);
      for (const int other : {m - 1, m + 1}) {
        if (other < 0 || other >= case_.modules) continue;
        const std::vector<bool>& sent = world.nodes[static_cast<size_t>(other)].sent;
        for (size_t i = 0; i < sent.size(); ++i) {
          if (sent[i]) Hear(world, m, &messages_[i], kNow);
        }
      }
    }
    for (size_t i = 0; i < case_.deployments.size(); ++i) {
      if ((world.deployed >> i & 1) != 0) continue;
      World next = world;
      Deploy(&next, i);
      Enqueue(next);
    }
    if (case_.restarts >= 0 && !world.restarted) {
      World next = world;
      next.restarted = true;
      Begin(&next.nodes[static_cast<size_t>(case_.restarts)]);
      Enqueue(next);
    }
  }

  void Deploy(World* world, size_t i) {
    world->deployed |= 1u << i;
    const Deployment& deployment = case_.deployments[i];
    const std::vector<uint8_t> bytes = BytesOf(deployment.id, deployment.size);
    Node* node = &world->nodes[static_cast<size_t>(deployment.module)];
    RelayOf(node).Deploy(bytes.data(), deployment.size, deployment.id);
  }

  /// One tick of a module, as its process computes it but for the VM.
  void Hear(const World& world, int m, const NeighbourMessage* message, int64_t tick) {
    World next = world;
    Node* node = &next.nodes[static_cast<size_t>(m)];
    NeighbourMessage said;
    Tick(node, message, nullptr, tick, &said);
    const size_t number = NumberOf(said);
    if (node->sent.size() <= number) node->sent.resize(number + 1);
    node->sent[number] = true;
    Enqueue(next);
  }

  void Tick(Node* node, const NeighbourMessage* a, const NeighbourMessage* b, int64_t tick,
            NeighbourMessage* said) {
    ProgramRelay relay = RelayOf(node);
    TickInput input;
    input.tick = tick;
    input.messages[0] = a;
    input.messages[1] = b;
    const PackageName before = node->state.running;
    relay.Receive(input);
    if (relay.ready()) {
      EXPECT_TRUE(IsPackage(relay.incoming_id(), relay.incoming_package(), relay.incoming_size()))
          << case_.name;
      relay.Keep();
      relay.Accept();
      const PackageName& now = node->state.running;
      EXPECT_TRUE(now.version > before.version ||
                  (now.version == before.version && now.id > before.id))
          << case_.name << ": an older one in the place of a newer one";
    }
    relay.Fill(said);
    said->news.piece_bytes = kPiece;
    EXPECT_LE(said->fragment.size, kPiece);
  }

  [[nodiscard]] bool IsPackage(uint64_t id, const uint8_t* bytes, uint32_t size) const {
    for (const Deployment& deployment : case_.deployments) {
      if (deployment.id != id) continue;
      const std::vector<uint8_t> whole = BytesOf(id, deployment.size);
      return size == deployment.size && std::memcmp(whole.data(), bytes, size) == 0;
    }
    return false;
  }

  size_t NumberOf(const NeighbourMessage& message) {
    std::string key(reinterpret_cast<const char*>(message.fragment.bytes), message.fragment.size);
    for (const uint64_t part :
         {uint64_t{message.news.version}, message.news.hash, uint64_t{message.news.want_version},
          message.news.want_hash, uint64_t{message.news.want_offset},
          uint64_t{message.fragment.version}, message.fragment.hash,
          uint64_t{message.fragment.image_size}, uint64_t{message.fragment.offset}}) {
      key += std::to_string(part) + ' ';
    }
    const auto [at, is_new] = numbers_.emplace(key, messages_.size());
    if (is_new) messages_.push_back(message);
    return at->second;
  }

  void Enqueue(const World& world) {
    std::string key(1, static_cast<char>(world.deployed * 2 + (world.restarted ? 1 : 0)));
    for (const Node& node : world.nodes) {
      key.append(reinterpret_cast<const char*>(&node.state), sizeof node.state);
      // Bits behind the last that is set are not there in every copy.
      for (size_t i = 0; i < node.sent.size(); ++i) {
        if (node.sent[i]) key += std::to_string(i) + ',';
      }
      key += ';';
    }
    if (!seen_.insert(std::move(key)).second) return;
    CheckBeginnings(world);
    CheckProgress(world);
    queue_.push_back(world);
  }

  /// What has come of a package is its beginning.
  void CheckBeginnings(const World& world) {
    for (const Node& node : world.nodes) {
      const RelayState& state = node.state;
      if (state.have == 0) continue;
      const std::vector<uint8_t> whole = BytesOf(state.incoming.id, state.incoming.size);
      EXPECT_EQ(std::memcmp(whole.data(), node.places.Read(state.place == 0 ? 1 : 0), state.have),
                0)
          << case_.name;
    }
  }

  /// From here on every message is heard, by both neighbours, in the next tick.
  void CheckProgress(World world) {
    PackageName newest;
    for (const Node& node : world.nodes) {
      const PackageName& name = node.state.running;
      if (name.version > newest.version ||
          (name.version == newest.version && name.id > newest.id)) {
        newest = name;
      }
    }
    std::vector<NeighbourMessage> said(world.nodes.size()), next(world.nodes.size());
    for (int64_t tick = kNow + 1; tick < kNow + kSilentTicks + 60; ++tick) {
      for (size_t m = 0; m < world.nodes.size(); ++m) {
        const bool begins = tick == kNow + 1;
        Tick(&world.nodes[m], m > 0 && !begins ? &said[m - 1] : nullptr,
             m + 1 < world.nodes.size() && !begins ? &said[m + 1] : nullptr, tick, &next[m]);
      }
      said.swap(next);
      if (tick > kNow + 3 && AllRunTheSame(world, newest)) return;
    }
    ADD_FAILURE() << case_.name << ": they come to no agreement";
  }

  /// And collect nothing else; with everything deployed, and nobody begun anew, it is the newest.
  [[nodiscard]] bool AllRunTheSame(const World& world, const PackageName& newest) const {
    const PackageName& first = world.nodes[0].state.running;
    for (const Node& node : world.nodes) {
      const PackageName& name = node.state.running;
      if (name.version != first.version || name.id != first.id) return false;
      if (node.state.incoming.version != 0) return false;
    }
    // Who began anew may have been the only one that had it.
    if (world.restarted) return true;
    return first.version > newest.version ||
           (first.version == newest.version && first.id >= newest.id);
  }

  const Case case_;
  std::vector<NeighbourMessage> messages_;
  std::map<std::string, size_t> numbers_;
  std::unordered_set<std::string> seen_;
  std::deque<World> queue_;
};

void Explore(const Case& what) {
  const size_t states = Explorer(what).Run();
  std::printf("%s: %zu states\n", what.name, states);
  EXPECT_GT(states, 100u) << what.name;
}

TEST(RelayExplorationTest, AProgramIsWholeOrNotThere) {
  Explore({"one program", 2, {{0, 50, 60}}});
  Explore({"one program, three modules", 3, {{0, 50, 40}}});
}

TEST(RelayExplorationTest, OfTwoDeployedAtOnceOneWinsEverywhere) {
  Explore({"two programs at two modules", 2, {{0, 50, 40}, {1, 60, 40}}});
  Explore({"two programs at one module", 2, {{0, 60, 40}, {0, 50, 40}}});
}

TEST(RelayExplorationTest, OfTwoDeployedAtBothEndsOneWinsEverywhere) {
  Explore({"two programs at both ends", 3, {{0, 50, 24}, {2, 60, 24}}, -1, true});
}

TEST(RelayExplorationTest, WhoBeginsAnewGetsWhatTheOthersHave) {
  Explore({"the deployer begins anew", 2, {{0, 50, 60}}, 0});
  Explore({"the other one begins anew", 2, {{0, 50, 60}}, 1});
}

}  // namespace
}  // namespace morphbus::vm
