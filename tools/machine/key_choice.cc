#include "tools/machine/key_choice.h"

#include <fmt/format.h>

#include "tools/machine/run_registry.h"

namespace morphbus::tools {
namespace {

constexpr const char* kOpenWithKey = "--open is for a run without a key: leave out --key";

}  // namespace

std::string KeyPath(const std::string& folder) { return folder + "/key"; }

void AddKeyFile(Subcommand* sub, std::string* file, const std::string& otherwise) {
  sub->Add("--key", file, "File with the run's key (default: " + otherwise + ")").TypeName("FILE");
}

Result<bridge::RunKey> KeyOfNewRun(bool open, const std::string& file, const std::string& folder) {
  // Of two options that contradict each other neither is guessed to be the one that was meant.
  if (open && !file.empty()) return Fail(kOpenWithKey);
  if (open) return bridge::RunKey();
  Result<bridge::RunKey> key = file.empty() ? bridge::RunKey::Random() : bridge::RunKey::Read(file);
  // The run's other processes, and tools of this user, find the key in the folder.
  if (!key || folder.empty()) return key;
  if (Result<void> written = key->WriteTo(KeyPath(folder)); !written) {
    return Fail(written.error().message);
  }
  return key;
}

Result<bridge::RunKey> ChooseKey(const std::string& run, bool open, const std::string& file) {
  if (open && !file.empty()) return Fail(kOpenWithKey);
  if (open) return bridge::RunKey();
  // A key file goes before the name, which leads to a key only where the run has a folder on this
  // machine.
  if (!file.empty()) return bridge::RunKey::Read(file);
  const Result<RunEntry> entry = run.empty() ? Fail("no name") : FindRun(run);
  if (entry) return bridge::RunKey::Read(KeyPath(entry->folder));
  return Fail(fmt::format(
      "run {} has no key on this machine: give all its processes the same --key FILE "
      "(to make one: (umask 077; head -c 16 /dev/urandom > FILE)), or --open, with which "
      "whoever reaches the bus can speak in it",
      run));
}

}  // namespace morphbus::tools
