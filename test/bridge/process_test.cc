// The module process over real LCM. Runs in a network of its own (test/support/netns.sh).

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/lcm_bus.h"
#include "bridge/lockstep/log/log_participant.h"
#include "bridge/lockstep/sim/sim_participant.h"
#include "test/bridge/fake_images.h"
#include "test/bridge/fake_run.h"
#include "test/bridge/lossy_bus.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"

extern char** environ;

namespace morphbus::bridge {
namespace {

void WriteFile(const std::string& path, const std::vector<uint8_t>& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

pid_t Spawn(std::vector<std::string> arguments, const std::string& stderr_path) {
  std::string program = MORPHBUS_MODULE_PROGRAM;
  std::vector<char*> argv = {program.data()};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 2, stderr_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0600);
  pid_t pid = -1;
  EXPECT_EQ(posix_spawn(&pid, program.c_str(), &files, nullptr, argv.data(), environ), 0);
  posix_spawn_file_actions_destroy(&files);
  return pid;
}

int ExitOf(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

class ModuleProcess : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "module_process_" + std::to_string(getpid());
    std::filesystem::create_directories(folder_);
    kinematics_ = FakeKinematics();
    program_ = EmptyProgram();
    WriteFile(folder_ + "/FAKE.kinematics", kinematics_);
    WriteFile(folder_ + "/program.image", program_);
    WriteFile(folder_ + "/key", {1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});  // FakeRun's.
    ASSERT_EQ(chmod((folder_ + "/key").c_str(), 0600), 0);
    ASSERT_EQ(vm::VerifyKinematics(kinematics_.data(), static_cast<uint32_t>(kinematics_.size()),
                                   &verified_kinematics_)
                  .message,
              nullptr);
    ASSERT_EQ(vm::Verifier::Verify(program_.data(), static_cast<uint32_t>(program_.size()),
                                   &verified_program_)
                  .message,
              nullptr);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<std::string> Arguments(const std::string& modules, const std::string& ids) const {
    std::vector<std::string> arguments = {"--run",        "test",
                                          "--modules",    modules,
                                          "--id",         ids,
                                          "--kinematics", folder_ + "/FAKE.kinematics",
                                          "--program",    folder_ + "/program.image",
                                          "--key",        folder_ + "/key"};
    if (modules.substr(0, 2) == "m1") {
      arguments.insert(arguments.end(), {"--root-link", "0", "--root-pose", "-0.1,0,0,1,0,0,0",
                                         "--root-module", "m1"});
    }
    return arguments;
  }

  std::string ErrorFile(const std::string& module) const {
    return folder_ + "/" + module + ".stderr";
  }
  std::string Errors(const std::string& module) const {
    std::ifstream file(ErrorFile(module));
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// Each module in a process of its own, with further arguments.
  std::vector<pid_t> StartThree(const std::vector<std::string>& more = {}) {
    std::vector<pid_t> children;
    for (int i = 0; i < 3; ++i) {
      std::vector<std::string> arguments =
          Arguments("m" + std::to_string(i + 1), std::to_string(i));
      arguments.insert(arguments.end(), more.begin(), more.end());
      if (!more.empty() && more[0] == "--loss") {
        arguments.insert(arguments.end(), {"--seed", std::to_string(i + 1)});
      }
      children.push_back(Spawn(arguments, ErrorFile("m" + std::to_string(i + 1))));
    }
    return children;
  }

  /// Sim and logger in this process. `at_tick` is called before every tick, `on_asked` whenever
  /// somebody asks m2 for a message. Returns the run's hash.
  std::string RunSim(int64_t ticks, double loss = 0,
                     const std::function<void(int64_t)>& at_tick = {},
                     const std::function<void()>& on_asked = {}) {
    FakeRunOptions fake_options;
    fake_options.ticks = ticks;
    FakeRun fake(fake_options);  // For its options only.
    SimParticipantOptions options = fake.SimOptions();
    options.program_hash = verified_program_.hash();
    for (ExpectedModule& module : options.modules)
      module.kinematics_hash = verified_kinematics_.hash();
    auto lcm = OpenLcmBus("");
    EXPECT_TRUE(lcm) << lcm.error().message;
    SealedBus sealed(lcm->get(), fake_options.key);
    BusMux mux(&sealed);
    const auto sim_bus = mux.Connect(), log_bus = mux.Connect(), test_bus = mux.Connect();
    if (on_asked) {
      test_bus->Subscribe(Channel("test", "m2", Topic::kResend),
                          [&](std::string_view, const uint8_t*, size_t) { on_asked(); });
    }
    LossyBus sim_lossy(sim_bus.get(), loss, 11), log_lossy(log_bus.get(), loss, 12);
    FakeRobot robot(3);
    MonotonicTime time;
    SimParticipant sim(&sim_lossy, &robot, &time, options);
    sim.OnBeforeTick(at_tick);
    LogParticipantOptions log_options;
    log_options.run = "test";
    log_options.model_hash = kFakeModel;
    LogParticipant log(&log_lossy, &time, log_options, {});
    RunParticipants(lcm->get(), time, {&log, &sim}, nullptr, {});
    EXPECT_TRUE(sim.outcome().ok) << sim.outcome().error;
    EXPECT_EQ(sim.outcome().ticks, ticks);
    EXPECT_EQ(sim.outcome().recorded_hash, sim.outcome().run_hash);
    EXPECT_TRUE(log.complete());
    return sim.outcome().run_hash;
  }

  /// A run of 100 ticks with three undisturbed processes.
  std::string Reference() {
    const std::vector<pid_t> children = StartThree();
    const std::string hash = RunSim(100);
    for (const pid_t child : children) EXPECT_EQ(ExitOf(child), 0);
    return hash;
  }

  std::string folder_;
  std::vector<uint8_t> kinematics_, program_;
  vm::VerifiedKinematics verified_kinematics_;
  vm::VerifiedProgram verified_program_;
};

TEST_F(ModuleProcess, ThreeProcessesOneProcessAndLossGiveTheSameHash) {
  const std::string reference = Reference();
  EXPECT_EQ(Errors("m1") + Errors("m2") + Errors("m3"), "");
  const pid_t all = Spawn(Arguments("m1,m2,m3", "0,1,2"), ErrorFile("all"));
  EXPECT_EQ(RunSim(100), reference);
  EXPECT_EQ(ExitOf(all), 0) << Errors("all");
  const std::vector<pid_t> children = StartThree({"--loss", "0.2"});
  EXPECT_EQ(RunSim(100, 0.2), reference);
  for (const pid_t child : children) EXPECT_EQ(ExitOf(child), 0);
}

TEST_F(ModuleProcess, KilledAndResumedItChangesNoPayload) {
  const std::string reference = Reference();
  std::vector<pid_t> children;
  const auto arguments = [this](int i, bool resume) {
    const std::string name = "m" + std::to_string(i + 1);
    std::vector<std::string> all = Arguments(name, std::to_string(i));
    all.insert(all.end(), {"--snapshot", folder_ + "/" + name + ".snapshot"});
    if (resume) all.emplace_back("--resume");
    return all;
  };
  for (int i = 0; i < 3; ++i) children.push_back(Spawn(arguments(i, false), ErrorFile("m")));
  EXPECT_EQ(RunSim(100, 0,
                   [&](int64_t tick) {
                     if (tick % 9 != 8) return;
                     const auto victim = static_cast<size_t>(tick / 9 % 3);
                     kill(children[victim], SIGKILL);
                     EXPECT_EQ(ExitOf(children[victim]), 128 + SIGKILL);
                     children[victim] =
                         Spawn(arguments(static_cast<int>(victim), true), ErrorFile("m"));
                   }),
            reference);
  for (const pid_t child : children) EXPECT_EQ(ExitOf(child), 0) << Errors("m");
}

TEST_F(ModuleProcess, StoppedAndContinuedItGoesOn) {
  const std::string reference = Reference();
  const std::vector<pid_t> children = StartThree({});
  // It is stopped until the others ask for what it owes them. That being asleep for longer than it
  // waits for the sim does no harm is shown in virtual time (AModuleStoppedForAnHourGoesOn).
  bool stopped = false;
  int asked_in_vain = 0;
  EXPECT_EQ(RunSim(
                100, 0,
                [&](int64_t tick) {
                  if (tick != 50) return;
                  kill(children[1], SIGSTOP);
                  stopped = true;
                },
                [&] {
                  if (!stopped) return;
                  ++asked_in_vain;
                  stopped = false;
                  kill(children[1], SIGCONT);
                }),
            reference);
  EXPECT_EQ(asked_in_vain, 1);
  for (const pid_t child : children) EXPECT_EQ(ExitOf(child), 0);
}

TEST_F(ModuleProcess, WithoutASimItGivesUpWithStatusThree) {
  std::vector<std::string> arguments = Arguments("m2", "1");
  arguments.insert(arguments.end(), {"--give-up", "1"});
  EXPECT_EQ(ExitOf(Spawn(arguments, ErrorFile("m2"))), 3);
  EXPECT_EQ(Errors("m2"),
            "morphbus-module: error: nothing heard from the simulator of run 'test' any more\n");
}

TEST_F(ModuleProcess, DamagedImagesAreRefusedWithStatusTwo) {
  program_[program_.size() / 2] ^= 1;
  WriteFile(folder_ + "/program.image", program_);
  EXPECT_EQ(ExitOf(Spawn(Arguments("m2", "1"), ErrorFile("m2"))), 2);
  EXPECT_NE(Errors("m2").find("program.image is not a usable image: at byte "), std::string::npos)
      << Errors("m2");
  WriteFile(folder_ + "/program.image", EmptyProgram());
  WriteFile(folder_ + "/FAKE.kinematics", std::vector<uint8_t>(100, 7));
  EXPECT_EQ(ExitOf(Spawn(Arguments("m2", "1"), ErrorFile("m2"))), 2);
  WriteFile(folder_ + "/FAKE.kinematics", std::vector<uint8_t>(100000, 7));
  EXPECT_EQ(ExitOf(Spawn(Arguments("m2", "1"), ErrorFile("m2"))), 2);
  EXPECT_NE(Errors("m2").find("larger than " + std::to_string(vm::kMaxImageBytes)),
            std::string::npos)
      << Errors("m2");
  std::filesystem::remove(folder_ + "/FAKE.kinematics");
  EXPECT_EQ(ExitOf(Spawn(Arguments("m2", "1"), ErrorFile("m2"))), 2);
}

TEST_F(ModuleProcess, BadOptionsAreRefusedWithStatusTwo) {
  const std::vector<std::vector<std::string>> cases = {
      {"--loss", "2"},
      {"--root-link", "0"},
      {"--resume"},
      {"--lcm-url", "carrier://pigeon"},
      {"--nonsense"},
      {"--root-link", "0", "--root-pose", "0,0,0,1,1,0,0"},
      {"--root-link", "9", "--root-pose", "0,0,0,1,0,0,0"}};
  for (const std::vector<std::string>& more : cases) {
    std::vector<std::string> arguments = Arguments("m2", "1");
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(ExitOf(Spawn(arguments, ErrorFile("m2"))), 2) << more[0];
    EXPECT_NE(Errors("m2"), "") << more[0];
  }
  // What is expected is said with it.
  std::vector<std::string> arguments = Arguments("m2", "1");
  arguments.insert(arguments.end(), {"--loss", "20"});
  EXPECT_EQ(ExitOf(Spawn(arguments, ErrorFile("m2"))), 2);
  EXPECT_NE(Errors("m2").find("such as 0.2 or 20%, not '20'"), std::string::npos) << Errors("m2");
}

TEST_F(ModuleProcess, DiesWithItsParent) {
  std::array<int, 2> pipe_ends = {};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    close(pipe_ends[0]);
    // The write end goes to the module by inheritance: it closes when the module is gone.
    Spawn(Arguments("m2", "1"), ErrorFile("m2"));
    char go = 1;
    if (write(pipe_ends[1], &go, 1) != 1) _exit(1);
    pause();
    _exit(0);
  }
  close(pipe_ends[1]);
  char byte = 0;
  ASSERT_EQ(read(pipe_ends[0], &byte, 1), 1);
  kill(parent, SIGKILL);
  EXPECT_EQ(ExitOf(parent), 128 + SIGKILL);
  EXPECT_EQ(read(pipe_ends[0], &byte, 1), 0) << "end of file: the module is gone, too";
  close(pipe_ends[0]);
}

TEST_F(ModuleProcess, LinksNeitherProtobufNorBulletNorEigen) {
  const std::string command = std::string("readelf -d ") + MORPHBUS_MODULE_PROGRAM;
  FILE* output = popen(command.c_str(), "r");
  ASSERT_NE(output, nullptr);
  std::string text;
  std::array<char, 4096> chunk;
  while (const size_t n = fread(chunk.data(), 1, chunk.size(), output))
    text.append(chunk.data(), n);
  EXPECT_EQ(pclose(output), 0);
  EXPECT_NE(text.find("liblcm"), std::string::npos) << text;
  for (const char* heavy : {"protobuf", "Bullet", "LinearMath", "cairo", "fmt", "pugixml"}) {
    EXPECT_EQ(text.find(heavy), std::string::npos) << heavy;
  }
}

}  // namespace
}  // namespace morphbus::bridge
