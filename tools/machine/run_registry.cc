#include "tools/machine/run_registry.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "bridge/wire/channels.h"
#include "tools/base/files.h"
#include "tools/base/json.h"

namespace morphbus::tools {

// What stands in run.json as it is called here; what is missing there keeps its default.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(RunEntry, pid, since, robot, log, url, isolated)

namespace {

namespace fs = std::filesystem;

/// The folder of all runs of this user; created if need be. Refuses one that others can get into.
Result<std::string> RegistryFolder() {
  // The runtime directory vanishes at logout, as runs do; /tmp serves where there is none.
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  struct stat info = {};
  std::string folder = fmt::format("/tmp/morphbus-{}", geteuid());
  // The variable counts only if it names a directory of this user.
  if (runtime != nullptr && *runtime != '\0' && stat(runtime, &info) == 0 &&
      info.st_uid == geteuid()) {
    folder = std::string(runtime) + "/morphbus";
  }
  // Several runs may start at once: a folder that is there already is as good.
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    return Fail(fmt::format("cannot create {}: {}", folder, std::strerror(errno)));
  }
  // In /tmp somebody else may have made it first: such a folder, or a link, is not used.
  if (lstat(folder.c_str(), &info) != 0 || !S_ISDIR(info.st_mode) || info.st_uid != geteuid() ||
      (info.st_mode & 077) != 0) {
    return Fail(
        fmt::format("{} is not a private directory of yours; remove it or set "
                    "XDG_RUNTIME_DIR",
                    folder));
  }
  return folder;
}

/// Locks the run directory `path`; -1 if a living process holds it. `create` makes what is missing.
int Lock(const std::string& path, bool create) {
  const std::string lock_path = path + "/lock";
  // Each attempt that fails was overtaken by a process that removed the directory.
  for (int attempt = 0; attempt < 8; ++attempt) {
    if (create && mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) return -1;
    const int fd =
        open(lock_path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | (create ? O_CREAT : 0), 0600);
    // A lock that is missing after the directory was made has been removed meanwhile: try again.
    if (fd < 0 && !(create && errno == ENOENT)) return -1;
    if (fd < 0) continue;
    struct stat held = {};
    struct stat there = {};
    // A living run holds its lock until its process ends.
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
      close(fd);
      return -1;
    }
    // Another process may have removed the directory between our open and our lock.
    if (fstat(fd, &held) == 0 && stat(lock_path.c_str(), &there) == 0 &&
        held.st_ino == there.st_ino) {
      return fd;
    }
    close(fd);
  }
  return -1;
}

/// Empties a directory whose lock we hold, but for the lock: as long as that is there, nobody else
/// can claim the directory.
void Empty(const std::string& path) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, ignored)) {
    if (entry.path().filename() != "lock") fs::remove_all(entry.path(), ignored);
  }
}

/// Removes a directory whose lock we hold, the lock last.
void Remove(const std::string& path) {
  std::error_code ignored;
  Empty(path);
  fs::remove_all(path, ignored);
}

/// What Publish wrote. Fails for a run that has not got that far.
Result<RunEntry> ReadEntry(const std::string& path, const std::string& name) {
  const Result<std::string> text = ReadFile(path + "/run.json", 65536);
  if (!text) return Fail(text.error().message);
  // What is missing in the file, of another version say, keeps its default.
  const nlohmann::json json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object()) return Fail(path + "/run.json is damaged");
  RunEntry entry = json;
  entry.name = name;
  entry.folder = path;
  return entry;
}

}  // namespace

Result<RunDirectory> RunDirectory::Claim(const std::string& name) {
  if (!name.empty()) {
    if (Result<void> good = bridge::CheckRunName(name); !good)
      return Fail("--run: " + good.error().message);
  }
  const Result<std::string> folder = RegistryFolder();
  if (!folder) return Fail(folder.error().message);
  std::random_device random;  // names need to be unique, never reproducible
  for (int attempt = 0; attempt < 100; ++attempt) {
    // Five hexadecimal digits are short enough to type.
    const std::string chosen = name.empty() ? fmt::format("r{:05x}", random() & 0xfffff) : name;
    const std::string path = *folder + "/" + chosen;
    // The lock is what holds a name: it goes with the process, however that ends.
    const int lock = Lock(path, true);
    if (lock >= 0) {
      // A run that was killed has left its files, of which the new one must see none.
      Empty(path);
      return RunDirectory(chosen, path, lock);
    }
    // A fresh name that is taken is drawn again; a name that was asked for is refused.
    if (name.empty()) continue;
    // The message names who holds it, if that has published its entry.
    const Result<RunEntry> holder = ReadEntry(path, chosen);
    return Fail(
        holder ? fmt::format("run '{}' is already in use by process {} since {}; choose another "
                             "name with --run",
                             name, holder->pid, holder->since)
               : fmt::format("run '{}' is already in use; choose another name with --run", name));
  }
  return Fail("cannot find a free name for the run in " + *folder);
}

RunDirectory::RunDirectory(RunDirectory&& other) noexcept
    : name_(std::move(other.name_)), path_(std::move(other.path_)), lock_(other.lock_) {
  other.lock_ = -1;
}

RunDirectory::~RunDirectory() {
  // An object that was moved from owns nothing.
  if (lock_ < 0) return;
  Remove(path_);
  close(lock_);
}

Result<void> RunDirectory::Publish(const RunEntry& entry) const {
  return WriteFile(path_ + "/run.json", JsonText(nlohmann::json(entry), 2) + "\n");
}

Result<std::vector<RunEntry>> ListRuns() {
  const Result<std::string> folder = RegistryFolder();
  if (!folder) return Fail(folder.error().message);
  std::vector<RunEntry> runs;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(*folder, failure)) {
    if (!entry.is_directory()) continue;
    // Who can be locked has no living owner: it is what a killed launcher left.
    const int lock = Lock(entry.path(), false);
    if (lock >= 0) {
      Remove(entry.path());
      close(lock);
      continue;
    }
    Result<RunEntry> run = ReadEntry(entry.path(), entry.path().filename());
    if (run) runs.push_back(std::move(*run));  // else: claimed, but not started yet
  }
  // A directory lists its entries in no order.
  std::sort(runs.begin(), runs.end(),
            [](const RunEntry& a, const RunEntry& b) { return a.name < b.name; });
  return runs;
}

Result<RunEntry> FindRun(const std::string& name) {
  Result<std::vector<RunEntry>> runs = ListRuns();
  if (!runs) return Fail(runs.error().message);
  // All names, for the message if none fits.
  std::string names;
  for (const RunEntry& run : *runs) {
    if (run.name == name) return run;
    names += (names.empty() ? "" : ", ") + run.name;
  }
  // Nothing fits: the message says what there is to choose from.
  if (runs->empty())
    return Fail((name.empty() ? std::string() : "no run '" + name + "'; ") +
                "nothing runs here; `morphbus run` in another terminal starts a robot");
  if (!name.empty()) return Fail(fmt::format("no run '{}'; running: {}", name, names));
  if (runs->size() == 1) return runs->front();
  // Nobody can join a run in one process, so that it is not meant where another one is there.
  const auto has_bus = [](const RunEntry& run) { return !run.url.empty(); };
  if (std::count_if(runs->begin(), runs->end(), has_bus) == 1) {
    return *std::find_if(runs->begin(), runs->end(), has_bus);
  }
  return Fail(fmt::format("several runs; choose one with --run: {}", names));
}

std::string WallTime() {
  const std::time_t now = std::time(nullptr);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S%z}", fmt::localtime(now));
}

}  // namespace morphbus::tools
