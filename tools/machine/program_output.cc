#include "tools/machine/program_output.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include "tools/base/lines.h"
#include "tools/machine/child_process.h"

namespace morphbus::tools {
namespace {

/// How often a caller is asked whether to go on, milliseconds.
constexpr int kAskMs = 100;
/// A program that says more than this is not one that anybody meant to ask, bytes.
constexpr size_t kMostOutput = size_t{64} << 20;

/// The end of a pipe from which a program's words are read.
struct Outlet {
  Descriptor ours, theirs;
  std::string text;
  bool open = true;
};

Result<Outlet> MakeOutlet() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    return Fail(fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  }
  return Outlet{Descriptor(ends[0]), Descriptor(ends[1]), "", true};
}

}  // namespace

Result<std::string> FindProgram(const std::string& name) {
  // A name with a folder is a path.
  if (name.find('/') != std::string::npos) {
    if (access(name.c_str(), X_OK) == 0) return name;
    return Fail(fmt::format("cannot run {}: {}", name, std::strerror(errno)));
  }
  const char* path = std::getenv("PATH");
  std::string_view folders = path == nullptr ? "/usr/bin:/bin" : path;
  while (!folders.empty()) {
    const size_t end = std::min(folders.find(':'), folders.size());
    const std::string file = fmt::format("{}/{}", folders.substr(0, end), name);
    if (end > 0 && access(file.c_str(), X_OK) == 0) return file;
    folders.remove_prefix(std::min(end + 1, folders.size()));
  }
  return Fail(fmt::format("there is no program '{}' on this machine ($PATH)", name));
}

Result<ProgramOutput> RunProgram(std::vector<std::string> argv,
                                 const std::function<bool()>& go_on) {
  const Result<std::string> path = FindProgram(argv.front());
  if (!path) return Fail(path.error().message);
  Result<Outlet> output = MakeOutlet(), errors = MakeOutlet();
  const Descriptor nothing(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!output || !errors) return Fail((output ? errors : output).error().message);
  ChildProcess::Options options;
  options.name = argv.front();
  argv.front() = *path;
  options.argv = std::move(argv);
  options.input = nothing.get();
  options.output = output->theirs.get();
  options.errors = errors->theirs.get();
  Result<ChildProcess> child = ChildProcess::Start(options);
  if (!child) return Fail(child.error().message);
  // Without copies of ours the pipes end with the program.
  { const Descriptor first(std::move(output->theirs)), second(std::move(errors->theirs)); }
  while (output->open || errors->open) {
    pollfd fds[] = {{output->open ? output->ours.get() : -1, POLLIN, 0},
                    {errors->open ? errors->ours.get() : -1, POLLIN, 0}};
    poll(fds, 2, kAskMs);
    if (!go_on()) return Fail(options.name + " was stopped");
    if (fds[0].revents != 0) output->open = ReadSome(output->ours.get(), &output->text);
    if (fds[1].revents != 0) errors->open = ReadSome(errors->ours.get(), &errors->text);
    if (output->text.size() + errors->text.size() > kMostOutput) {
      return Fail(fmt::format("{} says more than {} MB", options.name, kMostOutput >> 20));
    }
  }
  while (!child->Poll()) {
    pollfd ended = {child->pidfd(), POLLIN, 0};
    poll(&ended, 1, kAskMs);
    if (!go_on()) return Fail(options.name + " was stopped");
  }
  return ProgramOutput{child->status(), std::move(output->text), std::move(errors->text)};
}

std::string LastLine(const std::string& text) {
  const size_t end = text.find_last_not_of(" \r\n");
  if (end == std::string::npos) return "";
  // A text without a line feed is its own last line: npos + 1 is 0.
  const size_t begin = text.rfind('\n', end) + 1;
  return text.substr(begin, end + 1 - begin);
}

}  // namespace morphbus::tools
