// Writes what one module of a logged run sensed and heard, and what its VM said, for an emulated
// microcontroller to do again (test/micro/cortex_m.py).
// Usage: record_ticks LOG MODULE FOLDER

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "compiler/model/run_description.pb.h"
#include "logger/compare/module_rerun.h"
#include "logger/log/run_log.h"
#include "test/micro/tick_record.h"

namespace morphbus::test {
namespace {

void Save(const std::string& path, const void* bytes, size_t size) {
  std::ofstream file(path, std::ios::binary);
  file.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(size));
}

/// The most of each kind that any message of the run held, by which a profile is chosen.
struct Most {
  int neighbours = 0, entries = 0, invocations = 0, acks = 0;
  void See(const vm::NeighbourMessage& message) {
    entries = std::max<int>(entries, message.num_body_entries);
    invocations = std::max<int>(invocations, message.num_invocations);
    acks = std::max<int>(acks, message.num_acks);
  }
};

int Record(const std::string& path, const std::string& name, const std::string& folder) {
  const Result<logger::RunLog> log = logger::LoadRunLog(path);
  if (!log) return std::fprintf(stderr, "%s\n", log.error().message.c_str()), 1;
  int module = 0;
  while (module < static_cast<int>(log->modules.size()) && log->modules[module].name != name)
    ++module;
  if (module == static_cast<int>(log->modules.size())) {
    return std::fprintf(stderr, "no module %s\n", name.c_str()), 1;
  }
  std::vector<uint8_t> buffer(1 << 16);
  std::ofstream inputs(folder + "/input.bin", std::ios::binary);
  std::ofstream outputs(folder + "/expected.bin", std::ios::binary);
  const auto save = [&](std::ofstream* file, const ByteWriter& writer) {
    const auto size = static_cast<uint16_t>(writer.size());
    file->write(reinterpret_cast<const char*>(&size), 2);
    file->write(reinterpret_cast<const char*>(buffer.data()), size);
  };
  bool first = true;
  int64_t ticks = 0;
  Most most;
  const auto of_vm_alone = std::make_unique<vm::TickOutput>();
  const auto visit = [&](const logger::ComputedTick& tick) {
    if (first) {
      ByteWriter config(buffer.data());
      PutConfig(tick.config, &config);
      Save(folder + "/config.bin", buffer.data(), static_cast<size_t>(config.size()));
      // Only what a module needs; the notes stay with the tools.
      Save(folder + "/image.bin", tick.program.bytes(), tick.program.run_size());
      proto::RunDescription description;
      description.ParseFromString(log->description);
      const vm::Text type = tick.kinematics.type_name();
      for (const proto::KinematicsImage& image : description.kinematics()) {
        if (image.type_name() != std::string(type.data, type.size)) continue;
        Save(folder + "/kinematics.bin", image.image().data(), image.image().size());
      }
      first = false;
    }
    ByteWriter input(buffer.data());
    PutInput(tick.input, tick.kinematics.num_joints(), tick.kinematics.num_connectors(), &input);
    save(&inputs, input);
    // The boards run the VM alone; what a module's process adds is how programs spread.
    *of_vm_alone = tick.output;
    of_vm_alone->message.fragment = {};
    ByteWriter output(buffer.data());
    PutOutput(*of_vm_alone, tick.kinematics.num_joints(), &output);
    save(&outputs, output);
    int neighbours = 0;
    for (const vm::NeighbourMessage* message : tick.input.messages) {
      if (message == nullptr) continue;
      ++neighbours;
      most.See(*message);
    }
    most.See(tick.output.message);
    most.neighbours = std::max(most.neighbours, neighbours);
    ++ticks;
  };
  const Result<logger::RerunSummary> done = logger::RerunModule(*log, module, {visit, {}});
  if (!done) return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;
  std::printf("ticks %ld neighbours %d entries %d invocations %d acks %d\n",
              static_cast<long>(ticks), most.neighbours, most.entries, most.invocations, most.acks);
  return 0;
}

}  // namespace
}  // namespace morphbus::test

int main(int argc, char** argv) {
  if (argc != 4) return std::fprintf(stderr, "usage: record_ticks LOG MODULE FOLDER\n"), 2;
  return morphbus::test::Record(argv[1], argv[2], argv[3]);
}
