#include "bridge/module/module_process.h"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include "bridge/bus/bus_adapters.h"
#include "bridge/bus/lcm_bus.h"
#include "bridge/lockstep/late_messages.h"
#include "bridge/lockstep/participant.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/sealed_bus.h"
#include "compiler/base/read_file.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

// Exit statuses; RunModuleProcess explains them.
constexpr int kDone = 0, kUnusable = 2, kFailed = 3;

// Set by SIGINT and SIGTERM; the loop looks at it between events.
volatile bool stop_requested = false;  // Written by the signal handler only.

void OnSignal(int) { stop_requested = true; }

/// Says on stderr what is wrong and returns the exit status.
int Complain(int status, const std::string& what) {
  std::fprintf(stderr, "morphbus-module: error: %s\n", what.c_str());
  return status;
}

/// The bytes of a file, if an image can be that large.
Result<std::vector<uint8_t>> ReadImage(const std::string& path) {
  const Result<std::string> bytes = ReadWholeFile(path, vm::kMaxImageBytes);
  if (!bytes) return Fail("cannot read the image " + path + ": " + bytes.error().message);
  return std::vector<uint8_t>(bytes->begin(), bytes->end());
}

/// One module, its endpoint of the bus that the process's modules share, and its faults around it.
struct Entry {
  std::unique_ptr<Bus> endpoint;
  std::unique_ptr<FaultyBus> bus;
  std::unique_ptr<ModuleInstance> instance;
};

/// Everything that the process holds, in the order in which it must be destroyed last to first:
/// modules before the mux, the mux before the buses, images at the end.
class ModuleProcess {
 public:
  explicit ModuleProcess(const ModuleProcessOptions& options) : options_(options) {}
  /// Sets everything up and runs until the run is over. Returns the exit status.
  int Run();

 private:
  /// Reads and verifies the program and every type's kinematics, each file once.
  Result<void> LoadImages();
  /// Opens LCM, for all modules to share.
  Result<void> OpenBus();
  /// Makes a module and lets it join the run, resumed if that was asked for.
  Result<void> AddModule(const ModuleChoice& choice);
  /// Whether the module broadcasts the root's pose.
  [[nodiscard]] bool IsRoot(const ModuleChoice& choice) const;

  const ModuleProcessOptions& options_;
  MonotonicTime time_;
  ModuleImages images_;
  std::unique_ptr<Bus> lcm_, sealed_;
  std::unique_ptr<BusMux> mux_;  ///< Null for a module alone, which has the bus for itself.
  std::shared_ptr<NameDirectory> names_ = std::make_shared<NameDirectory>();
  std::vector<Entry> modules_;
  int status_ = kUnusable;  ///< Of a process that cannot begin.
};

bool ModuleProcess::IsRoot(const ModuleChoice& choice) const {
  return options_.root.has_value() &&
         (options_.root_module.empty() || options_.root_module == choice.name);
}

Result<void> ModuleProcess::LoadImages() {
  using Add = Result<void> (ModuleImages::*)(const std::string& name, std::vector<uint8_t> bytes);
  const auto load = [this](const std::string& file, Add add) {
    return ReadImage(file).and_then(
        [&](std::vector<uint8_t>&& bytes) { return (images_.*add)(file, std::move(bytes)); });
  };
  Result<void> loaded = load(options_.program_file, &ModuleImages::AddProgram);
  for (const ModuleChoice& choice : options_.modules) {
    if (!loaded || images_.FindKinematics(choice.kinematics_file) != nullptr) continue;
    loaded = load(choice.kinematics_file, &ModuleImages::AddKinematics);
  }
  return loaded;
}

Result<void> ModuleProcess::OpenBus() {
  Result<std::unique_ptr<Bus>> lcm = OpenRunBus(options_.lcm_url);
  if (!lcm) return Fail(lcm.error().message);
  lcm_ = std::move(*lcm);
  sealed_ = std::make_unique<SealedBus>(lcm_.get(), options_.key);
  if (options_.modules.size() > 1) mux_ = std::make_unique<BusMux>(sealed_.get());
  return {};
}

Result<void> ModuleProcess::AddModule(const ModuleChoice& choice) {
  ModuleSpec spec;
  // What the command line says of all modules, and of this one.
  static_cast<ModuleIdentity&>(spec) = options_;
  spec.names = names_;
  spec.module = choice.name;
  spec.module_id = choice.id;
  spec.incarnation = choice.incarnation;
  spec.claim = RandomClaim();
  spec.kinematics = choice.kinematics_file;
  if (IsRoot(choice)) spec.root = options_.root;
  // The instance is made and joined; its endpoint of the bus is its own.
  Result<std::unique_ptr<ModuleInstance>> instance = ModuleInstance::Create(images_, spec);
  if (!instance) return Fail(instance.error().message);
  Entry& entry = modules_.emplace_back();
  // Without --loss and --faults it passes everything on.
  Bus* bus = sealed_.get();
  if (mux_ != nullptr) {
    entry.endpoint = mux_->Connect();
    bus = entry.endpoint.get();
  }
  entry.bus = std::make_unique<FaultyBus>(bus, options_.faults, choice.name,
                                          [this] { return time_.NowUs(); });
  entry.instance = std::move(*instance);
  entry.instance->Join(entry.bus.get(), &time_);
  if (options_.snapshot_file.empty()) return {};
  // Several modules of one process save to one file each.
  const std::string suffix = options_.modules.size() == 1 ? "" : "." + choice.name;
  const std::string file = options_.snapshot_file + suffix;
  Result<void> saved = entry.instance->SaveTo(file, options_.resume);
  if (!saved && options_.resume) {
    status_ = kStateUnusable;
    unlink(file.c_str());
  }
  return saved;
}

int ModuleProcess::Run() {
  // Input that cannot be used is refused before the run hears of us.
  Result<void> ready =
      CheckRunName(options_.run).and_then([this] { return LoadImages(); }).and_then([this] {
        return OpenBus();
      });
  for (const ModuleChoice& choice : options_.modules) {
    if (ready) ready = AddModule(choice);
  }
  if (!ready) return Complain(status_, ready.error().message);
  // All modules share the process's thread and wake up together.
  std::vector<FaultyBus*> buses;
  for (const Entry& entry : modules_) buses.push_back(entry.bus.get());
  LateMessages late(buses);
  std::vector<Participant*> participants = {&late};
  for (const Entry& entry : modules_) participants.push_back(&entry.instance->participant());
  RunParticipants(sealed_.get(), time_, participants, &stop_requested, [this] {
    for (const Entry& entry : modules_) entry.instance->participant().PublishHealth();
  });
  // Every module says what became of it; one that failed makes the process fail.
  int status = kDone;
  for (const Entry& entry : modules_) {
    const std::string& error = entry.instance->participant().error();
    if (!error.empty()) status = Complain(kFailed, error);
  }
  return status;
}

}  // namespace

int RunModuleProcess(const ModuleProcessOptions& options) {
  // Either signal ends the loop between two events, so that snapshots and HEALTH stay whole.
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return ModuleProcess(options).Run();
}

}  // namespace morphbus::bridge
