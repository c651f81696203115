#include "tools/sweep/chunk.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/stream_hash.h"
#include "compiler/base/base64.h"
#include "compiler/base/version.h"
#include "sim/arithmetic.h"

namespace morphbus::tools {
namespace {

/// Of the lines; goes up with every change of what they mean.
constexpr int kChunkVersion = 2;

/// So many parts are held beside those of the last row: a sweep over robots and programs has some.
constexpr size_t kHeldParts = 32;

/// The row of a line that has none of the other keys.
Result<RowTask> ReadTask(const Json& json) {
  RowTask task;
  // The library would cast any number to an integer.
  if (!json.contains("row") || !json["row"].is_number_integer()) return Fail("a row has no number");
  task.place = json["row"].get<int64_t>();
  task.key = json.value("key", std::string());
  task.log = json.value("log", std::string());
  task.inputs.parts = json.value("parts", std::vector<std::string>());
  const std::optional<std::string> own = FromBase64(json.value("own", std::string()));
  if (!own) return Fail("the inputs of a row are damaged");
  task.inputs.own = *own;
  return task;
}

}  // namespace

std::string ChunkLine() {
  return JsonText(Json{{"chunk", kChunkVersion},
                       {"version", Version()},
                       {"arithmetic", sim::ArithmeticFingerprint()}}) +
         "\n";
}

std::string BuildDifference(const std::string& version, const std::string& arithmetic) {
  if (version != Version()) {
    return fmt::format("it is morphbus {}, this is {}: the same program has to run all rows",
                       version.empty() ? "of another kind" : version, Version());
  }
  if (arithmetic != sim::ArithmeticFingerprint()) {
    return fmt::format(
        "its arithmetic has the fingerprint {}, that of this machine is {}: rows would have other "
        "hashes (docs/arithmetic.md)",
        arithmetic, sim::ArithmeticFingerprint());
  }
  return "";
}

std::string PartLine(const std::string& hash, const std::string& bytes) {
  return JsonText(Json{{"part", hash}, {"bytes", Base64(bytes)}}) + "\n";
}

std::string RowLine(const RowTask& task) {
  return JsonText(Json{{"row", task.place},
                       {"key", task.key},
                       {"parts", task.inputs.parts},
                       {"own", Base64(task.inputs.own)},
                       {"log", task.log}}) +
         "\n";
}

std::string ResultLine(int64_t place, const std::string& key, const RowResult& result) {
  return JsonText(Json{{"row", place},
                       {"key", key},
                       {"status", StatusText(result.status)},
                       {"hash", result.hash},
                       {"figures", result.figures},
                       {"error", result.error},
                       {"seconds", result.seconds},
                       {"version", result.version},
                       {"host", result.host}}) +
         "\n";
}

Result<PlacedResult> ReadResult(const std::string& line) {
  const Json json = Json::parse(line, nullptr, false);
  const auto text = [&json](const char* key) { return json.value(key, std::string()); };
  // Who writes a line that is none breaks off in it.
  if (!json.is_object() || !json.contains("row") || !json["row"].is_number_integer() ||
      !json.contains("host")) {
    return Fail("this is no result of a row");
  }
  PlacedResult placed;
  try {
    placed.place = json["row"].get<int64_t>();
    placed.key = text("key");
    placed.result = {StatusOfText(text("status")), text("hash"), text("figures"), text("error"),
                     json.value("seconds", 0.0),   text("host"), text("version")};
  } catch (const Json::exception&) {
    return Fail("this is no result of a row");
  }
  return placed;
}

std::optional<HeldParts::Bytes> HeldParts::Find(const std::string& hash) const {
  const auto found = std::ranges::find(parts_, hash, &std::pair<std::string, Bytes>::first);
  return found == parts_.end() ? std::nullopt : std::optional(found->second);
}

void HeldParts::Put(const std::string& hash, Bytes bytes) {
  if (!Find(hash)) parts_.emplace_back(hash, std::move(bytes));
}

void HeldParts::Use(const std::vector<std::string>& hashes) {
  std::stable_partition(parts_.begin(), parts_.end(), [&hashes](const auto& part) {
    return std::ranges::find(hashes, part.first) == hashes.end();
  });
  const size_t most = kHeldParts + hashes.size();
  if (parts_.size() > most) {
    parts_.erase(parts_.begin(), parts_.end() - static_cast<std::ptrdiff_t>(most));
  }
}

Result<std::string> ChunkWriter::LinesOf(
    const RowTask& task, const std::function<Result<std::string>(const std::string&)>& part) {
  std::string text = begun_ ? "" : ChunkLine();
  begun_ = true;
  for (const std::string& hash : task.inputs.parts) {
    if (held_.Find(hash)) continue;
    const Result<std::string> bytes = part(hash);
    if (!bytes) return bytes;
    text += PartLine(hash, *bytes);
    held_.Put(hash, nullptr);
  }
  held_.Use(task.inputs.parts);
  return text + RowLine(task);
}

Result<std::optional<ChunkRow>> ChunkReader::Take(const std::string& line) {
  const Json json = Json::parse(line, nullptr, false);
  if (!json.is_object()) return Fail("this is no chunk of a sweep");
  // A value of another kind than that of its key is an exception of the library.
  try {
    return TakeObject(json);
  } catch (const Json::exception&) {
    return Fail("a line of the chunk is damaged");
  }
}

Result<std::optional<ChunkRow>> ChunkReader::TakeObject(const Json& json) {
  if (!begun_) {
    if (!json.contains("chunk")) return Fail("this is no chunk of a sweep");
    const std::string difference = BuildDifference(json.value("version", std::string()),
                                                   json.value("arithmetic", std::string()));
    if (!difference.empty()) return Fail("the chunk is of another build: " + difference);
    if (json["chunk"] != kChunkVersion) return Fail("the chunk is of another kind");
    begun_ = true;
    return std::optional<ChunkRow>();
  }
  if (json.contains("part")) {
    std::optional<std::string> bytes = FromBase64(json.value("bytes", std::string()));
    const std::string hash = json.value("part", std::string());
    if (!bytes || bridge::BytesHash(*bytes) != hash) return Fail("a part of the chunk is damaged");
    held_.Put(hash, std::make_shared<const std::string>(std::move(*bytes)));
    return std::optional<ChunkRow>();
  }
  Result<RowTask> task = ReadTask(json);
  if (!task) return Fail(task.error().message);
  ChunkRow row = {std::move(*task), {}};
  for (const std::string& hash : row.task.inputs.parts) {
    const std::optional<HeldParts::Bytes> bytes = held_.Find(hash);
    if (!bytes) return Fail("the chunk lacks a part of a row");
    row.parts[hash] = *bytes;
  }
  held_.Use(row.task.inputs.parts);
  return std::optional(std::move(row));
}

Result<std::optional<std::string>> ChunkRunner::Take(const std::string& line) {
  const Result<std::optional<ChunkRow>> row = reader_.Take(line);
  if (!row) return Fail(row.error().message);
  if (!*row) return std::optional<std::string>();
  const RowTask& task = (*row)->task;
  std::string description;
  for (const std::string& hash : task.inputs.parts) description += *(*row)->parts.at(hash);
  description += task.inputs.own;
  return std::optional(ResultLine(task.place, task.key, RunForRow(description, task.log)));
}

}  // namespace morphbus::tools
