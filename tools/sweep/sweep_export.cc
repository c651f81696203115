#include "tools/sweep/sweep_export.h"

#include <set>
#include <utility>
#include <vector>

#include "compiler/base/text.h"

namespace morphbus::tools {
namespace {

/// Names in the order in which they first come.
class NameList {
 public:
  void Add(const Json& object) {
    for (const auto& [name, value] : object.items()) {
      if (seen_.insert(name).second) names_.push_back(name);
    }
  }
  /// Drops those that other names belong to: `gait` is null where there is no gait, and where there
  /// is one its parts stand.
  void DropWholes() {
    std::erase_if(names_, [this](const std::string& name) {
      const auto part = seen_.lower_bound(name + ".");
      return part != seen_.end() && part->starts_with(name + ".");
    });
  }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::set<std::string> seen_;
};

/// A cell; that of what is unknown is empty.
std::string Cell(const Json& value) { return value.is_null() ? "" : CsvCell(PlainText(value)); }

}  // namespace

Json FiguresOf(const StoredRow& row) {
  Json figures = row.result ? Json::parse(row.result->figures, nullptr, false) : Json::object();
  return figures.is_object() ? figures : Json::object();
}

Json RowJson(const StoredRow& row) {
  Json json = {{"row", row.place}, {"key", row.key}, {"inputs", row.point}};
  if (!row.result) {
    json["status"] = "missing";
    return json;
  }
  const RowResult& result = *row.result;
  json["status"] = StatusText(result.status);
  json["hash"] = result.hash.empty() ? Json(nullptr) : Json(result.hash);
  json["figures"] = FiguresOf(row);
  json["error"] = result.error.empty() ? Json(nullptr) : Json(result.error);
  json["version"] = result.version;
  json["wall_seconds"] = result.seconds;
  json["host"] = result.host;
  return json;
}

Result<void> WriteCsv(SweepStore* store, OutputFile* file) {
  // Which columns there are is only known once all rows were seen.
  NameList inputs, figures;
  Result<void> done = store->EachRow([&](const StoredRow& row) {
    inputs.Add(row.point);
    figures.Add(FiguresOf(row));
    return true;
  });
  if (!done) return done;
  figures.DropWholes();
  std::string line = "row";
  for (const std::string& name : inputs.names()) line += "," + Cell(name);
  line += ",status,hash";
  for (const std::string& name : figures.names()) line += "," + Cell(name);
  line += ",error,version,key,wall_seconds,host\n";
  Result<void> written = file->Write(line);
  done = store->EachRow([&](const StoredRow& row) {
    const Json values = FiguresOf(row);
    const Json json = RowJson(row);
    line = std::to_string(row.place);
    for (const std::string& name : inputs.names())
      line += "," + Cell(row.point.value(name, Json()));
    for (const char* name : {"status", "hash"}) line += "," + Cell(json.value(name, Json()));
    for (const std::string& name : figures.names()) line += "," + Cell(values.value(name, Json()));
    for (const char* name : {"error", "version", "key", "wall_seconds", "host"}) {
      line += "," + Cell(json.value(name, Json()));
    }
    written = file->Write(line + "\n");
    return written.has_value();
  });
  return written ? done : written;
}

Result<void> WriteJson(SweepStore* store, OutputFile* file) {
  Result<void> written;
  bool first = true;
  const Result<void> done = store->EachRow([&](const StoredRow& row) {
    written = file->Write((first ? "[\n" : ",\n") + JsonText(RowJson(row)));
    first = false;
    return written.has_value();
  });
  if (!done || !written) return written ? done : written;
  return file->Write(first ? std::string_view("[]\n") : std::string_view("\n]\n"));
}

}  // namespace morphbus::tools
