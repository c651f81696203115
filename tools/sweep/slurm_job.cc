#include "tools/sweep/slurm_job.h"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "compiler/base/quantity.h"
#include "tools/base/files.h"
#include "tools/sweep/sweep_estimate.h"

namespace morphbus::tools {
namespace {

/// Of the files; goes up with every change of what they mean.
constexpr int kJobVersion = 1;

/// Where the state of a job lies.
std::string StatePath(const std::string& folder) { return folder + "/job.json"; }

/// Writes the chunks of a job, one after the other.
class JobWriter {
 public:
  JobWriter(SlurmJob* job, const std::vector<SlurmRow>& rows, const ChunkSize& size,
            RowSource* source)
      : job_(*job), rows_(rows), size_(size), source_(*source) {
    const auto count = static_cast<int64_t>(rows.size());
    // Rows of another number of tries begin a chunk of their own, so that some more are needed.
    const int64_t chunks = std::max(1, size.most_chunks - 3);
    least_rows_ = (count + chunks - 1) / chunks;
  }

  /// Whether it has written all of them.
  Result<bool> Write() {
    for (const SlurmRow& row : rows_) {
      if (!source_.GoOn()) return false;
      Result<RowInputs> inputs = source_.Inputs(row.task.key);
      if (!inputs) return Fail(inputs.error().message);
      RowTask task = row.task;
      task.inputs = std::move(*inputs);
      // How large chunks become follows from the first row's speed.
      if (rate_ == 0) rate_ = WallTimeOfSecond(&source_, task);
      if (Result<void> put = Put(task, row.tries); !put) return Fail(put.error().message);
    }
    if (Result<void> ended = EndChunk(); !ended) return Fail(ended.error().message);
    return source_.GoOn();
  }

 private:
  Result<void> Put(const RowTask& task, int tries) {
    // A chunk ends once it takes long enough, and where there would be too many of them otherwise
    // not before it has enough rows.
    const bool full = file_ && job_.tasks.back().rows >= least_rows_ && seconds_ >= size_.seconds;
    if (file_ && (full || job_.tasks.back().tries != tries)) {
      if (Result<void> ended = EndChunk(); !ended) return ended;
    }
    if (!file_) {
      if (Result<void> begun = BeginChunk(tries); !begun) return begun;
    }
    const Result<std::string> lines =
        writer_.LinesOf(task, [this](const std::string& hash) { return source_.Part(hash); });
    if (!lines) return Fail(lines.error().message);
    SlurmTask& last = job_.tasks.back();
    last.left.insert(task.key);
    ++last.rows;
    seconds_ += rate_ * SimSecondsOf(task.inputs);
    return file_->Write(*lines);
  }

  Result<void> BeginChunk(int tries) {
    const int number = static_cast<int>(job_.tasks.size()) + 1;
    // Slurm will know of this task: if it does not, it has ended.
    job_.tasks.emplace_back(number, tries, job_.ResultsPath(number)).seen = true;
    // A file that is there from the beginning is seen to grow on every file system.
    if (Result<void> made = WriteFile(job_.ResultsPath(number), ""); !made) return made;
    Result<std::unique_ptr<OutputFile>> file = OutputFile::Create(job_.ChunkPath(number));
    if (!file) return Fail(file.error().message);
    file_ = std::move(*file);
    writer_ = ChunkWriter();
    seconds_ = 0;
    return {};
  }

  Result<void> EndChunk() {
    Result<void> closed = file_ ? file_->Close() : Result<void>();
    file_.reset();
    return closed;
  }

  SlurmJob& job_;
  const std::vector<SlurmRow>& rows_;
  const ChunkSize& size_;
  RowSource& source_;
  int64_t least_rows_ = 1;
  /// Wall time of a simulated second; 0: not known yet.
  double rate_ = 0;
  std::unique_ptr<OutputFile> file_;
  ChunkWriter writer_;
  double seconds_ = 0;
};

/// Calls `each` for the key of every row of a chunk.
void EachKey(const std::string& path, const std::function<void(const std::string&)>& each) {
  std::ifstream chunk(path, std::ios::binary);
  for (std::string line; std::getline(chunk, line);) {
    const Json json = Json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("row")) continue;
    const auto key = json.find("key");
    if (key != json.end() && key->is_string()) each(key->get<std::string>());
  }
}

}  // namespace

std::string SlurmJob::ChunkPath(int task) const { return fmt::format("{}/chunk-{}", folder, task); }
std::string SlurmJob::ResultsPath(int task) const {
  return fmt::format("{}/results-{}", folder, task);
}
std::string SlurmJob::OutputPath(int task) const {
  return fmt::format("{}/task-{}.out", folder, task);
}
std::string SlurmJob::ScriptPath() const { return folder + "/task.sh"; }

Result<std::optional<SlurmJob>> WriteJob(const std::string& folder, const std::string& name,
                                         const std::vector<SlurmRow>& rows, const ChunkSize& size,
                                         RowSource* source) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Fail(fmt::format("cannot make {}: {}", folder, error.message()));
  SlurmJob job = {folder, name, "", {}, {}};
  const Result<bool> written = JobWriter(&job, rows, size, source).Write();
  if (!written) return Fail(written.error().message);
  return *written ? std::optional(std::move(job)) : std::nullopt;
}

std::vector<std::string> JobFolders(const std::string& folder) {
  std::error_code unknown;
  std::vector<std::string> folders;
  for (const auto& entry : std::filesystem::directory_iterator(folder, unknown)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("job-") && ReadNumber<int>(std::string_view(name).substr(4)))
      folders.push_back(entry.path().string());
  }
  return folders;
}

void RemoveJob(const std::string& folder) {
  std::error_code unknown;
  // A file of results is the first thing that is written.
  for (const auto& entry : std::filesystem::directory_iterator(folder, unknown)) {
    if (!entry.path().filename().string().starts_with("results-")) continue;
    std::filesystem::remove_all(folder, unknown);
    return;
  }
  // This one removes nothing but an empty folder.
  std::filesystem::remove(folder, unknown);
}

Result<void> WriteJobState(const SlurmJob& job) {
  Json tries = Json::array();
  for (const SlurmTask& task : job.tasks) tries.push_back(task.tries);
  return WriteFile(
      StatePath(job.folder),
      JsonText(Json{{"job", kJobVersion}, {"name", job.name}, {"id", job.id}, {"tries", tries}}) +
          "\n");
}

Result<std::optional<SlurmJob>> ReadJob(const std::string& folder,
                                        const std::function<bool(const std::string& key)>& wanted) {
  std::error_code unknown;
  if (!std::filesystem::exists(StatePath(folder), unknown)) return std::optional<SlurmJob>();
  const Result<std::string> text = ReadFile(StatePath(folder), size_t{16} << 20);
  if (!text) return Fail(text.error().message);
  const auto damaged = [&folder] { return Fail(StatePath(folder) + " is damaged"); };
  // Whatever the file holds, nothing is taken for what it is not.
  const Json json = Json::parse(*text, nullptr, false);
  if (!json.is_object() || json.value("job", Json()) != kJobVersion) return damaged();
  const Json name = json.value("name", Json()), id = json.value("id", Json());
  const Json tries = json.value("tries", Json());
  if (!name.is_string() || !id.is_string() || !tries.is_array()) return damaged();
  SlurmJob job = {folder, name.get<std::string>(), id.get<std::string>(), {}, {}};
  // Both become words of commands.
  const auto plain = [](char c) {
    return c == '-' || c == '_' || c == '.' || std::isalnum(c) != 0;
  };
  if (job.name.empty() || !std::ranges::all_of(job.name + job.id, plain)) return damaged();
  // Of each task there is how often its rows were tried; which rows they are stands in its chunk.
  for (const Json& count : tries) {
    if (!count.is_number_integer()) return damaged();
    const int number = static_cast<int>(job.tasks.size()) + 1;
    const auto before = static_cast<int>(std::clamp<int64_t>(count.get<int64_t>(), 1, 1000));
    SlurmTask task(number, before, job.ResultsPath(number));
    EachKey(job.ChunkPath(number), [&](const std::string& key) {
      ++task.rows;
      if (wanted(key)) task.left.insert(key);
    });
    job.tasks.push_back(std::move(task));
  }
  return std::optional(std::move(job));
}

std::string TaskScript(const SlurmJob& job, const std::string& binary, int jobs, double timeout_s) {
  const std::string program = ShellWord(binary);
  return fmt::format(
      "#!/bin/sh\n"
      "# A task of a sweep: runs the rows of its chunk (morphbus sweep has written this).\n"
      "if ! command -v {0} >/dev/null; then\n"
      "  echo \"there is no program \"{0}\" on $(uname -n)\" >&2\n"
      "  exit 127\n"
      "fi\n"
      "exec {0} sweep worker {1}/chunk-\"$SLURM_ARRAY_TASK_ID\" -o "
      "{1}/results-\"$SLURM_ARRAY_TASK_ID\" --jobs {2}{3}\n",
      program, ShellWord(job.folder), jobs,
      timeout_s > 0 ? fmt::format(" --timeout {}", timeout_s) : "");
}

Result<std::string> NewJobName(const std::string& folder) {
  uint32_t random = 0;
  if (getrandom(&random, sizeof random, 0) != sizeof random) {
    return Fail(fmt::format("cannot name the job: {}", std::strerror(errno)));
  }
  std::string stem = std::filesystem::path(folder).filename().string();
  stem = stem.substr(0, std::min<size_t>(stem.find('.'), 40));
  std::ranges::replace_if(
      stem, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return fmt::format("morphbus-{}-{:08x}", stem, random);
}

}  // namespace morphbus::tools
