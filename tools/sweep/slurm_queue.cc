#include "tools/sweep/slurm_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <string_view>
#include <utility>

#include "compiler/base/quantity.h"
#include "tools/machine/program_output.h"

namespace morphbus::tools {
namespace {

/// The columns that are asked for, with their widths.
constexpr std::array<std::pair<const char*, int>, 6> kColumns = {{{"ArrayTaskID", 16},
                                                                  {"ArrayJobID", 24},
                                                                  {"State", 24},
                                                                  {"exit_code", 16},
                                                                  {"BatchHost", 96},
                                                                  {"Reason", 96}}};

/// Slurm's own, if nobody has set another.
constexpr int kUsualArraySize = 1001;

/// "7:0", or as wait() has it: 1792.
int ExitStatusOf(std::string_view text) {
  const size_t colon = std::min(text.find(':'), text.size());
  const int code = ReadNumber<int>(text.substr(0, colon)).value_or(0);
  return colon < text.size() ? code : (code >> 8) & 0xff;
}

}  // namespace

bool SlurmTaskState::ended() const {
  static constexpr std::array<std::string_view, 9> kEnds = {
      "COMPLETED", "CANCELLED", "FAILED",   "TIMEOUT",      "NODE_FAIL",
      "PREEMPTED", "BOOT_FAIL", "DEADLINE", "OUT_OF_MEMORY"};
  return std::ranges::find(kEnds, state) != kEnds.end();
}

bool SlurmTaskState::held() const {
  // One that has never been looked at by the scheduler has no reason yet.
  static constexpr std::array<std::string_view, 11> kPass = {
      "",         "None",     "Resources", "Priority",    "BeginTime",        "Dependency",
      "Licenses", "Cleaning", "Prolog",    "Reservation", "JobArrayTaskLimit"};
  const bool waits = state == "PENDING" || state == "REQUEUE_HOLD" || state == "SPECIAL_EXIT";
  return waits && std::ranges::find(kPass, reason) == kPass.end();
}

SlurmQueue ReadQueue(const std::string& text) {
  SlurmQueue queue;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::array<std::string, kColumns.size()> cells;
    size_t at = 0;
    for (size_t i = 0; i < cells.size() && at < line.size(); ++i) {
      const auto width = static_cast<size_t>(kColumns[i].second);
      cells[i] = line.substr(at, width);
      cells[i].erase(cells[i].find_last_not_of(' ') + 1);
      at += width;
    }
    const std::optional<int> number = ReadNumber<int>(cells[0]);
    if (!number) continue;
    queue.id = cells[1];
    queue.tasks[*number] = {cells[2], cells[4] == "n/a" ? "" : cells[4], cells[5],
                            ExitStatusOf(cells[3])};
  }
  return queue;
}

Result<std::string> SubmitJob(const std::vector<std::string>& words) {
  std::vector<std::string> argv = {"sbatch", "--parsable"};
  argv.insert(argv.end(), words.begin(), words.end());
  const Result<ProgramOutput> done = RunProgram(std::move(argv), [] { return true; });
  if (!done) return Fail(done.error().message);
  // "17", or of one of several clusters "17;name".
  std::string id = LastLine(done->output);
  id = id.substr(0, id.find(';'));
  if (done->status == 0 && ReadNumber<int64_t>(id)) return id;
  const std::string words_of_sbatch =
      done->errors.substr(0, done->errors.find_last_not_of('\n') + 1);
  return Fail(words_of_sbatch.empty()
                  ? fmt::format("sbatch ended with status {} and no words", done->status)
                  : words_of_sbatch);
}

Result<SlurmQueue> AskQueue(const std::string& id, const std::string& name,
                            const std::function<bool()>& go_on) {
  std::string columns;
  for (const auto& [column, width] : kColumns) {
    columns += fmt::format("{}{}:{}", columns.empty() ? "" : ",", column, width);
  }
  std::vector<std::string> argv = {"squeue",         "-h", "-r",   "-t", "all",
                                   "--name=" + name, "-O", columns};
  if (id.empty()) {
    argv.emplace_back("--me");
  } else {
    argv.insert(argv.end(), {"-j", id});
  }
  const Result<ProgramOutput> done = RunProgram(std::move(argv), go_on);
  if (!done) return Fail(done.error().message);
  if (done->status == 0) return ReadQueue(done->output);
  if (done->errors.find("Invalid job id") != std::string::npos) return SlurmQueue();
  return Fail(LastLine(done->errors));
}

int MaxArraySize(const std::function<bool()>& go_on) {
  const Result<ProgramOutput> done = RunProgram({"scontrol", "show", "config"}, go_on);
  if (!done) return kUsualArraySize;
  std::istringstream lines(done->output);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("MaxArraySize")) continue;
    const size_t equals = line.find_last_of(" =");
    return std::max(2, ReadNumber<int>(line.substr(equals + 1)).value_or(kUsualArraySize));
  }
  return kUsualArraySize;
}

void CancelJob(const std::string& id, const std::string& name) {
  std::vector<std::string> argv = {"scancel", id};
  if (id.empty()) argv = {"scancel", "--me", "--name=" + name};
  static_cast<void>(RunProgram(std::move(argv), [] { return true; }));
}

}  // namespace morphbus::tools
