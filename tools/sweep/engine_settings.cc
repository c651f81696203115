#include "tools/sweep/engine_settings.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/base/quantity.h"
#include "tools/sweep/file_reader.h"

namespace morphbus::tools {
namespace {

using source::TomlEntry;
using source::TomlValue;

/// No host runs more rows at a time, and no task.
constexpr int kMostJobs = 1024;

/// Reads the table.
class EngineReader : private FileReader {
 public:
  EngineReader(int file, source::Diagnostics* diagnostics) : FileReader(file, diagnostics) {}

  EngineSettings Read(const TomlEntry& entry) {
    const TomlValue::Table* table = entry.value.table();
    if (table == nullptr) {
      Wrong(entry.value.span, "expected a table: [engine]", "--engine chooses one");
      return settings_;
    }
    for (const TomlEntry& one : *table) ReadEntry(one);
    if (settings_.kind == EngineKind::kSsh && settings_.hosts.empty() &&
        !diagnostics_.had_errors()) {
      Wrong(entry.key_span, "the engine ssh needs hosts", "add hosts = [\"user@name\"]");
    }
    return settings_;
  }

 private:
  void ReadEntry(const TomlEntry& entry) {
    const std::string& key = entry.key;
    SlurmSettings& slurm = settings_.slurm;
    if (key == "kind") return ReadKind(entry.value);
    if (key == "binary") return ReadText(entry, &settings_.binary);
    if (key == "partition") return ReadText(entry, &slurm.partition);
    if (key == "account") return ReadText(entry, &slurm.account);
    if (key == "time") return ReadText(entry, &slurm.time);
    if (key == "cpus") return ReadWhole(entry, 1, kMostJobs, &slurm.cpus);
    if (key == "chunk") return ReadChunk(entry.value);
    if (key == "options") return ReadOptions(entry.value);
    if (key == "hosts") return ReadHosts(entry.value);
    Wrong(entry.key_span, fmt::format("[engine] has no '{}'", key),
          source::NearestHint(key, {"kind", "binary", "partition", "account", "time", "cpus",
                                    "chunk", "options", "hosts"}));
  }

  void ReadKind(const TomlValue& value) {
    const std::string* name = value.text();
    const std::optional<EngineKind> kind = name == nullptr ? std::nullopt : EngineOfName(*name);
    if (kind) {
      settings_.kind = *kind;
    } else {
      Wrong(value.span, "expected \"local\", \"slurm\" or \"ssh\"",
            name == nullptr ? "" : source::NearestHint(*name, EngineNames()));
    }
  }

  void ReadText(const TomlEntry& entry, std::string* target) {
    const std::string* text = entry.value.text();
    if (text == nullptr || text->empty() || HasControl(*text)) {
      return Wrong(entry.value.span, "expected a text",
                   entry.key == "time" ? "as sbatch takes it: \"1:00:00\"" : "");
    }
    *target = *text;
  }

  /// Seconds as a number, or with a unit as the command line takes them: "5min".
  void ReadChunk(const TomlValue& value) {
    const std::string* text = value.text();
    const std::optional<double> seconds = text != nullptr ? ReadSeconds(*text) : value.number();
    if (!seconds || !(*seconds > 0)) {
      return Wrong(value.span, fmt::format("expected {}", kSecondsReader.expected));
    }
    settings_.slurm.chunk_s = *seconds;
  }

  /// Each begins with a hyphen: sbatch would take another word for the script.
  void ReadOptions(const TomlValue& value) {
    const TomlValue::Array* list = value.array();
    if (list == nullptr) return Wrong(value.span, "expected a list: options = [\"--qos=low\"]");
    for (const TomlValue& one : *list) {
      const std::string* text = one.text();
      if (text == nullptr || !text->starts_with("-") || HasControl(*text)) {
        Wrong(one.span, "expected an option of sbatch in one word: \"--qos=low\"");
        continue;
      }
      settings_.slurm.options.push_back(*text);
    }
  }

  void ReadHosts(const TomlValue& value) {
    const TomlValue::Array* list = value.array();
    if (list == nullptr || list->empty()) {
      return Wrong(value.span, "expected a list: hosts = [\"user@name\"]");
    }
    for (const TomlValue& one : *list) ReadHost(one);
  }
  void ReadHost(const TomlValue& value) {
    const TomlValue::Table* table = value.table();
    // A text alone is a host's name; a table has it under `host`.
    const std::string* text = value.text();
    if (table != nullptr) {
      const auto named = std::ranges::find(*table, "host", &TomlEntry::key);
      if (named != table->end()) text = named->value.text();
    }
    std::optional<SshHost> host = text == nullptr ? std::nullopt : HostOfText(*text);
    if (!host) {
      return Wrong(value.span, "expected a host: \"user@name:port/jobs\"",
                   "of which only the name is needed; or {host = \"name\", jobs = 8, binary = "
                   "\"/opt/morphbus\"}");
    }
    if (table != nullptr) ReadRestOfHost(*table, &*host);
    settings_.hosts.push_back(std::move(*host));
  }
  /// What a table says of a host beside its name.
  void ReadRestOfHost(const TomlValue::Table& table, SshHost* host) {
    for (const TomlEntry& one : table) {
      if (one.key == "jobs") {
        ReadWhole(one, 1, kMostJobs, &host->jobs);
      } else if (one.key == "binary") {
        ReadText(one, &host->binary);
      } else if (one.key != "host") {
        Wrong(one.key_span, fmt::format("a host has no '{}'", one.key),
              source::NearestHint(one.key, {"host", "jobs", "binary"}));
      }
    }
  }

  /// Lines and the like, which neither a script nor another machine's shell could take as one word.
  static bool HasControl(const std::string& text) {
    return std::ranges::any_of(text, [](char c) { return static_cast<unsigned char>(c) < ' '; });
  }

  EngineSettings settings_;
};

}  // namespace

const char* EngineName(EngineKind kind) { return EngineNames()[static_cast<size_t>(kind)].c_str(); }

std::optional<EngineKind> EngineOfName(const std::string& name) {
  const auto found = std::ranges::find(EngineNames(), name);
  if (found == EngineNames().end()) return std::nullopt;
  return static_cast<EngineKind>(found - EngineNames().begin());
}

const std::vector<std::string>& EngineNames() {
  static const std::vector<std::string> names = {"local", "slurm", "ssh"};
  return names;
}

EngineSettings ReadEngine(const TomlEntry& entry, source::Diagnostics* diagnostics) {
  return EngineReader(entry.value.span.file, diagnostics).Read(entry);
}

std::optional<EngineSettings> EngineOfText(const std::string& text) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const auto table =
      source::ParseToml(sources, sources.AddText("the sweep's file", text), &diagnostics);
  if (!table) return std::nullopt;
  EngineSettings settings;
  // A file that says nothing of engines has the one of this machine.
  const auto entry = std::ranges::find(*table, "engine", &TomlEntry::key);
  if (entry != table->end()) settings = ReadEngine(*entry, &diagnostics);
  return diagnostics.had_errors() ? std::nullopt : std::optional(std::move(settings));
}

std::optional<SshHost> HostOfText(const std::string& text) {
  SshHost host;
  std::string_view rest = text;
  // Behind the last slash the rows at a time.
  if (const size_t slash = rest.rfind('/'); slash != std::string_view::npos) {
    const std::optional<int> jobs = ReadNumber<int>(rest.substr(slash + 1));
    if (!jobs || *jobs < 1 || *jobs > kMostJobs) return std::nullopt;
    host.jobs = *jobs;
    rest = rest.substr(0, slash);
  }
  // A name with several colons is an address of IPv6, and has no port here.
  const size_t colon = rest.find(':');
  if (colon != std::string_view::npos && colon == rest.rfind(':')) {
    const std::optional<int> port = ReadNumber<int>(rest.substr(colon + 1));
    if (!port || *port < 1 || *port > 65535) return std::nullopt;
    host.port = *port;
    rest = rest.substr(0, colon);
  }
  // ssh would take a hyphen for the beginning of an option.
  const bool plain = std::ranges::all_of(rest, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("@._-:%+").find(c) != std::string_view::npos;
  });
  if (rest.empty() || rest.front() == '-' || !plain) return std::nullopt;
  host.address = rest;
  return host;
}

}  // namespace morphbus::tools
