#include "bridge/lockstep/sim/run_members.h"

#include <algorithm>

#include "bridge/wire/arithmetic_hash.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/stream_hash.h"

namespace morphbus::bridge {
namespace {

/// A module that was heard within so long, in microseconds, keeps its place: two processes of one
/// name must not take turns.
constexpr int64_t kAliveUs = 100'000;

constexpr size_t kMostTurnedAway = 16;

}  // namespace

RunMembers::RunMembers(const ExpectedMembers& expected, bool logger, bool realtime)
    : expected_(expected), realtime_(realtime) {
  for (const ExpectedModule& module : expected_.modules) members_.push_back({module.name});
  if (logger) members_.push_back({std::string(kLogProcess)});
  for (int i = 0; i < size(); ++i) numbers_.emplace(members_[i].name, i);
}

int RunMembers::NumberOf(const std::string& name) const {
  const auto found = numbers_.find(name);
  return found == numbers_.end() ? -1 : found->second;
}

RunMembers::Welcome RunMembers::OnHello(const morphbus::hello_t& hello, const Standing& standing,
                                        int64_t now_us, std::string* why) {
  const int number = NumberOf(hello.process);
  if (number < 0) return TurnAway(*why = "'" + hello.process + "' is not part of this run");
  Member& member = members_[number];
  const auto incarnation = static_cast<uint32_t>(hello.incarnation);
  // The first claimant of a name whose images fit is believed, until the run has begun.
  if (member.claim == 0 && !standing.started) {
    *why = Misfit(number, hello);
    if (!why->empty()) return Welcome::kUnfit;
    member.claim = hello.claim;
    member.incarnation = incarnation;
    member.heard_us = now_us;
    return Welcome::kJoins;
  }
  // The same process says HELLO again until it hears CLOCK, or is told where the run is.
  if (member.claim == hello.claim) return Welcome::kKnown;
  if (incarnation > member.incarnation) {
    *why = WhyNoPlace(number, hello, standing, now_us);
    if (why->empty()) {
      member.claim = hello.claim;
      member.incarnation = incarnation;
      // The dead one can no longer say what it published.
      if (member.num_actuators > 0) unvouched_.insert(member.name);
      return Welcome::kReplaces;
    }
  } else {
    *why = "a second process (pid " + std::to_string(hello.pid) + ") claims to be " + hello.process;
  }
  return !standing.started && hello.incarnation <= 1 ? Welcome::kUnfit : TurnAway(*why);
}

RunMembers::Welcome RunMembers::TurnAway(const std::string& why) {
  const bool listed =
      std::find(turned_away_.begin(), turned_away_.end(), why) != turned_away_.end();
  if (!listed && turned_away_.size() < kMostTurnedAway) turned_away_.push_back(why);
  return Welcome::kTurnedAway;
}

std::string RunMembers::Misfit(int number, const morphbus::hello_t& hello) const {
  // All hashes are refused in the same words, with both values.
  const auto differs = [&hello](const std::string& what, int64_t has, uint64_t needs) {
    return hello.process + " has another " + what + " (" + HexText(static_cast<uint64_t>(has)) +
           ") than this run (" + HexText(needs) + ")";
  };
  // What every process must share: the wire types and the model.
  if (static_cast<uint64_t>(hello.wire_hash) != WireHash()) {
    return differs("build of the wire types", hello.wire_hash, WireHash());
  }
  // A process that computes otherwise says other things of the same input, and no two such runs
  // are the same. In real time they are not anyway.
  if (!realtime_ && static_cast<uint64_t>(hello.arithmetic_hash) != ArithmeticHash()) {
    return differs("arithmetic", hello.arithmetic_hash, ArithmeticHash()) +
           ": build it with the same options (docs/arithmetic.md), or run with --realtime";
  }
  if (static_cast<uint64_t>(hello.header.model_hash) != expected_.model_hash) {
    return differs("model", hello.header.model_hash, expected_.model_hash);
  }
  if (number >= num_modules()) return {};
  // What a module must be: of the type, with the images, that the robot has in its place.
  const ExpectedModule& module = expected_.modules[number];
  if (hello.type_name != module.type_name) {
    return hello.process + " is a module of type " + hello.type_name + ", but the robot has a " +
           module.type_name + " there";
  }
  if (static_cast<uint64_t>(hello.kinematics_hash) != module.kinematics_hash) {
    return differs("kinematics image", hello.kinematics_hash, module.kinematics_hash);
  }
  if (expected_.program_hash != 0 &&
      static_cast<uint64_t>(hello.header.program_hash) != expected_.program_hash) {
    return differs("program", hello.header.program_hash, expected_.program_hash);
  }
  return {};
}

std::string RunMembers::WhyNoPlace(int number, const morphbus::hello_t& hello,
                                   const Standing& standing, int64_t now_us) const {
  const std::string claims = "a process (pid " + std::to_string(hello.pid) +
                             ") claims to be incarnation " + std::to_string(hello.incarnation) +
                             " of " + hello.process + ", ";
  if (number >= num_modules()) return claims + "which cannot begin anew";
  if (standing.lost) return claims + "which the run goes on without";
  if (standing.ending) return claims + "but the run is over";
  // In real time the run waits for no answer, so only silence tells.
  const bool answered = standing.answered && !realtime_;
  if (answered || now_us - members_[number].heard_us < kAliveUs) return claims + "which answers";
  return Misfit(number, hello);
}

void RunMembers::Published(int module, int64_t num_actuators, int64_t num_status) {
  Member& member = members_[module];
  member.num_actuators = std::max(member.num_actuators, num_actuators);
  member.num_status = std::max(member.num_status, num_status);
}

morphbus::admit_t RunMembers::AdmissionOf(int module, int64_t last_tick) const {
  const Member& member = members_[module];
  return {{}, member.name, member.claim, last_tick, member.num_actuators, member.num_status};
}

}  // namespace morphbus::bridge
