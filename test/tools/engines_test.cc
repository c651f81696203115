// What the engines of a sweep read: the table of the file, chunks, results, hellos, the folder of a
// job of Slurm, and what Slurm says.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "compiler/base/version.h"
#include "sim/arithmetic.h"
#include "tools/base/files.h"
#include "tools/machine/program_output.h"
#include "tools/sweep/chunk_stream.h"
#include "tools/sweep/slurm_engine.h"
#include "tools/sweep/slurm_job.h"
#include "tools/sweep/slurm_queue.h"
#include "tools/sweep/sweep_file.h"

namespace morphbus::tools {
namespace {

/// A folder that is there for a test.
class EnginesTest : public testing::Test {
 protected:
  EnginesTest() {
    std::string name = testing::TempDir() + "enginesXXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~EnginesTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string Path(const std::string& name) const { return folder_ + "/" + name; }
  std::string folder_;
};

/// What the table says; the message of the first error instead of it.
std::pair<EngineSettings, std::string> TableOf(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText(
      "s.toml", "model = 'm'\nprogram = 'p'\nseconds = 1\n[engine]\n" + text + "\n");
  const auto sweep = ReadSweepFile(&sources, file, "s.toml", {}, &diagnostics);
  if (sweep) return {sweep->engine, ""};
  return {EngineSettings(), diagnostics.all().front().message};
}

TEST(EngineTableTest, ItSaysWhereRowsRun) {
  const EngineSettings slurm = TableOf(
                                   "kind = 'slurm'\npartition = 'p'\naccount = 'a'\ntime = "
                                   "'1:00:00'\ncpus = 4\nchunk = '90s'\n"
                                   "binary = '/opt/m'\noptions = ['--qos=low']\nhosts = ['a']")
                                   .first;
  EXPECT_EQ(slurm.kind, EngineKind::kSlurm);
  EXPECT_EQ(slurm.slurm.partition + slurm.slurm.account + slurm.slurm.time, "pa1:00:00");
  EXPECT_EQ(slurm.slurm.cpus, 4);
  EXPECT_EQ(slurm.slurm.chunk_s, 90);
  EXPECT_EQ(slurm.binary, "/opt/m");
  EXPECT_EQ(slurm.slurm.options, std::vector<std::string>{"--qos=low"});
  // What another engine needs may stand there, too.
  ASSERT_EQ(slurm.hosts.size(), 1u);
}

TEST(EngineTableTest, HostsHaveNamesPortsAndRowsAtATime) {
  const EngineSettings ssh =
      TableOf(
          "kind = 'ssh'\nhosts = ['a', 'user@b:2222/4', '2001:db8::1/2', {host = 'c:22', jobs = 3, "
          "binary = '/x'}]")
          .first;
  ASSERT_EQ(ssh.hosts.size(), 4u);
  EXPECT_EQ(ssh.hosts[0].address, "a");
  EXPECT_EQ(ssh.hosts[0].port + ssh.hosts[0].jobs, 0);
  EXPECT_EQ(ssh.hosts[1].address, "user@b");
  EXPECT_EQ(ssh.hosts[1].port, 2222);
  EXPECT_EQ(ssh.hosts[1].jobs, 4);
  EXPECT_EQ(ssh.hosts[2].address, "2001:db8::1");
  EXPECT_EQ(ssh.hosts[2].jobs, 2);
  EXPECT_EQ(ssh.hosts[3].address + ssh.hosts[3].binary, "c/x");
  EXPECT_EQ(ssh.hosts[3].jobs, 3);
  for (const char* wrong :
       {"", "-oProxyCommand=x", "a b", "a:b", "a:0", "a:70000", "a/0", "a/", "/4", "a;b", "$(x)"}) {
    EXPECT_FALSE(HostOfText(wrong)) << wrong;
  }
}

TEST(EngineTableTest, WhatIsWrongIsSaid) {
  for (const auto& [text, message] :
       {std::pair("kind = 'slrm'", "expected \"local\", \"slurm\" or \"ssh\""),
        std::pair("knd = 'slurm'", "[engine] has no 'knd'"),
        std::pair("cpus = 0", "expected a whole number, 1 to 1024"),
        std::pair("chunk = 0", "expected seconds, such as 2.5, 2.5s or 200ms"),
        std::pair("time = 60", "expected a text"),
        std::pair("partition = \"a\\nb\"", "expected a text"),
        std::pair("options = ['x']", "expected an option of sbatch in one word: \"--qos=low\""),
        std::pair("hosts = []", "expected a list: hosts = [\"user@name\"]"),
        std::pair("hosts = [{jobs = 3}]", "expected a host: \"user@name:port/jobs\""),
        std::pair("hosts = [{host = 'a', port = 3}]", "a host has no 'port'"),
        std::pair("kind = 'ssh'", "the engine ssh needs hosts")}) {
    EXPECT_EQ(TableOf(text).second, message) << text;
  }
}

/// A source of parts by their names, and how often it was asked.
struct Parts {
  int asked = 0;
  Result<std::string> operator()(const std::string& hash) {
    ++asked;
    return "bytes of " + hash;
  }
};

RowTask TaskOf(int place, std::vector<std::string> parts) {
  RowTask task;
  task.place = place;
  task.key = "key" + std::to_string(place);
  task.inputs = {std::move(parts), "own"};
  return task;
}

/// The lines of a text.
std::vector<std::string> WrittenLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(ChunkTest, PartsThatRowsTakeTurnsWithAreWrittenOnce) {
  ChunkWriter writer;
  Parts parts;
  std::string text;
  for (int i = 0; i < 100; ++i) {
    text += *writer.LinesOf(TaskOf(i, {"model" + std::to_string(i % 4), "world"}), std::ref(parts));
  }
  EXPECT_EQ(parts.asked, 5);
  // A sweep over very many programs holds some of them only, on both sides the same ones.
  for (int i = 0; i < 1000; ++i) {
    text +=
        *writer.LinesOf(TaskOf(i, {"model" + std::to_string(i % 100), "world"}), std::ref(parts));
  }
  EXPECT_GT(parts.asked, 900);
  // The names of these parts are no hashes of their bytes, which the reader finds out.
  ChunkReader reader;
  const std::vector<std::string> lines = WrittenLines(text);
  ASSERT_TRUE(reader.Take(lines[0]));
  EXPECT_EQ(reader.Take(lines[1]).error().message, "a part of the chunk is damaged");
}

TEST(ChunkTest, AnotherBuildIsRefused) {
  ChunkReader reader;
  Json line = Json::parse(ChunkLine());
  line["version"] = "9.9";
  EXPECT_NE(reader.Take(JsonText(line)).error().message.find("it is morphbus 9.9, this is "),
            std::string::npos);
  line["version"] = Version();
  line["arithmetic"] = "0123";
  EXPECT_NE(reader.Take(JsonText(line)).error().message.find("fingerprint 0123"),
            std::string::npos);
  EXPECT_TRUE(reader.Take(ChunkLine()));
  EXPECT_EQ(BuildDifference(Version(), sim::ArithmeticFingerprint()), "");
}

TEST(StreamTest, AHelloIsRead) {
  const auto hello = ReadHello(HelloLine(3));
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->jobs, 3);
  EXPECT_EQ(BuildDifference(hello->version, hello->arithmetic), "");
  for (const char* none : {"", "Last login: today", "{}", "[1]", R"({"hello":1})",
                           R"({"hello":1,"jobs":1e99})", R"({"hello":1,"jobs":1,"version":2})"}) {
    EXPECT_FALSE(ReadHello(none)) << none;
  }
  EXPECT_EQ(ReadHello(R"({"hello":1,"jobs":-5})")->jobs, 1);
}

TEST_F(EnginesTest, ResultsAreReadAsTheyCome) {
  ResultsFile results(Path("results"));
  std::vector<int64_t> places;
  const auto read = [&] {
    places.clear();
    return results
        .ReadNew([&](const PlacedResult& one) -> Result<void> {
          places.push_back(one.place);
          return {};
        })
        .has_value();
  };
  // A file that is not there yet has none.
  EXPECT_TRUE(read());
  std::ofstream file(Path("results"), std::ios::binary);
  const std::string second = ResultLine(2, "b", NewResult());
  file << ResultLine(1, "a", NewResult()) << second.substr(0, 20) << std::flush;
  EXPECT_TRUE(read());
  EXPECT_EQ(places, std::vector<int64_t>{1});
  // Its rest comes later.
  file << second.substr(20) << std::flush;
  EXPECT_TRUE(read());
  EXPECT_EQ(places, std::vector<int64_t>{2});
  // One that breaks off is left out, and those behind it are read.
  file << second.substr(0, 30) << "\n" << ResultLine(3, "c", NewResult()) << std::flush;
  EXPECT_TRUE(read());
  EXPECT_EQ(places, std::vector<int64_t>{3});
}

TEST_F(EnginesTest, AChunkGoesOnBehindATornLine) {
  // The row has a result already, so that nothing need be run; the half line gets its end.
  std::ofstream(Path("chunk")) << ChunkLine() << RowLine(TaskOf(1, {}));
  const std::string line = ResultLine(1, "key1", NewResult());
  std::ofstream(Path("results")) << line << line.substr(0, 10);
  EXPECT_EQ(ServeChunkFile(Path("chunk"), Path("results"), {1, 0}), 0);
  EXPECT_EQ(*ReadFile(Path("results")), line + line.substr(0, 10) + "\n");
  // What is no chunk is said to be none.
  std::ofstream(Path("chunk")) << "no chunk\n";
  EXPECT_EQ(ServeChunkFile(Path("chunk"), Path("results"), {1, 0}), 2);
  EXPECT_EQ(ServeChunkFile(Path("none"), Path("results"), {1, 0}), 2);
  std::ofstream(Path("chunk")) << ChunkLine();
  EXPECT_EQ(ServeChunkFile(Path("chunk"), Path("none/results"), {1, 0}), 2);
}

TEST_F(EnginesTest, AJobIsFoundAgain) {
  SlurmJob job = {folder_, "morphbus-s-01234567", "17", {}, {}};
  job.tasks.emplace_back(1, 2, job.ResultsPath(1));
  job.tasks.emplace_back(2, 1, job.ResultsPath(2));
  std::ofstream(job.ChunkPath(1)) << ChunkLine() << RowLine(TaskOf(1, {})) << RowLine(TaskOf(2, {}))
                                  << "{\"row\":";
  const auto wanted = [](const std::string& key) { return key != "key2"; };
  // Without its state it was not submitted.
  EXPECT_FALSE(ReadJob(folder_, wanted)->has_value());
  ASSERT_TRUE(WriteJobState(job));
  const auto read = ReadJob(folder_, wanted);
  ASSERT_TRUE(read && *read);
  EXPECT_EQ((*read)->name + (*read)->id, "morphbus-s-0123456717");
  ASSERT_EQ((*read)->tasks.size(), 2u);
  EXPECT_EQ((*read)->tasks[0].tries, 2);
  EXPECT_EQ((*read)->tasks[0].left, std::set<std::string>{"key1"});
  EXPECT_EQ((*read)->tasks[0].rows, 2);
  EXPECT_TRUE((*read)->tasks[1].left.empty());
  // Whatever else stands there is said to be damaged.
  for (const char* text :
       {"", "{", "[]", "{}", R"({"job":1})", R"({"job":1,"name":1,"id":"","tries":[]})",
        R"({"job":1,"name":"a","id":"","tries":[1.5]})",
        R"({"job":1,"name":"a;b","id":"","tries":[]})",
        R"({"job":1,"name":"a","id":"1 2","tries":[]})",
        R"({"job":2,"name":"a","id":"","tries":[]})"}) {
    std::ofstream(Path("job.json")) << text;
    EXPECT_EQ(ReadJob(folder_, wanted).error().message, Path("job.json is damaged")) << text;
  }
}

TEST_F(EnginesTest, AScriptQuotesItsWords) {
  const std::string script = TaskScript({"/it's here", "n", "", {}, {}}, "/a b/morphbus", 2, 1.5);
  EXPECT_NE(
      script.find(
          "exec '/a b/morphbus' sweep worker '/it'\\''s here'/chunk-\"$SLURM_ARRAY_TASK_ID\" -o "
          "'/it'\\''s here'/results-\"$SLURM_ARRAY_TASK_ID\" --jobs 2 --timeout 1.5\n"),
      std::string::npos)
      << script;
}

TEST(QueueTest, WhatSlurmSaysIsRead) {
  const auto row = [](const char* task, const char* state, const char* exit, const char* node) {
    return fmt::format("{:16}{:24}{:24}{:16}{:96}{:96}\n", task, "17", state, exit, node,
                       "Reason, of more words");
  };
  const SlurmQueue queue =
      ReadQueue(row("1", "RUNNING", "0", "n1") + row("2", "PENDING", "0", "n/a") +
                row("3", "FAILED", "32512", "n2") + row("4", "FAILED", "127:0", "n2") +
                row("N/A", "PENDING", "0", "n/a") + "nonsense\n\n");
  EXPECT_EQ(queue.id, "17");
  ASSERT_EQ(queue.tasks.size(), 4u);
  EXPECT_EQ(queue.tasks.at(1).node, "n1");
  EXPECT_FALSE(queue.tasks.at(1).ended());
  EXPECT_FALSE(queue.tasks.at(2).ended());
  EXPECT_EQ(queue.tasks.at(2).node, "");
  EXPECT_EQ(queue.tasks.at(3).exit_status, 127);
  EXPECT_EQ(queue.tasks.at(4).exit_status, 127);
  EXPECT_TRUE(queue.tasks.at(4).ended());
  EXPECT_EQ(queue.tasks.at(4).reason, "Reason, of more words");
  EXPECT_TRUE(ReadQueue("").tasks.empty());
  // What passes by itself is no hold.
  for (const char* pass : {"", "None", "Resources", "Priority", "BeginTime"}) {
    EXPECT_FALSE((SlurmTaskState{"PENDING", "", pass, 0}).held()) << pass;
  }
  EXPECT_TRUE((SlurmTaskState{"PENDING", "", "launch failed requeued held", 0}).held());
  EXPECT_FALSE((SlurmTaskState{"RUNNING", "", "PartitionTimeLimit", 0}).held());
}

/// Rows of a test, which nobody can run.
class ListedRows : public RowSource {
 public:
  Result<std::optional<RowTask>> Next() override {
    if (next_ == rows.size()) return std::optional<RowTask>();
    return std::optional(rows[next_++]);
  }
  Result<RowInputs> Inputs(const std::string& /*key*/) override {
    ++written;
    return RowInputs{{}, "own"};
  }
  Result<std::string> Part(const std::string& /*hash*/) override { return Fail("no parts"); }
  Result<void> Take(const RowTask& /*task*/, const RowResult& /*result*/) override {
    ++taken;
    return {};
  }
  Result<void> Settle() override { return settled; }
  bool GoOn() override { return on(); }

  std::vector<RowTask> rows;
  std::function<bool()> on = [] { return true; };
  Result<void> settled;
  int written = 0, taken = 0;

 private:
  size_t next_ = 0;
};

/// The engine, with commands in the place of Slurm's that say what a test wants.
class SlurmEngineTest : public EnginesTest {
 protected:
  SlurmEngineTest() {
    std::filesystem::create_directory(Path("bin"));
    setenv("PATH", (Path("bin") + ":" + path_).c_str(), 1);
    for (const char* name : {"sbatch", "squeue", "scontrol", "scancel"}) SetProgram(name, ":");
    options_.settings.kind = EngineKind::kSlurm;
    options_.settings.binary = "/bin/morphbus";
    options_.folder = Path("s.db.jobs");
    options_.detach = true;
    for (const int place : {1, 2}) rows_.rows.push_back(TaskOf(place, {}));
  }
  ~SlurmEngineTest() override { setenv("PATH", path_.c_str(), 1); }

  /// Each call of a command leaves a line with its words.
  void SetProgram(const std::string& name, const std::string& script) const {
    const std::string file = Path("bin/" + name);
    std::ofstream(file) << "#!/bin/sh\necho \"$@\" >>" << Path(name + "-calls") << "\n"
                        << script << "\n";
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  }
  [[nodiscard]] std::vector<std::string> CallsOf(const std::string& name) const {
    return WrittenLines(ReadFile(Path(name + "-calls")).value_or(""));
  }

  /// A job that an earlier call has left, with this result for its two rows.
  void LeaveJob(const RowResult& result) const {
    SlurmJob job = {options_.folder + "/job-1", "morphbus-s-01234567", "17", {}, {}};
    job.tasks.emplace_back(1, 1, job.ResultsPath(1));
    std::filesystem::create_directories(job.folder);
    std::ofstream(job.ChunkPath(1))
        << ChunkLine() << RowLine(TaskOf(1, {})) << RowLine(TaskOf(2, {}));
    std::ofstream(job.ResultsPath(1))
        << ResultLine(1, "key1", result) << ResultLine(2, "key2", result);
    ASSERT_TRUE(WriteJobState(job));
  }

  const std::string path_ = std::getenv("PATH");
  EngineOptions options_;
  ListedRows rows_;
};

TEST_F(SlurmEngineTest, WhatStopsItWhileItWritesAJobIsSaid) {
  rows_.on = [this] { return rows_.written == 0; };
  rows_.settled = Fail("the disk is full");
  const EngineResult run = RunOnSlurm(options_, &rows_);
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().message, "the disk is full");
  EXPECT_FALSE(run.error().unusable);
  EXPECT_TRUE(CallsOf("sbatch").empty());
  EXPECT_TRUE(JobFolders(options_.folder).empty());
}

TEST_F(SlurmEngineTest, SbatchIsNotStopped) {
  SetProgram("sbatch", "echo 17");
  rows_.on = [this] { return CallsOf("sbatch").empty(); };
  ASSERT_TRUE(RunOnSlurm(options_, &rows_));
  const std::vector<std::string> folders = JobFolders(options_.folder);
  ASSERT_EQ(folders.size(), 1u);
  EXPECT_EQ((*ReadJob(folders[0], [](const std::string&) { return true; }))->id, "17");
}

TEST_F(SlurmEngineTest, AJobWithoutAnIdIsCancelledByItsName) {
  // Slurm may have it all the same.
  SetProgram("sbatch", "echo late >&2; exit 1");
  options_.once = true;
  rows_.on = [this] { return CallsOf("sbatch").empty(); };
  ASSERT_TRUE(RunOnSlurm(options_, &rows_));
  ASSERT_EQ(CallsOf("scancel").size(), 1u);
  EXPECT_TRUE(CallsOf("scancel")[0].starts_with("--me --name=morphbus-s-"));
  EXPECT_FALSE(std::filesystem::exists(options_.folder));
  // So it is where nobody wants to stop.
  options_.once = false;
  ListedRows others;
  others.rows = rows_.rows;
  const EngineResult run = RunOnSlurm(options_, &others);
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().message, "Slurm does not take the job: late");
  EXPECT_EQ(CallsOf("scancel").size(), 2u);
  EXPECT_FALSE(std::filesystem::exists(options_.folder));
}

TEST_F(SlurmEngineTest, OnlyItsOwnFoldersGo) {
  LeaveJob(NewResult());
  for (const char* theirs : {"job-9", "job-list"}) {
    std::filesystem::create_directory(options_.folder + "/" + theirs);
    std::ofstream(options_.folder + "/" + theirs + "/data") << "theirs";
  }
  ASSERT_TRUE(RunOnSlurm(options_, &rows_));
  EXPECT_EQ(rows_.taken, 2);
  EXPECT_FALSE(std::filesystem::exists(options_.folder + "/job-1"));
  EXPECT_TRUE(std::filesystem::exists(options_.folder + "/job-9/data"));
  EXPECT_TRUE(std::filesystem::exists(options_.folder + "/job-list/data"));
}

TEST_F(SlurmEngineTest, ARetryTakesNoOldFailure) {
  LeaveJob(NewResult());
  SetProgram("sbatch", "echo 18");
  options_.retry = true;
  ASSERT_TRUE(RunOnSlurm(options_, &rows_));
  EXPECT_EQ(rows_.taken, 0);
  EXPECT_EQ(rows_.written, 2);
  EXPECT_EQ(CallsOf("sbatch").size(), 1u);
  // What is done is taken.
  RowResult done = NewResult();
  done.status = RowResult::Status::kRan;
  std::filesystem::remove_all(options_.folder);
  LeaveJob(done);
  ListedRows others;
  others.rows = rows_.rows;
  ASSERT_TRUE(RunOnSlurm(options_, &others));
  EXPECT_EQ(others.taken, 2);
}

TEST_F(SlurmEngineTest, AHoldIsToldOnce) {
  SetProgram("sbatch", "echo 17");
  SetProgram("squeue", fmt::format("printf '{:16}{:24}{:24}{:16}{:96}{:96}\\n'", "1", "17",
                                   "PENDING", "0", "n/a", "launch failed requeued held"));
  options_.detach = false;
  rows_.on = [this] { return CallsOf("squeue").size() < 3; };
  testing::internal::CaptureStderr();
  ASSERT_TRUE(RunOnSlurm(options_, &rows_));
  const std::string said = testing::internal::GetCapturedStderr();
  const std::string hold = "Slurm holds job 17 (launch failed requeued held)";
  EXPECT_NE(said.find(hold), std::string::npos) << said;
  EXPECT_EQ(said.find(hold), said.rfind(hold)) << said;
}

TEST_F(SlurmEngineTest, EqualRowsHaveALogEach) {
  RowResult done = NewResult();
  done.status = RowResult::Status::kRan;
  LeaveJob(done);
  rows_.rows = {TaskOf(1, {}), TaskOf(1, {})};
  rows_.rows[0].log = Path("first.log");
  rows_.rows[1].log = Path("second.log");
  std::ofstream(Path("first.log")) << "log";
  ASSERT_TRUE(RunOnSlurm(options_, &rows_));
  EXPECT_EQ(rows_.taken, 2);
  EXPECT_EQ(ReadFile(Path("second.log")).value_or(""), "log");
}

TEST(ProgramOutputTest, AProgramSaysWhatItSays) {
  const auto on = [] { return true; };
  const auto done = RunProgram({"sh", "-c", "echo out; echo first >&2; echo last >&2; exit 7"}, on);
  ASSERT_TRUE(done);
  EXPECT_EQ(done->status, 7);
  EXPECT_EQ(done->output, "out\n");
  EXPECT_EQ(LastLine(done->errors), "last");
  EXPECT_EQ(LastLine(" \n\n"), "");
  // Nothing waits on its stdin, and one that does not end is ended.
  EXPECT_EQ(RunProgram({"cat"}, on)->output, "");
  EXPECT_EQ(RunProgram({"sleep", "1000"}, [] { return false; }).error().message,
            "sleep was stopped");
  EXPECT_NE(RunProgram({"no-such-program"}, on).error().message.find("no-such-program"),
            std::string::npos);
}

}  // namespace
}  // namespace morphbus::tools
