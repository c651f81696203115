// Explores the diffusion of invocations exhaustively, for robots of two and three modules: every
// order in which they may issue, hear and fail to hear each other.
//
// The network is the set of all messages that a module has ever sent, any of which its neighbour
// may hear at any time, any number of times, or never: that is loss, duplication and reordering
// without bound. Safety holds in every reachable state: no module executes an invocation twice, nor
// those of one origin in another order than that of their issue. For progress, all that is under
// way in a reachable state is lost and the network behaves from then on: every module must then
// have executed everything once, and keep nothing. Time is left out: nobody is given up.
//
// A module may begin anew, once, without what it knew. Then, too, nobody executes an invocation
// twice in one life, or out of order; all that is issued in the last life of each is executed by
// every module, but for what it executed in a life before, and for what the only way went through
// a module that had acknowledged it and then began anew; and nothing is kept for ever.

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "test/vm/image_builder.h"
#include "vm/image/kinematics_encoder.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"
#include "vm/run/context.h"
#include "vm/spread/diffusion.h"

namespace morphbus::vm {
namespace {

constexpr int kMaxModules = 3;
constexpr int64_t kNow = 1000;

/// Who is docked to whom, on connector 0 and on connector 1 (-1: nobody), and how many invocations
/// each module issues.
struct Robot {
  const char* name;
  int modules;
  int mates[kMaxModules][2];
  int issues[kMaxModules];
  /// The module that may begin anew; -1: none.
  int restarts = -1;
};

/// One module: what diffusion keeps, and what was executed, as 100 * origin + 10 * life + id.
struct Node {
  DiffusionState diffusion;
  std::vector<int> executed;
  int issued = 0;
  uint32_t incarnation = 1;
  /// The last life of the mate on each connector that it has heard from; 0: none.
  uint32_t heard[2] = {};
  /// How many it executed of each module's first life before it began anew.
  int executed_before[kMaxModules + 1] = {};
  /// What it has ever sent, by number.
  std::set<int> sent;
};

using World = std::vector<Node>;

class Explorer {
 public:
  explicit Explorer(const Robot& robot) : robot_(robot) {
    // A module with two connectors, and a role with one command that takes a number.
    KinematicsTables tables;
    tables.type_name = "BLOCK";
    tables.links = {"body"};
    tables.connectors = {{"c1", 0, {}}, {"c2", 0, {}}};
    std::string error;
    kinematics_bytes_ = EncodeKinematics(tables, &error);
    const VerifyError of_kinematics = VerifyKinematics(
        kinematics_bytes_.data(), static_cast<uint32_t>(kinematics_bytes_.size()), &kinematics_);
    TestImage image(Op(Opcode::kReturn));
    image.functions[0].num_arguments = 1;
    image.functions[0].locals = {ValueType::kInt};
    image.roles[0].startups = {};
    image.roles[0].commands = {0};
    program_bytes_ = image.Build();
    const VerifyError of_program = Verifier::Verify(
        program_bytes_.data(), static_cast<uint32_t>(program_bytes_.size()), program_.get());
    usable_ = error.empty() && of_kinematics.message == nullptr && of_program.message == nullptr;
  }

  /// All states; the first thing that is wrong with one, "" if nothing is.
  std::string Explore() {
    if (!usable_) return "the images are refused";
    World first(static_cast<size_t>(robot_.modules));
    std::unordered_set<std::string> seen = {Print(first)};
    std::deque<World> todo = {first};
    while (!todo.empty()) {
      const World world = todo.front();
      todo.pop_front();
      ++states_;
      if (states_ > kMostStates) return "too many states";
      std::string wrong = Progress(world);
      if (!wrong.empty()) return wrong;
      for (World& next : Successors(world)) {
        wrong = Violation(next);
        if (!wrong.empty()) return wrong;
        if (seen.insert(Print(next)).second) todo.push_back(std::move(next));
      }
    }
    return "";
  }
  [[nodiscard]] size_t states() const { return states_; }

 private:
  static constexpr size_t kMostStates = 400000;

  /// A tick of one module, in which it hears one neighbour, or none, and issues an invocation, or
  /// not. Adds what it says to what it has sent.
  void Tick(int m, int connector, const NeighbourMessage* heard, bool issues, World* world) {
    Node& node = (*world)[static_cast<size_t>(m)];
    *state_ = VmState();
    *output_ = TickOutput();
    state_->tick = kNow;
    state_->role.role = 0;
    state_->scheduler.startup_done = true;
    state_->diffusion = node.diffusion;
    for (int c = 0; c < 2; ++c) {
      state_->neighbours[c].sensor.docked = robot_.mates[m][c] >= 0;
      state_->neighbours[c].heard_tick = kNow;
    }
    VmConfig config;
    config.module_id = static_cast<uint16_t>(m + 1);
    config.incarnation = node.incarnation;
    Context context{config, kinematics_, *program_, *state_, output_.get()};
    Inbox inbox;
    if (heard != nullptr) {
      inbox.from[connector] = heard;
      if (heard->incarnation != node.heard[connector]) inbox.changed |= 1u << connector;
      node.heard[connector] = heard->incarnation;
    }
    ReceiveInvocations(context, inbox);
    if (issues) {
      ++node.issued;
      const Cell number =
          Cell::Int(100 * (m + 1) + 10 * static_cast<int>(node.incarnation) + node.issued);
      Fault fault;
      EXPECT_TRUE(Issue(context, 0, 0, &number, 1, -1, &fault));
    }
    DropAcknowledged(context);
    NeighbourMessage message;
    message.incarnation = node.incarnation;
    FillInvocations(context, &message);
    EXPECT_EQ(output_->status.num_faults, 0);
    // Time and turns are no part of a state: the next tick is always now, and all acknowledgements
    // have room.
    node.diffusion = state_->diffusion;
    node.diffusion.next_ack = 0;
    node.diffusion.full_since_tick = -1;
    for (OriginRecord& origin : node.diffusion.origins) {
      origin.gap_since_tick = -1;
      origin.learned_tick = 0;
    }
    for (int i = 0; i < state_->scheduler.num_pending; ++i) {
      node.executed.push_back(state_->scheduler.pending[i].arguments[0].AsInt());
    }
    // A module that knows nothing says nothing.
    if (message.num_acks > 0) node.sent.insert(NumberOf(message));
  }

  /// What it has sent is still on its way.
  static void BeginAnew(Node* node) {
    Node anew;
    anew.incarnation = 2;
    anew.sent = node->sent;
    for (const int n : node->executed) ++anew.executed_before[n / 100];
    *node = anew;
  }

  std::vector<World> Successors(const World& world) {
    std::vector<World> next;
    if (robot_.restarts >= 0) {
      const auto m = static_cast<size_t>(robot_.restarts);
      if (world[m].incarnation == 1) {
        next.push_back(world);
        BeginAnew(&next.back()[m]);
      }
    }
    for (int m = 0; m < robot_.modules; ++m) {
      if (world[static_cast<size_t>(m)].issued < robot_.issues[m]) {
        next.push_back(world);
        Tick(m, 0, nullptr, true, &next.back());
      }
      for (int c = 0; c < 2; ++c) {
        if (robot_.mates[m][c] < 0) continue;
        for (const int number : world[static_cast<size_t>(robot_.mates[m][c])].sent) {
          // Nobody listens to an earlier life of a mate (vm/space/neighbours.cc).
          const uint32_t known = world[static_cast<size_t>(m)].heard[c];
          if (messages_[static_cast<size_t>(number)].incarnation < known) continue;
          next.push_back(world);
          Tick(m, c, &messages_[static_cast<size_t>(number)], false, &next.back());
        }
      }
    }
    return next;
  }

  /// All messages are lost; from here on each is heard, in turn, until nothing changes.
  std::string Progress(World world) {
    for (Node& node : world) node.sent.clear();
    // Many states differ in what is under way only.
    if (!progressed_.insert(Print(world)).second) return "";
    for (int m = 0; m < robot_.modules; ++m) {
      while (world[static_cast<size_t>(m)].issued < robot_.issues[m]) {
        Tick(m, 0, nullptr, true, &world);
      }
    }
    for (int round = 0; round < 12; ++round) {
      for (int m = 0; m < robot_.modules; ++m) {
        for (int c = 0; c < 2; ++c) {
          const int mate = robot_.mates[m][c];
          if (mate < 0) continue;
          World now = world;
          now[static_cast<size_t>(mate)].sent.clear();
          Tick(mate, 0, nullptr, false, &now);
          for (const int number : now[static_cast<size_t>(mate)].sent) {
            const NeighbourMessage message = messages_[static_cast<size_t>(number)];
            Tick(m, c, &message, false, &world);
          }
        }
      }
    }
    for (const Node& node : world) {
      if (node.diffusion.num_kept != 0) return "kept for ever:\n" + Print(world);
      for (int m = 0; m < robot_.modules; ++m) {
        const int life = 10 * (m + 1) + static_cast<int>(world[static_cast<size_t>(m)].incarnation);
        int spared = node.executed_before[m + 1];
        if (IsBetweenOthers(robot_.restarts)) {
          // What it had said to have, and not handed on yet, is gone for those behind it.
          spared = world[static_cast<size_t>(robot_.restarts)].executed_before[m + 1];
        }
        for (int id = spared + 1; id <= robot_.issues[m]; ++id) {
          if (std::count(node.executed.begin(), node.executed.end(), 10 * life + id) == 0) {
            return "not executed in the end:\n" + Print(world);
          }
        }
      }
    }
    return Violation(world);
  }

  [[nodiscard]] bool IsBetweenOthers(int m) const {
    return m >= 0 && robot_.mates[m][0] >= 0 && robot_.mates[m][1] >= 0;
  }

  /// What must never be.
  static std::string Violation(const World& world) {
    for (const Node& node : world) {
      std::map<int, int> last;
      for (const int n : node.executed) {
        // Whoever has begun anew may begin in the middle, where what came before is not kept.
        int& before = last[n / 10];
        const bool begins = before == 0 && node.incarnation > 1;
        if (!begins && n % 10 != before + 1) {
          return "executed again or out of order:\n" + Print(world);
        }
        before = n % 10;
      }
    }
    return "";
  }

  /// Messages that say the same are one.
  int NumberOf(const NeighbourMessage& message) {
    std::string text = std::to_string(message.incarnation);
    for (int i = 0; i < message.num_acks; ++i) {
      const InvocationAck& ack = message.acks[i];
      text += "a" + std::to_string(ack.origin) + "," + std::to_string(ack.origin_incarnation) +
              "," + std::to_string(ack.id) + "," + std::to_string(ack.floor);
    }
    for (int i = 0; i < message.num_invocations; ++i) {
      const Invocation& invocation = message.invocations[i];
      text += "i" + std::to_string(invocation.origin) + "," +
              std::to_string(invocation.origin_incarnation) + "," + std::to_string(invocation.id);
    }
    const auto [it, is_new] = numbers_.emplace(text, static_cast<int>(messages_.size()));
    if (is_new) messages_.push_back(message);
    return it->second;
  }

  static std::string Print(const World& world) {
    std::string text;
    for (const Node& node : world) {
      const DiffusionState& d = node.diffusion;
      for (int i = 0; i < d.num_kept; ++i) {
        const Invocation& kept = d.kept[i].invocation;
        text += "k" + std::to_string(kept.origin) + "," + std::to_string(kept.origin_incarnation) +
                "," + std::to_string(kept.id) + "," + std::to_string(d.kept[i].acked_connectors);
      }
      for (int i = 0; i < d.num_origins; ++i) {
        text += "o" + std::to_string(d.origins[i].module) + "," +
                std::to_string(d.origins[i].incarnation) + "," + std::to_string(d.origins[i].have);
      }
      for (const int n : node.executed) text += "x" + std::to_string(n);
      for (const int n : node.sent) text += "s" + std::to_string(n);
      if (node.incarnation > 1 || node.heard[0] > 1 || node.heard[1] > 1) {
        text += "b" + std::to_string(node.incarnation) + "," + std::to_string(node.heard[0]) + "," +
                std::to_string(node.heard[1]);
        for (const int n : node.executed_before) text += "," + std::to_string(n);
      }
      text += "\n";
    }
    return text;
  }

  const Robot robot_;
  std::vector<uint8_t> kinematics_bytes_, program_bytes_;
  VerifiedKinematics kinematics_;
  std::unique_ptr<VerifiedProgram> program_ = std::make_unique<VerifiedProgram>();
  std::unique_ptr<VmState> state_ = std::make_unique<VmState>();
  std::unique_ptr<TickOutput> output_ = std::make_unique<TickOutput>();
  bool usable_ = false;
  std::deque<NeighbourMessage> messages_;
  std::map<std::string, int> numbers_;
  size_t states_ = 0;
  /// States, without what was under way, from which everything comes to its end.
  std::unordered_set<std::string> progressed_;
};

class DiffusionExplorationTest : public ::testing::TestWithParam<Robot> {};

TEST_P(DiffusionExplorationTest, EachInvocationIsExecutedOnceWhateverTheNetworkDoes) {
  Explorer explorer(GetParam());
  EXPECT_EQ(explorer.Explore(), "");
  // An exploration that explores nothing would find nothing.
  EXPECT_GT(explorer.states(), 20u);
  RecordProperty("states", static_cast<int>(explorer.states()));
}

constexpr Robot kRobots[] = {
    {"two", 2, {{-1, 1}, {0, -1}, {-1, -1}}, {2, 2, 0}},
    {"chain", 3, {{-1, 1}, {0, 2}, {1, -1}}, {1, 1, 1}},
    {"ring", 3, {{2, 1}, {0, 2}, {1, 0}}, {1, 1, 0}},
    {"two_who_issues_begins_anew", 2, {{-1, 1}, {0, -1}, {-1, -1}}, {2, 0, 0}, 0},
    {"two_who_hears_begins_anew", 2, {{-1, 1}, {0, -1}, {-1, -1}}, {2, 0, 0}, 1},
    {"two_one_of_both_begins_anew", 2, {{-1, 1}, {0, -1}, {-1, -1}}, {1, 1, 0}, 0},
    {"chain_the_first_begins_anew", 3, {{-1, 1}, {0, 2}, {1, -1}}, {1, 0, 0}, 0},
    {"chain_the_last_begins_anew", 3, {{-1, 1}, {0, 2}, {1, -1}}, {1, 0, 0}, 2},
    {"chain_the_middle_begins_anew", 3, {{-1, 1}, {0, 2}, {1, -1}}, {1, 0, 0}, 1},
};
INSTANTIATE_TEST_SUITE_P(Robots, DiffusionExplorationTest, ::testing::ValuesIn(kRobots),
                         [](const auto& robot) { return std::string(robot.param.name); });

}  // namespace
}  // namespace morphbus::vm
