// morphbus convert: a log for other people's programs.

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "compiler/base/name_pattern.h"
#include "compiler/base/text.h"
#include "logger/log/compress.h"
#include "logger/log/description.h"
#include "tools/base/lent_description.h"
#include "tools/base/print.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"
#include "tools/convert/csv_tables.h"
#include "tools/convert/json_lines.h"
#include "tools/convert/mcap_log.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus convert`.
struct ConvertOptions {
  std::string log;
  std::string to;
  std::string output;
  std::string run;
  std::string channel;
  std::string description;
  bool force = false;
  bool json = false;
};

/// Converts the log; prints the result and returns the exit status.
using Conversion = int (*)(const ConvertOptions& options);

/// What was made, for people or as JSON.
int Done(const ConvertOptions& options, const std::string& summary, const Json& figures) {
  if (options.json) {
    Json json = {{"log", options.log}, {"to", options.to}, {"output", options.output}};
    json.update(figures);
    PrintJson(json);
    // On standard output the summary would stand among the data.
  } else if (!IsStdout(options.output)) {
    Print("{}: {}\n", options.output, summary);
  }
  return kDone;
}

/// Writes one file by `make`, which gets its sink and returns a Result.
template <class Make>
auto WriteThrough(const std::string& path, const Make& make)
    -> decltype(make(std::declval<const logger::ByteSink&>())) {
  Result<std::unique_ptr<OutputFile>> file = OutputFile::Create(path);
  if (!file) return tl::unexpected(file.error());
  // The file has a temporary name until Close; a failure leaves nothing behind.
  auto made = make([&](std::span<const uint8_t> bytes) { return (*file)->Write(bytes); });
  if (!made) return made;
  if (Result<void> closed = (*file)->Close(); !closed) return tl::unexpected(closed.error());
  return made;
}

/// Events one by one: JSON lines and MCAP.
int ConvertEvents(const ConvertOptions& options, const OutputKind& kind, bool in_order,
                  Result<EventsWritten> (*write)(EventDecoder*, const NamePattern&,
                                                 const logger::ByteSink&)) {
  const WorkProgress progress;
  // What the user may have got wrong is looked at before anything is written.
  const Result<NamePattern> channels = NamePattern::Parse(options.channel);
  if (!channels) return Unusable("--channel " + channels.error().message);
  const Result<std::string> description = LentDescription(options.description);
  if (!description) return Unusable(description.error().message);
  // An existing file is replaced only if it is of the same kind, and none that is read here.
  if (!MayWrite(options.output, kind, options.force, {options.log, options.description})) {
    return kUnusable;
  }
  const Result<EventsWritten> written =
      WriteThrough(options.output, [&](const logger::ByteSink& sink) -> Result<EventsWritten> {
        // This may take minutes: to know how far a log is disordered it is read to its end.
        const auto decoder = EventDecoder::Open(options.log, *description, in_order);
        if (!decoder) return tl::unexpected(decoder.error());
        // The reader knows only at its end whether there was a log at all.
        Result<EventsWritten> made = write(decoder->get(), *channels, sink);
        // What is no log becomes no empty file that looks like one.
        const std::string why = (*decoder)->reader().WhyNoLog();
        return why.empty() ? made : Fail(why);
      });
  if (!written) return Unusable(written.error().message);
  // What was not as it should be is said, but what could be read is written.
  if (written->unknown > 0) {
    Warn(fmt::format("{}: {} of a type that nobody defined, kept as bytes", options.log,
                     Counted(written->unknown, "event")));
  }
  if (written->damaged) {
    Warn(options.log + ": damaged places were left out (morphbus verify names them)");
  }
  const std::string more =
      written->for_viewers > 0
          ? fmt::format(" and {} more on the topics for viewers", written->for_viewers)
          : "";
  return Done(options, Counted(written->events, "message") + more,
              {{"messages", written->events},
               {"for_viewers", written->for_viewers},
               {"unknown", written->unknown}});
}

int ToJson(const ConvertOptions& options) {
  return ConvertEvents(options, outputs::kJsonLines, false, WriteJsonLines);
}
int ToMcap(const ConvertOptions& options) {
  return ConvertEvents(options, outputs::kMcap, true, WriteMcap);
}

/// The paths of all tables, each of which may be written; nothing otherwise.
std::optional<std::vector<std::string>> TablePaths(const ConvertOptions& options) {
  namespace fs = std::filesystem;
  std::error_code error;
  // A folder is made if need be; a file in its place is an error.
  if (IsStream(options.output) ||
      (fs::exists(options.output, error) && !fs::is_directory(options.output, error))) {
    return Refuse(options.output + ": the tables need a folder, and this is none");
  }
  // All are looked at before the first is written, so that none is replaced in vain.
  std::vector<std::string> paths;
  for (const CsvTable& table : CsvTables()) {
    // Only files that are of the same kind, or --force, may be replaced.
    paths.push_back(fs::path(options.output) / table.file);
    if (!MayWrite(paths.back(), outputs::kCsvTable, options.force,
                  {options.log, options.description})) {
      return std::nullopt;
    }
  }
  return paths;
}

/// Writes all tables, or none: they get their names once the last of them is whole.
Result<void> WriteTables(const logger::RunLog& log, const std::string& folder,
                         const std::vector<std::string>& paths, WorkProgress* progress) {
  std::error_code error;
  // A folder that we made goes again with what is given up.
  std::optional<TemporaryPath> ours;
  // No signal may come between making the folder and knowing that it is ours.
  std::optional<SignalsBlocked> blocked(std::in_place);
  // A folder that is there already is no error, and not removed with what is given up.
  const bool made = std::filesystem::create_directory(folder, error);
  if (made) ours.emplace(folder);
  blocked.reset();
  if (error) return Fail(fmt::format("cannot make {}: {}", folder, error.message()));
  std::vector<std::unique_ptr<OutputFile>> files;
  for (size_t i = 0; i < paths.size(); ++i) {
    progress->Show(paths[i], static_cast<double>(i) / static_cast<double>(paths.size()));
    Result<std::unique_ptr<OutputFile>> file = OutputFile::Create(paths[i]);
    if (!file) return tl::unexpected(file.error());
    files.push_back(std::move(*file));
    const Result<void> written =
        CsvTables()[i].write(log, [&](std::string_view text) { return files.back()->Write(text); });
    if (!written) return written;
  }
  // Only here do the tables get their names, one after the other.
  for (const std::unique_ptr<OutputFile>& file : files) {
    if (Result<void> closed = file->Close(); !closed) return closed;
  }
  if (made) ours->Keep();
  return {};
}

/// A folder of tables.
int ToCsv(const ConvertOptions& options) {
  WorkProgress progress;
  const std::optional<std::vector<std::string>> paths = TablePaths(options);
  if (!paths) return kUnusable;
  logger::RunLogOptions load;
  load.run = options.run;
  load.traces = true;
  // Tables have all faults, where other commands keep as many as are read.
  load.max_faults = static_cast<size_t>(-1);
  const Result<logger::RunLog> log = LoadLog(options.log, load, options.description);
  if (!log) return Unusable(log.error().message);
  if (Result<void> written = WriteTables(*log, options.output, *paths, &progress); !written) {
    return Unusable(written.error().message);
  }
  // What the tables lack is said, but what could be read is written.
  if (log->robot == nullptr) {
    Warn(options.log +
         ": the log does not hold the robot's model; joints and links are named by "
         "their numbers (--description lends it one)");
  }
  if (!log->facts.whole()) {
    Warn(options.log + ": not whole (morphbus verify says what is missing)");
  }
  Json files = Json::array();
  for (const CsvTable& table : CsvTables()) files.push_back(table.file);
  return Done(options, Counted(static_cast<int64_t>(paths->size()), "table"),
              {{"run", log->facts.run}, {"files", files}});
}

/// The log itself, compressed.
int ToZst(const ConvertOptions& options) {
  const WorkProgress progress;
  if (!MayWrite(options.output, outputs::kCompressedLog, options.force, {options.log})) {
    return kUnusable;
  }
  const Result<logger::CompressionReport> report = WriteThrough(
      options.output,
      [&](const logger::ByteSink& sink) { return logger::CompressLog(options.log, sink); });
  if (!report) return Unusable(report.error().message);
  return Done(
      options,
      fmt::format("{} from {}", Counted(static_cast<int64_t>(report->compressed_bytes), "byte"),
                  report->log_bytes),
      {{"bytes", report->compressed_bytes}, {"log_bytes", report->log_bytes}});
}

/// The run's description alone, for --description.
int ToDescription(const ConvertOptions& options) {
  const Result<std::string> description = logger::ReadDescription(options.log);
  if (!description) return Unusable(description.error().message);
  if (!MayWrite(options.output, outputs::kDescription, options.force, {options.log})) {
    return kUnusable;
  }
  const Result<void> written = WriteFile(options.output, *description);
  if (!written) return Unusable(written.error().message);
  return Done(options, Counted(static_cast<int64_t>(description->size()), "byte"),
              {{"bytes", description->size()}});
}

/// What a log can become.
struct Format {
  const char* name;
  Conversion convert;
  bool by_run;      ///< Takes --run.
  bool by_channel;  ///< Takes --channel.
};
constexpr Format kFormats[] = {{"mcap", ToMcap, false, true},
                               {"csv", ToCsv, true, false},
                               {"json", ToJson, false, true},
                               {"zst", ToZst, false, false},
                               {"description", ToDescription, false, false}};

/// Checks what goes together, and converts.
int Convert(const ConvertOptions& options) {
  // A row decides everything that differs between formats.
  const Format* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                      [&](const Format& f) { return f.name == options.to; });
  if (format == std::end(kFormats)) {
    return Unusable(fmt::format("--to {}{}: expected one of {}", options.to,
                                DidYouMean(options.to, NamesOf(kFormats)),
                                fmt::join(NamesOf(kFormats), ", ")));
  }
  // An option that the format has no use for would seem to have had an effect.
  if (!options.run.empty() && !format->by_run) {
    return Unusable(fmt::format("--run chooses for --to csv; {} takes the whole log{}", options.to,
                                format->by_channel ? ", or what --channel 'RUN/.*' chooses" : ""));
  }
  if (!options.channel.empty() && !format->by_channel) {
    return Unusable("--channel chooses for --to json and --to mcap: leave it out");
  }
  if (!options.description.empty() && !format->by_run && !format->by_channel) {
    return Unusable("--description lends names to --to csv, json and mcap: leave it out");
  }
  if (options.json && IsStdout(options.output)) {
    return Unusable("-o - and --json both write to standard output: give -o a file");
  }
  return format->convert(options);
}

}  // namespace

void AddConvert(CommandLine* line) {
  Subcommand sub = line->Add("convert", "A log for other programs: MCAP, CSV, JSON, or compressed");
  auto options = std::make_shared<ConvertOptions>();
  sub.Add("LOG", &options->log, "Log file; it is left as it is").Required();
  sub.Add("--to", &options->to,
          "mcap (Foxglove and others), csv (a folder, one table a quantity), json (one object a "
          "message, a line each), zst (the same log compressed; all commands read it), description "
          "(of the run, for --description)")
      .TypeName(fmt::format("{}", fmt::join(NamesOf(kFormats), "|")))
      .Required();
  sub.Add("-o,--output", &options->output, "File or, for csv, folder to write; '-': stdout")
      .TypeName("FILE|FOLDER")
      .Required();
  sub.Add("--run", &options->run, "csv: which run, if the log holds several (default: the first)")
      .TypeName("NAME");
  sub.Add("-e,--channel", &options->channel, "json, mcap: only channels whose whole name matches")
      .TypeName("REGEX");
  sub.Description(&options->description);
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "docs/data.md describes what comes out.\n"
      "Examples:\n  morphbus convert walk.log --to csv -o walk\n"
      "  morphbus convert walk.log --to json --channel 'walk/.*/STATUS' -o - | jq "
      ".message.role_name\n"
      "  morphbus convert walk.log --to mcap -o walk.mcap\n"
      "  morphbus convert walk.log --to zst -o walk.log.zst");
  sub.Do([options] { return Convert(*options); });
}

}  // namespace morphbus::tools
