#include "test/bridge/fake_run.h"

#include <algorithm>
#include <cstring>

#include "bridge/wire/status_codec.h"

namespace morphbus::bridge {
namespace {

uint64_t Mix(uint64_t a, uint64_t b) {
  uint64_t z = (a ^ b) + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

uint64_t Bits(double value) {
  uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// A number in -1..1.
double Unit(uint64_t bits) {
  return static_cast<double>(bits >> 12) / static_cast<double>(1ULL << 51) - 1;
}

}  // namespace

FakeRobot::FakeRobot(int num_modules)
    : joints_(static_cast<size_t>(num_modules), std::vector<double>(2, 0.0)) {}

void FakeRobot::Sense(std::vector<morphbus::module_sensors_t>* out) {
  out->clear();
  const auto last = joints_.size() - 1;
  for (size_t i = 0; i <= last; ++i) {
    morphbus::module_sensors_t& reading = out->emplace_back();
    reading.module_id = static_cast<int16_t>(i);
    reading.name = "m" + std::to_string(i + 1);
    reading.num_joints = 2;
    reading.joint_position_si = joints_[i];
    reading.joint_velocity_si = {0.5F, -0.5F};
    reading.joint_effort_si = {0.25F, static_cast<float>(joints_[i][1])};
    const auto dock = [&](size_t connector, size_t mate, size_t pair) {
      const bool open = disconnect_tick_ >= 0 && ticks >= disconnect_tick_ &&
                        static_cast<int>(pair) == disconnected_;
      if (open) return;
      morphbus::docked_connector_t& docked = reading.docked.emplace_back();
      docked.connector = static_cast<int8_t>(connector);
      docked.mate_connector = static_cast<int8_t>(1 - connector);
      docked.mate_module = static_cast<int16_t>(mate);
      docked.connection_type = 0;
      docked.number = 5;
    };
    if (i > 0) dock(0, i - 1, i - 1);
    if (i < last) dock(1, i + 1, i);
    reading.num_docked = static_cast<int8_t>(reading.docked.size());
  }
}

void FakeRobot::Truth(std::vector<morphbus::body_pose_t>* out) {
  out->clear();
  for (size_t i = 0; i < joints_.size(); ++i) {
    morphbus::body_pose_t& body = out->emplace_back();
    body.module_id = static_cast<int16_t>(i);
    body.link = 0;
    body.position_m[0] = joints_[i][0];
    body.position_m[1] = joints_[i][1];
    body.position_m[2] = Unit(mixed_);
    body.orientation_wxyz[0] = 1;
    body.orientation_wxyz[1] = body.orientation_wxyz[2] = body.orientation_wxyz[3] = 0;
  }
}

void FakeRobot::Actuate(const morphbus::actuator_t& command) {
  ++actuations;
  for (size_t j = 0; j < 2; ++j) {
    mixed_ = Mix(mixed_, Bits(command.joints[j].target_si));
    joints_[command.module_id][j] = command.joints[j].target_si + 1e-3 * Unit(mixed_);
  }
}

void FakeController::Tick(const vm::TickInput& input, vm::TickOutput* output) {
  *output = vm::TickOutput();
  computed.push_back(input.tick);
  requests += input.num_requests;
  mixed_ = Mix(mixed_, static_cast<uint64_t>(input.tick + input.sim_time_us));
  for (const double position : input.joint_position) mixed_ = Mix(mixed_, Bits(position));
  for (const float effort : input.joint_effort) {
    mixed_ = Mix(mixed_, Bits(static_cast<double>(effort)));
  }
  for (size_t c = 0; c < 2; ++c) {
    if (!input.connectors[c].docked) continue;
    const vm::NeighbourMessage* message = input.messages[c];
    if (message == nullptr) {
      if (input.tick > 0) ++missing_messages;
      continue;
    }
    mixed_ = Mix(mixed_, static_cast<uint64_t>(message->root_sequence) + message->sender);
    mixed_ = Mix(mixed_, static_cast<uint64_t>(message->tick));
  }
  vm::NeighbourMessage& message = output->message;
  message.sender = id_;
  message.incarnation = 1;
  message.tick = input.tick;
  message.program_hash = kFakeProgram;
  message.root_sequence = static_cast<int64_t>(mixed_ >> 1);
  message.num_links = 2;
  message.num_body_entries = static_cast<uint8_t>(mixed_ % 40);
  for (int i = 0; i < message.num_body_entries; ++i) message.body_entries[i].stamp = input.tick;
  for (size_t j = 0; j < 2; ++j) {
    output->joints[j].mode = vm::ActuatorMode::kPosition;
    output->joints[j].target = Unit(Mix(mixed_, j));
    output->joints[j].speed = 1;
  }
  output->status.changed = mixed_ % 5 == 0;
  output->status.num_faults = static_cast<uint8_t>(mixed_ % 8);
  for (int i = 0; i < output->status.num_faults; ++i) {
    output->status.faults[i].code = vm::FaultCode::kTargetClamped;
    output->status.faults[i].line = static_cast<uint16_t>(input.tick);
  }
}

void FakeController::TakePiece(const morphbus::deploy_piece_t& piece) {
  deployed.insert(deployed.end(), piece.bytes.begin(), piece.bytes.end());
}

std::vector<morphbus::status_t> FakeController::Describe(const vm::StatusReport& report,
                                                         bool inspected) {
  StatusNames names;
  names.type_name = "FAKE";
  if (inspected) inspected_at.push_back(computed.back());
  // What it holds follows from its inputs, as a VM's does.
  const HeldState held = {{{"mixed", "int", std::to_string(mixed_)}}, {}};
  return ToStatus(report, names, id_, 1, 2, inspected ? &held : nullptr);
}

void FakeController::Save(std::vector<uint8_t>* out) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(&mixed_);
  out->insert(out->end(), bytes, bytes + sizeof mixed_);
}

bool FakeController::Load(const uint8_t* data, size_t size) {
  if (size != sizeof mixed_) return false;
  std::memcpy(&mixed_, data, sizeof mixed_);
  return true;
}

SimParticipantOptions FakeRun::SimOptions() const {
  SimParticipantOptions sim_options;
  sim_options.run = options.run;
  sim_options.model_hash = kFakeModel;
  sim_options.program_hash = kFakeProgram;
  for (int i = 0; i < options.modules; ++i) {
    sim_options.modules.push_back(
        {"m" + std::to_string(i + 1), static_cast<uint16_t>(i), "FAKE", kFakeKinematics, 2});
  }
  sim_options.logger = options.logger;
  sim_options.num_ticks = options.ticks;
  sim_options.realtime = options.realtime;
  sim_options.speed = options.speed;
  sim_options.timing = options.timing;
  return sim_options;
}

ModuleParticipantOptions FakeRun::ModuleOptions(int i) const {
  ModuleParticipantOptions module_options;
  module_options.run = options.run;
  module_options.module = "m" + std::to_string(i + 1);
  module_options.module_id = static_cast<uint16_t>(i);
  module_options.type_name = "FAKE";
  module_options.num_joints = 2;
  module_options.num_connectors = 2;
  module_options.model_hash = kFakeModel;
  module_options.kinematics_hash = kFakeKinematics;
  module_options.program_hash = kFakeProgram;
  module_options.claim = 100 + i;
  module_options.realtime = options.realtime;
  module_options.timing = options.timing;
  return module_options;
}

std::unique_ptr<FakeRun::Seat> FakeRun::MakeSeat(uint64_t seed) {
  return std::make_unique<Seat>(options.connect ? options.connect() : hub.Connect(), options.key,
                                WithLoss(options.faults, options.loss, seed),
                                [this] { return clock->NowUs(); });
}

FakeRun::FakeRun(const FakeRunOptions& o) : options(o), robot(o.modules) {
  clock = options.connect ? static_cast<const TimeSource*>(&wall) : &time;
  uint64_t seed = options.seed;
  sim_seat = MakeSeat(seed++);
  sim = std::make_unique<SimParticipant>(&sim_seat->bus, &robot, clock, SimOptions());
  for (int i = 0; i < options.modules; ++i) {
    Module& module = modules.emplace_back();
    module.seat = MakeSeat(seed++);
    module.controller = std::make_unique<FakeController>(static_cast<uint16_t>(i));
    module.participant = std::make_unique<ModuleParticipant>(
        &module.seat->bus, module.controller.get(), clock, ModuleOptions(i));
  }
  if (!options.logger) return;
  log_seat = MakeSeat(seed++);
  LogParticipantOptions log_options;
  log_options.run = options.run;
  log_options.model_hash = kFakeModel;
  log_options.realtime = options.realtime;
  log_options.timing = options.timing;
  log = std::make_unique<LogParticipant>(&log_seat->bus, clock, log_options,
                                         [this](const LoggedMessage& m) {
                                           ++logged;
                                           logged_duplicates += m.duplicate ? 1 : 0;
                                           logged_bad += m.bad ? 1 : 0;
                                           logged_refused += m.refused ? 1 : 0;
                                         });
}

FakeRun::~FakeRun() = default;

std::vector<Participant*> FakeRun::participants() {
  std::vector<Participant*> all;
  for (Module& module : modules) all.push_back(module.participant.get());
  if (log != nullptr) all.push_back(log.get());
  // Last, so that all have subscribed when it begins.
  all.push_back(sim.get());
  return all;
}

std::vector<const Ledger*> FakeRun::ledgers() const {
  std::vector<const Ledger*> all;
  for (const Module& module : modules) all.push_back(&module.participant->ledger());
  if (log != nullptr) all.push_back(&log->ledger());
  all.push_back(&sim->ledger());
  return all;
}

bool FakeRun::Run() {
  return RunUntil([this] {
    for (const Participant* participant : participants()) {
      if (!participant->done()) return false;
    }
    return true;
  });
}

LateMessages FakeRun::Late() const {
  std::vector<FaultyBus*> buses;
  for (const Module& module : modules) {
    if (module.seat != nullptr) buses.push_back(&module.seat->bus);
  }
  for (const auto* seat : {&sim_seat, &log_seat}) {
    if (*seat != nullptr) buses.push_back(&(*seat)->bus);
  }
  return LateMessages(std::move(buses));
}

bool FakeRun::RunUntil(const std::function<bool()>& finished) {
  if (!started) {
    for (Participant* participant : participants()) participant->Start();
  }
  started = true;
  while (!finished()) {
    if (options.connect) {
      // One thread has its turn on every bus; the first one waits a little if nothing moves.
      int count = sim_seat->bus.Handle(0) + (log_seat != nullptr ? log_seat->bus.Handle(0) : 0);
      for (Module& module : modules) count += module.seat->bus.Handle(0);
      if (count == 0) sim_seat->bus.Handle(1);
      Late().OnTime();
      for (Participant* participant : participants()) participant->OnTime();
      continue;
    }
    if (hub.HandleRound() > 0) continue;
    int64_t next = Late().next_deadline_us();
    for (const Participant* participant : participants())
      next = std::min(next, participant->next_deadline_us());
    if (next == kNever) return false;
    time.AdvanceTo(next);
    Late().OnTime();
    for (Participant* participant : participants()) participant->OnTime();
  }
  return true;
}

}  // namespace morphbus::bridge
