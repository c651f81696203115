#include "bridge/module_node.h"

#include <sys/random.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <utility>

#include "bridge/bus_adapters.h"
#include "bridge/lcm_bus.h"
#include "bridge/module_party.h"
#include "bridge/snapshot_file.h"
#include "bridge/vm_brain.h"
#include "vm/limits.h"
#include "vm/verifier.h"

namespace morphbus::bridge {
namespace {

constexpr int kDone = 0, kUnusable = 2, kFailed = 3;

/// In real time, what a mate said holds for so many ticks when its message is late or lost.
constexpr uint16_t kRealtimeGraceTicks = 3;

volatile bool stop_requested = false;  // Written by the signal handler only.

void OnSignal(int) { stop_requested = true; }

int Complain(int status, const std::string& what) {
  std::fprintf(stderr, "morphbus-module: error: %s\n", what.c_str());
  return status;
}

Result<std::vector<uint8_t>> ReadImage(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail("cannot read " + path + ": " + std::strerror(errno));
  std::vector<uint8_t> bytes;
  // One byte beyond the largest image is enough to see that it is too large.
  char byte = 0;
  while (bytes.size() <= vm::kMaxImageBytes && file.get(byte)) {
    bytes.push_back(static_cast<uint8_t>(byte));
  }
  if (bytes.size() > vm::kMaxImageBytes) {
    return Fail(path + " is larger than an image can be (" + std::to_string(vm::kMaxImageBytes) +
                " bytes)");
  }
  return bytes;
}

std::string Refusal(const std::string& path, const vm::VerifyError& error) {
  return path + " is not a usable image: at byte " + std::to_string(error.offset) + ": " +
         error.message;
}

int64_t RandomClaim() {
  int64_t claim = 0;
  if (getrandom(&claim, sizeof claim, 0) != sizeof claim) claim = 0;
  return claim == 0 ? 1 : claim;  // 0 means "none yet" to the sim.
}

/// An image of a module type, shared by the process's modules of that type.
struct Kinematics {
  std::vector<uint8_t> bytes;
  vm::VerifiedKinematics verified;
};

/// One module with all it needs; stays where it is.
struct Seat {
  std::unique_ptr<Bus> bus;
  std::unique_ptr<VmBrain> brain;
  std::unique_ptr<SnapshotFile> snapshot;
  std::unique_ptr<ModuleParty> party;
};

class ModuleNode {
 public:
  explicit ModuleNode(const ModuleNodeOptions& options) : options_(options) {}
  int Run();

 private:
  Result<void> LoadProgram();
  Result<const vm::VerifiedKinematics*> LoadKinematics(const std::string& path);
  Result<void> AddModule(const ModuleChoice& choice);
  Result<void> AttachSnapshot(const std::string& name, Seat* seat);
  [[nodiscard]] bool IsRoot(const ModuleChoice& choice) const;

  const ModuleNodeOptions& options_;
  MonotonicTime time_;
  int64_t discarded_ = 0;
  std::vector<uint8_t> program_bytes_;
  vm::VerifiedProgram program_;
  std::map<std::string, std::unique_ptr<Kinematics>> kinematics_;
  std::unique_ptr<Bus> lcm_;
  std::unique_ptr<LossyBus> lossy_;
  std::unique_ptr<BusMux> mux_;
  std::vector<Seat> seats_;
};

bool ModuleNode::IsRoot(const ModuleChoice& choice) const {
  return options_.root_link.has_value() &&
         (options_.root_module.empty() || options_.root_module == choice.name);
}

Result<void> ModuleNode::LoadProgram() {
  Result<std::vector<uint8_t>> bytes = ReadImage(options_.program_file);
  if (!bytes) return Fail(bytes.error().message);
  program_bytes_ = std::move(*bytes);
  const vm::VerifyError error = vm::Verifier::Verify(
      program_bytes_.data(), static_cast<uint32_t>(program_bytes_.size()), &program_);
  if (error.message != nullptr) return Fail(Refusal(options_.program_file, error));
  return {};
}

Result<const vm::VerifiedKinematics*> ModuleNode::LoadKinematics(const std::string& path) {
  std::unique_ptr<Kinematics>& entry = kinematics_[path];
  if (entry != nullptr) return &entry->verified;
  Result<std::vector<uint8_t>> bytes = ReadImage(path);
  if (!bytes) return Fail(bytes.error().message);
  entry = std::make_unique<Kinematics>();
  entry->bytes = std::move(*bytes);
  const vm::VerifyError error = vm::VerifyKinematics(
      entry->bytes.data(), static_cast<uint32_t>(entry->bytes.size()), &entry->verified);
  if (error.message != nullptr) return Fail(Refusal(path, error));
  return &entry->verified;
}

Result<void> ModuleNode::AttachSnapshot(const std::string& name, Seat* seat) {
  if (options_.snapshot_file.empty()) return {};
  const std::string path =
      options_.modules.size() == 1 ? options_.snapshot_file : options_.snapshot_file + "." + name;
  Result<SnapshotFile> file = SnapshotFile::Open(path);
  if (!file) return Fail(file.error().message);
  seat->snapshot = std::make_unique<SnapshotFile>(std::move(*file));
  if (options_.resume) {
    const std::vector<uint8_t> snapshot = seat->snapshot->Read();
    // Killed before it had begun: there is nothing to go on from, and nothing was published.
    if (!snapshot.empty()) {
      if (Result<void> r = seat->party->ResumeFrom(snapshot); !r) {
        return Fail(path + ": " + r.error().message);
      }
    }
  }
  seat->party->OnBeforePublish([snapshot = seat->snapshot.get()](
                                   const std::vector<uint8_t>& bytes) { snapshot->Write(bytes); });
  return {};
}

Result<void> ModuleNode::AddModule(const ModuleChoice& choice) {
  if (Result<void> r = CheckModuleName(choice.name); !r) return r;
  const Result<const vm::VerifiedKinematics*> kinematics = LoadKinematics(choice.kinematics_file);
  if (!kinematics) return Fail(kinematics.error().message);
  const vm::VerifiedKinematics& type = **kinematics;
  vm::VmConfig config;
  config.module_id = choice.id;
  config.incarnation = options_.incarnation;
  config.grace_ticks = options_.realtime ? kRealtimeGraceTicks : 0;
  config.is_root = IsRoot(choice);
  if (config.is_root) {
    if (*options_.root_link >= type.num_links()) {
      return Fail(choice.name + " has " + std::to_string(type.num_links()) + " links, no link " +
                  std::to_string(*options_.root_link));
    }
    config.root_link = *options_.root_link;
    config.X_RL_root = options_.X_RL_root;
  }
  Seat& seat = seats_.emplace_back();
  seat.bus = mux_->Connect();
  seat.brain = std::make_unique<VmBrain>(config, type, program_);
  ModulePartyOptions party;
  party.run = options_.run;
  party.module = choice.name;
  party.module_id = choice.id;
  party.incarnation = options_.incarnation;
  party.type_name = std::string(type.type_name().data, type.type_name().size);
  party.num_joints = type.num_joints();
  party.num_connectors = type.num_connectors();
  party.model_hash = type.model_hash();
  party.kinematics_hash = type.hash();
  party.program_hash = program_.hash();
  party.claim = RandomClaim();
  party.realtime = options_.realtime;
  party.build = options_.build;
  party.timing = options_.timing;
  seat.party = std::make_unique<ModuleParty>(seat.bus.get(), seat.brain.get(), &time_, party);
  return AttachSnapshot(choice.name, &seat);
}

int ModuleNode::Run() {
  if (Result<void> r = CheckRunName(options_.run); !r)
    return Complain(kUnusable, r.error().message);
  if (Result<void> r = LoadProgram(); !r) return Complain(kUnusable, r.error().message);
  Result<std::unique_ptr<Bus>> lcm = OpenLcmBus(options_.lcm_url);
  if (!lcm) return Complain(kUnusable, lcm.error().message);
  lcm_ = std::move(*lcm);
  Bus* bus = lcm_.get();
  if (options_.loss > 0) {
    lossy_ = std::make_unique<LossyBus>(bus, options_.loss, options_.seed, &discarded_);
    bus = lossy_.get();
  }
  mux_ = std::make_unique<BusMux>(bus);
  std::vector<Party*> parties;
  for (const ModuleChoice& choice : options_.modules) {
    if (Result<void> r = AddModule(choice); !r) return Complain(kUnusable, r.error().message);
  }
  for (const Seat& seat : seats_) parties.push_back(seat.party.get());
  RunParties(bus, time_, parties, &stop_requested, [this] {
    for (const Seat& seat : seats_) seat.party->PublishHealth();
  });
  int status = kDone;
  for (const Seat& seat : seats_) {
    if (!seat.party->error().empty()) status = Complain(kFailed, seat.party->error());
  }
  return status;
}

}  // namespace

int RunModuleNode(const ModuleNodeOptions& options) {
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  ModuleNode node(options);
  return node.Run();
}

}  // namespace morphbus::bridge
