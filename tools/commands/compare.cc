// morphbus compare: are two runs the same walk?

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include "logger/compare/comparer.h"
#include "logger/log/run_log.h"
#include "logger/show/report.h"
#include "tools/base/lent_description.h"
#include "tools/base/output_path.h"
#include "tools/base/print.h"
#include "tools/base/work_progress.h"
#include "tools/commands/commands.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus compare`, tolerances and groups as they were written.
struct CompareOptions {
  std::string a;
  std::string b;
  std::string report;
  std::string align = "tick";
  std::string level = "sample";
  std::string tolerance_file;
  std::string description;
  std::vector<std::string> tolerances;
  std::vector<std::string> without;
  std::string baseline;
  bool update = false;
  bool force = false;
  bool json = false;
  bool all = false;  ///< Figures of every role.
};

/// For the help and for suggestions.
std::vector<std::string> NamesOfTolerances() {
  std::vector<std::string> names;
  for (const auto& [name, member] : logger::ToleranceNames()) names.push_back(name);
  return names;
}

/// The tolerance that "name=value" sets for all; fails for another text.
Result<logger::ToleranceEntry> ParseTolerance(const std::string& text) {
  // A text without a sign of equality is all name, and fits no tolerance.
  const size_t equals = std::min(text.find('='), text.size());
  const std::string wanted = text.substr(0, equals);
  for (const auto& [name, member] : logger::ToleranceNames()) {
    if (wanted != name || equals == text.size()) continue;
    // Entries of options are for all roles and labels ("*"); those of a file may name them.
    const Result<double> value = logger::ReadTolerance(name, text.substr(equals + 1));
    if (!value) return Fail(fmt::format("--tolerance {}: {}", text, value.error().message));
    return logger::ToleranceEntry{"*", "*", member, *value};
  }
  // No tolerance has this name: the nearest one is suggested.
  const std::vector<std::string> names = NamesOfTolerances();
  return Fail(fmt::format("--tolerance {}{}: expected NAME=VALUE, NAME one of {}", text,
                          DidYouMean(wanted, names), fmt::join(names, ", ")));
}

/// Reads the file of tolerances; prints what is wrong with it.
bool ReadToleranceFile(const std::string& path, std::vector<logger::ToleranceEntry>* entries) {
  source::SourceSet sources;
  const Result<int> file = sources.AddFile(path);
  if (!file) {
    Unusable("--tolerances: " + file.error().message);
    return false;
  }
  source::Diagnostics diagnostics;
  source::CheckUtf8(sources, *file, &diagnostics);
  if (!diagnostics.had_errors()) *entries = logger::ParseTolerances(sources, *file, &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  return !diagnostics.had_errors();
}

/// The way of comparing that the options ask for; says what is wrong with them.
std::optional<logger::CompareOptions> WayOf(const CompareOptions& options) {
  logger::CompareOptions way;
  Result<std::string> lent = LentDescription(options.description);
  if (!lent) return Refuse(lent.error().message);
  way.description = *std::move(lent);
  // The file comes first, so that options on the command line count.
  if (!options.tolerance_file.empty() &&
      !ReadToleranceFile(options.tolerance_file, &way.tolerances)) {
    return std::nullopt;
  }
  for (const std::string& text : options.tolerances) {
    const Result<logger::ToleranceEntry> entry = ParseTolerance(text);
    if (!entry) return Refuse(entry.error().message);
    way.tolerances.push_back(*entry);
  }
  // Groups of quantities that a log may lack, such as those of a simulated world.
  const std::vector<std::string> groups(std::begin(logger::kQuantityGroups),
                                        std::end(logger::kQuantityGroups));
  for (const std::string& name : options.without) {
    if (std::find(groups.begin(), groups.end(), name) == groups.end()) {
      return Refuse(fmt::format("--without {}{}: expected one of {}", name,
                                DidYouMean(name, groups), fmt::join(groups, ", ")));
    }
    way.without.insert(name);
  }
  bool known = false;
  for (const logger::Align align :
       {logger::Align::kTick, logger::Align::kEvent, logger::Align::kLag}) {
    if (options.align != logger::AlignName(align)) continue;
    way.align = align;
    known = true;
  }
  if (!known) {
    return Refuse(fmt::format("--align {}{}: expected tick, event or lag", options.align,
                              DidYouMean(options.align, {"tick", "event", "lag"})));
  }
  // The level decides whether samples are compared one by one or the figures of the gait.
  if (options.level == "gait") {
    way.level = logger::Level::kGait;
  } else if (options.level != "sample") {
    return Refuse(fmt::format("--level {}{}: expected sample or gait", options.level,
                              DidYouMean(options.level, {"sample", "gait"})));
  }
  return way;
}

/// Where the baseline of a log lies: under its own name.
std::string BaselineOf(const std::string& folder, const std::string& log) {
  return (std::filesystem::path(folder) / std::filesystem::path(log).filename()).string();
}

/// Keeps a log as the baseline of its name. One that is not whole could never be equivalent.
Result<void> Store(const std::string& log, const std::string& baseline) {
  // Without the series: the facts say whether it is whole.
  const Result<logger::RunLog> loaded = logger::LoadRunLog(log, {"", false});
  if (!loaded) return Fail(loaded.error().message);
  if (!loaded->facts.whole()) {
    return Fail(log + " cannot be a baseline: it is damaged or incomplete (morphbus verify tells)");
  }
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(baseline).parent_path(), error);
  if (error) return Fail(fmt::format("cannot store {}: {}", baseline, error.message()));
  // Copied beside its place and renamed, so that there is never half a baseline.
  std::ifstream from(log, std::ios::binary);
  Result<std::unique_ptr<OutputFile>> to = OutputFile::Create(baseline);
  if (!to) return tl::unexpected(to.error());
  std::vector<char> piece(size_t{1} << 20);
  // The last piece is shorter than the buffer: read() then fails and has still given bytes.
  while (from.read(piece.data(), static_cast<std::streamsize>(piece.size())), from.gcount() > 0) {
    const std::string_view bytes(piece.data(), static_cast<size_t>(from.gcount()));
    if (Result<void> written = (*to)->Write(bytes); !written) return written;
  }
  if (!from.eof()) return Fail("cannot read " + log);
  return (*to)->Close();
}

/// One comparison of two files, printed.
struct Answer {
  int status = kDone;
  Json json;
  std::string text;
};

int StatusOf(logger::Verdict verdict) {
  // "Cannot tell" is no answer: status 2, as for input that cannot be used.
  if (verdict == logger::Verdict::kUnusable) return kUnusable;
  return verdict == logger::Verdict::kEquivalent ? kDone : kNo;
}

Answer AnswerOf(const logger::Comparison& comparison, bool all) {
  return {StatusOf(comparison.verdict), logger::ComparisonJson(comparison),
          logger::ComparisonText(comparison, all)};
}

/// Compares two files, and writes the page if one is asked for. Fails if a file cannot be read or
/// the page cannot be written.
Result<Answer> CompareFiles(const std::string& path_a, const std::string& path_b,
                            const logger::CompareOptions& way, const std::string& report,
                            bool all) {
  // A page needs all of both logs; without one they are read side by side.
  if (report.empty()) {
    const Result<logger::Comparison> compared = logger::CompareFiles(path_a, path_b, way);
    if (!compared) return tl::unexpected(compared.error());
    return AnswerOf(*compared, all);
  }
  // A damaged log is still loaded as far as it goes; the comparison then says that it cannot tell.
  const Result<logger::RunLog> a = logger::LoadRunLog(path_a, {"", true, false, way.description});
  if (!a) return tl::unexpected(a.error());
  const Result<logger::RunLog> b = logger::LoadRunLog(path_b, {"", true, false, way.description});
  if (!b) return tl::unexpected(b.error());
  const logger::Comparison comparison = logger::Compare(*a, *b, way);
  // The page is written whatever the verdict: it shows where the runs differ.
  const Result<void> written = WriteFile(report, logger::ReportHtml(*a, *b, comparison));
  if (!written) return tl::unexpected(written.error());
  return AnswerOf(comparison, all);
}

/// Compares each log with its baseline, or makes it that. `answer` gets what there is to say of
/// them beside what it has.
Result<void> CompareBaselines(const CompareOptions& options, const logger::CompareOptions& way,
                              Answer* answer) {
  answer->json["baseline"] = Json::array();
  std::vector<std::string> logs = {options.a};
  if (!options.b.empty()) logs.push_back(options.b);
  for (const std::string& log : logs) {
    const std::string baseline = BaselineOf(options.baseline, log);
    Json entry = {{"log", log}, {"baseline", baseline}, {"stored", false}};
    std::error_code unknown;
    // The first comparison of a log stores it: there is nothing yet that it could differ from.
    if (options.update || !std::filesystem::exists(baseline, unknown)) {
      const Result<void> stored = Store(log, baseline);
      if (!stored) return stored;
      entry["stored"] = true;
      answer->text += fmt::format("stored {} as the baseline {}\n", log, baseline);
    } else {
      // The page is of the only comparison there is.
      const bool alone = options.b.empty();
      Result<Answer> compared =
          CompareFiles(baseline, log, way, alone ? options.report : "", options.all);
      if (!compared) return tl::unexpected(compared.error());
      entry["verdict"] = compared->json["verdict"];
      entry["reason"] = compared->json["reason"];
      answer->text += compared->text;
      // The worst of all answers counts: 2, cannot tell, is above 1, different.
      answer->status = std::max(answer->status, compared->status);
      if (alone) {
        // With one comparison the whole object is that of a comparison; with several there is a
        // list of verdicts.
        compared->json["baseline"] = answer->json["baseline"];
        answer->json = std::move(compared->json);
      }
    }
    answer->json["baseline"].push_back(std::move(entry));
  }
  return {};
}

/// Why the options do not go together; empty if they do.
std::string WhyNotTogether(const CompareOptions& options) {
  // Two results on one stream could not be told apart.
  if (options.json && IsStdout(options.report)) {
    return "--report - and --json both write to standard output: give --report a file";
  }
  if (options.baseline.empty()) {
    if (options.b.empty()) return "compare needs two logs, or one and --baseline DIR";
    if (options.update) return "--update renews what --baseline keeps: say with it where";
    return "";
  }
  namespace fs = std::filesystem;
  for (const std::string& log : {options.a, options.b}) {
    std::error_code unknown;
    if (log.empty()) continue;
    const std::string baseline = BaselineOf(options.baseline, log);
    // A log that lies in the folder of baselines would be compared with itself, or replaced by
    // itself.
    if (fs::equivalent(log, baseline, unknown)) return log + " is itself the baseline";
  }
  if (!options.b.empty() &&
      BaselineOf(options.baseline, options.a) == BaselineOf(options.baseline, options.b)) {
    return "baselines are kept under the names of the logs, and both have the same name";
  }
  return "";
}

/// Loads the logs, compares them, and answers as text, JSON or page. The verdict is the exit
/// status.
int CompareLogs(const CompareOptions& options) {
  const WorkProgress progress;
  // What is wrong with the options is said before logs are read, which takes longer.
  if (const std::string why = WhyNotTogether(options); !why.empty()) return Unusable(why);
  const std::optional<logger::CompareOptions> way = WayOf(options);
  if (!way || !MayWrite(options.report, outputs::kReport, options.force,
                        {options.a, options.b, options.tolerance_file})) {
    return kUnusable;
  }
  Answer answer;
  if (!options.b.empty()) {
    Result<Answer> compared = CompareFiles(options.a, options.b, *way, options.report, options.all);
    if (!compared) return Unusable(compared.error().message);
    answer = std::move(*compared);
  }
  if (!options.baseline.empty()) {
    const Result<void> done = CompareBaselines(options, *way, &answer);
    if (!done) return Unusable(done.error().message);
  }
  // A page on standard output leaves no room for the text.
  if (options.json) {
    PrintJson(answer.json);
  } else if (!IsStdout(options.report)) {
    PrintText(answer.text);
  }
  return answer.status;
}

}  // namespace

void AddCompare(CommandLine* line) {
  Subcommand sub = line->Add(
      "compare",
      "Are two runs the same walk, by role and label? Exit status 0 yes, 1 no, 2 cannot say");
  auto options = std::make_shared<CompareOptions>();
  sub.Add("A", &options->a, "Log file").TypeName("LOG").Required();
  sub.Add("B", &options->b, "Log file; not needed with --baseline").TypeName("LOG");
  sub.Flag("--all", &options->all, "Figures of every role, not only of the one that differs most");
  sub.Add("--report", &options->report,
          "Write a page with plots (one self-contained file; '-': only that, on stdout)")
      .TypeName("OUT.html");
  sub.Add("--align", &options->align,
          "By what times are matched: tick (default), event (commands that begin, roles that are "
          "taken), lag (one shift for all)")
      .TypeName("tick|event|lag");
  sub.Add("--level", &options->level,
          "What is compared: sample (default: every instant), gait (cycle, distance, turn, duty)")
      .TypeName("sample|gait");
  sub.Add("--tolerances", &options->tolerance_file,
          "File of tolerances, also by role and label (TOML; docs/log.md has the format)")
      .TypeName("FILE.toml");
  sub.Add("--tolerance", &options->tolerances,
          fmt::format("Largest difference that counts as none; may be repeated. NAME is one of {}",
                      fmt::join(NamesOfTolerances(), ", ")))
      .TypeName("TOLERANCE=VALUE")
      .Repeatable();
  sub.Add("--without", &options->without,
          fmt::format("Leave quantities out that a log does not hold; may be repeated: {}",
                      fmt::join(logger::kQuantityGroups, ", ")))
      .TypeName(fmt::format("{}", fmt::join(logger::kQuantityGroups, "|")))
      .Repeatable();
  sub.Add("--baseline", &options->baseline,
          "Compare with the log of the same name that DIR keeps; keep it there if there is none")
      .TypeName("FOLDER");
  sub.Flag("--update", &options->update, "Keep the log as the new baseline");
  sub.Description(&options->description);
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Examples:\n  morphbus compare a.log b.log --report report.html\n"
      "  morphbus compare a.log b.log --tolerance simulated_m=0.005 --json\n"
      "  morphbus compare lockstep.log realtime.log --align event\n"
      "  morphbus compare lockstep.log hardware.log --level gait --without simulated\n"
      "  morphbus compare walk.log --baseline baselines");
  sub.Do([options] { return CompareLogs(*options); });
}

}  // namespace morphbus::tools
