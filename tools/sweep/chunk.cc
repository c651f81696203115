#include "tools/sweep/chunk.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/wire/stream_hash.h"
#include "compiler/base/base64.h"
#include "compiler/base/version.h"

namespace morphbus::tools {
namespace {

/// Of the lines; goes up with every change of what they mean.
constexpr int kChunkVersion = 1;

}  // namespace

std::string ChunkLine() {
  return JsonText(Json{{"chunk", kChunkVersion}, {"version", Version()}}) + "\n";
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

Result<RowTask> ChunkRunner::ReadTask(const Json& json) {
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

Result<std::optional<std::string>> ChunkRunner::Take(const std::string& line) {
  const Json json = Json::parse(line, nullptr, false);
  if (!json.is_object()) return Fail("this is no chunk of a sweep");
  // A value of another kind than that of its key is an exception of the library.
  try {
    return TakeObject(json);
  } catch (const Json::exception&) {
    return Fail("a line of the chunk is damaged");
  }
}

Result<std::optional<std::string>> ChunkRunner::TakeObject(const Json& json) {
  if (!begun_) {
    const std::string version = json.value("version", std::string());
    if (json.value("chunk", 0) != kChunkVersion || version != Version()) {
      return Fail(fmt::format(
          "the chunk was made by morphbus {}, this is {}: the same program has to run it",
          version.empty() ? "of another kind" : version, Version()));
    }
    begun_ = true;
    return std::optional<std::string>();
  }
  if (json.contains("part")) {
    const std::optional<std::string> bytes = FromBase64(json.value("bytes", std::string()));
    const std::string hash = json.value("part", std::string());
    if (!bytes || bridge::BytesHash(*bytes) != hash) return Fail("a part of the chunk is damaged");
    parts_[hash] = *bytes;
    return std::optional<std::string>();
  }
  const Result<RowTask> task = ReadTask(json);
  if (!task) return Fail(task.error().message);
  const auto& named = task->inputs.parts;
  std::erase_if(parts_, [&named](const auto& part) {
    return std::ranges::find(named, part.first) == named.end();
  });
  std::string description;
  for (const std::string& hash : named) {
    if (!parts_.contains(hash)) return Fail("the chunk lacks a part of a row");
    description += parts_[hash];
  }
  description += task->inputs.own;
  return std::optional(ResultLine(task->place, task->key, RunForRow(description, task->log)));
}

}  // namespace morphbus::tools
