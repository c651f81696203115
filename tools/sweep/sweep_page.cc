#include "tools/sweep/sweep_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include "compiler/base/text.h"
#include "logger/log/run_log.h"
#include "logger/show/moment_pictures.h"
#include "logger/show/report_page.h"
#include "logger/show/svg_plot.h"
#include "tools/base/files.h"
#include "tools/base/share_folder.h"
#include "tools/sweep/best_rows.h"
#include "tools/sweep/expectations.h"
#include "tools/sweep/search.h"
#include "tools/sweep/sweep_columns.h"
#include "tools/sweep/sweep_estimate.h"

namespace morphbus::tools {
namespace {

/// Rows that a page holds, so that browsers can. Of more every second, third … one is shown, and
/// the best ones.
constexpr int64_t kMostShown = 20000;
/// Pictures of a row.
constexpr int kMoments = 5;
/// How far a robot came, whichever way it went.
constexpr const char* kFarthest = "hypot(displacement.north, displacement.east)";

/// What the page has beyond those of runs.
constexpr const char* kStyle = R"css(
.strip{display:grid;grid-template-columns:repeat(5,minmax(0,1fr));gap:8px;margin:8px 0}
.best{margin:14px 0 22px}.best h3{font-size:15px;margin:0 0 2px}.best p{margin:0}
code{font-family:ui-monospace,"DejaVu Sans Mono",monospace;font-size:12.5px;overflow-wrap:anywhere}
.holds{color:var(--good)}.fails{color:var(--bad);font-weight:650}
.controls{display:flex;flex-wrap:wrap;gap:6px 16px;align-items:center;margin:0 0 8px}
select,button{font:inherit;font-size:13px;color:var(--text);background:var(--bg);
border:1px solid var(--line);border-radius:6px;padding:3px 8px}
.chart{height:420px}.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(480px,1fr));gap:14px}
.panel{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:12px 16px}
th button{border:0;background:none;padding:0;color:inherit;font-weight:600;cursor:pointer}
tr.chosen td{background:var(--grid)}tbody tr{cursor:pointer}
@media (max-width:560px){.strip{grid-template-columns:repeat(2,minmax(0,1fr))}
.charts{grid-template-columns:minmax(0,1fr)}}
)css";

/// A text of several lines for a <pre> element.
std::string EscapedLines(const std::string& text) {
  std::string html;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    html += logger::EscapeHtml(text.substr(begin, end - begin)) + "\n";
    begin = end + 1;
  }
  return html;
}

/// What all rows together say.
struct Totals {
  std::set<std::string> versions, hosts;
  double seconds = 0;
};

/// The page, section by section.
class SweepPage : private logger::ReportPage {
 public:
  SweepPage(SweepStore* store, const SweepPageOptions& options)
      : store_(*store), options_(options) {}

  Result<std::string> Build() {
    if (Result<void> read = ReadAll(); !read) return Fail(read.error().message);
    const std::string title =
        (search_ ? "Search " : "Sweep ") + std::filesystem::path(store_.path()).filename().string();
    Begin(title, title);
    html_ += fmt::format("<style>{}</style>", kStyle);
    Summary();
    Notes(notes_);
    Expectations();
    if (Result<void> shown = Best(); !shown) return Fail(shown.error().message);
    Plots();
    Source();
    return End();
  }

 private:
  /// All that the page says, but for the pictures.
  Result<void> ReadAll() {
    const Result<RowCounts> counts = store_.Counts();
    Result<SweepOrigin> origin = store_.Origin();
    if (!counts) return Fail(counts.error().message);
    if (!origin) return Fail(origin.error().message);
    counts_ = *counts;
    origin_ = std::move(*origin);
    if (counts_.done == 0) return Fail(store_.path() + " has no row that is done");
    if (Result<void> read = ReadFileOfSweep(); !read) return read;
    Result<std::vector<RankedRow>> best =
        BestRows(&store_, *by_, smallest_, std::max(options_.best, 1));
    if (!best) return Fail(best.error().message);
    best_ = std::move(*best);
    return ReadRows();
  }

  /// The sweep's file, for what it expects and which rows it calls the best.
  Result<void> ReadFileOfSweep() {
    by_ = options_.by;
    smallest_ = options_.smallest;
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const int file = sources.AddText("the sweep", origin_.text);
    // What its files say has been compiled long ago: they may be gone.
    const std::string path = origin_.folder + "/sweep.toml";
    const auto tree = source::ParseToml(sources, file, &diagnostics);
    if (tree && IsSearch(*tree)) {
      search_ = ReadSearchFile(&sources, file, path, origin_.words, &diagnostics);
      if (search_) TakeGoal(search_->goals.front().expression, search_->goals.front().smallest);
    } else if (const auto sweep =
                   ReadSweepFile(&sources, file, path, origin_.words, &diagnostics)) {
      if (sweep->keep.by) TakeGoal(*sweep->keep.by, sweep->keep.smallest);
      if (Result<void> looked = LookAtExpectations(*sweep); !looked) return looked;
    }
    if (diagnostics.had_errors()) {
      notes_.emplace_back(
          "this version does not understand the sweep's file: what it expects is "
          "left out");
    }
    ExpressionError none;
    if (!by_) by_ = FigureExpression::Read(kFarthest, &none);
    return {};
  }

  /// Ranks rows by what the file names, unless the command line has named something.
  void TakeGoal(const FigureExpression& expression, bool smallest) {
    if (by_) return;
    by_ = expression;
    smallest_ = smallest;
  }

  Result<void> LookAtExpectations(const SweepFile& sweep) {
    // While rows are missing nothing can be said.
    if (counts_.missing() > 0) return {};
    Result<std::vector<ExpectationResult>> expectations = CheckExpectations(sweep, &store_);
    if (!expectations) return Fail(expectations.error().message);
    expectations_ = std::move(*expectations);
    return {};
  }

  /// The columns of the plots.
  Result<void> ReadRows() {
    // The first time through shows what differs between rows: that is what the columns are.
    Result<void> read = store_.EachRow([&](const StoredRow& row) {
      columns_.Look(row);
      if (!row.result) return true;
      totals_.versions.insert(row.result->version);
      totals_.hosts.insert(row.result->host);
      totals_.seconds += row.result->seconds;
      return true;
    });
    if (!read) return read;
    // Of very many rows evenly spaced ones are shown.
    const int64_t every = (counts_.rows + kMostShown - 1) / kMostShown;
    if (every > 1) {
      notes_.push_back(fmt::format(
          "of {} rows one in {} is shown below, and the best ones: morphbus sweep export has all",
          counts_.rows, every));
    }
    return store_.EachRow([&](const StoredRow& row) {
      const bool best = std::ranges::any_of(
          best_, [&row](const RankedRow& one) { return one.row.place == row.place; });
      if (row.place % every != 0 && !best) return true;
      // It could be computed when the best rows were sought.
      const Json goal = ValueIn(row, *by_).value_or(Json());
      // So could these, or the search would have ended.
      std::vector<Json> goals;
      for (size_t i = 0; search_ && i < search_->goals.size(); ++i) {
        goals.push_back(ValueIn(row, search_->goals[i].expression).value_or(Json()));
      }
      columns_.Add(row, goal, goals, !search_ || Fulfils(*search_, row).value_or(false));
      return true;
    });
  }

  void Summary() {
    html_ += "<div class='cards'><section class='card'><h2>The sweep</h2><dl>";
    Fact("database", store_.path());
    Fact("rows", fmt::format("{}: {} done, {} failed, {} crashed, {} out of time, {} missing",
                             counts_.rows, counts_.done, counts_.failed, counts_.crashed,
                             counts_.timeout, counts_.missing()));
    Fact("run in", DurationText(totals_.seconds) + " of wall time, one after the other");
    Fact("by", fmt::format("{}", fmt::join(totals_.versions, ", ")));
    Fact("on", fmt::format("{}", fmt::join(totals_.hosts, ", ")));
    html_ += "</dl></section></div>";
    if (totals_.versions.size() > 1) {
      notes_.emplace_back(
          "several versions of morphbus ran these rows: morphbus sweep verify says whether they "
          "agree");
    }
    if (counts_.missing() > 0) notes_.emplace_back("not all rows have been run yet");
  }

  void Expectations() {
    if (expectations_.empty()) return;
    html_ += "<section><h2>What is expected</h2>" +
             logger::TableHead({"expectation", "", "#rows", "#failures", "first failure"});
    for (const ExpectationResult& one : expectations_) {
      const std::string first =
          one.failures.empty()
              ? one.rows == 0 ? "it is about no row" : ""
              : fmt::format("row {}: {}", one.failures.front().place, one.failures.front().why);
      html_ += fmt::format(
          "<tr><td>{}</td><td class='{}'>{}</td><td class='n'>{}</td><td class='n'>{}</td>"
          "<td>{}</td></tr>",
          logger::EscapeHtml(one.text), one.holds ? "holds" : "fails",
          one.holds ? "holds" : "fails", one.rows, one.failures.size(), logger::EscapeHtml(first));
    }
    html_ += std::string(logger::kTableEnd) + "</section>";
  }

  /// The best rows, each run again for its pictures.
  Result<void> Best() {
    if (options_.best == 0 || best_.empty()) return {};
    html_ += fmt::format("<section><h2>Best rows, by {} {}</h2>", smallest_ ? "least" : "most",
                         logger::EscapeHtml(by_->text()));
    for (const RankedRow& one : best_) {
      const Result<std::string> description = store_.DescriptionOf(one.row.key);
      if (!description) return Fail(description.error().message);
      html_ += fmt::format(
          "<div class='best'><h3>Row {}: {:.6g}</h3><p class='dim'>{}</p><div class='strip'>{}"
          "</div><code>{}</code></div>",
          one.row.place, one.value, logger::EscapeHtml(PointText(one.row.point)),
          StripOf(*description, one.row), logger::EscapeHtml(RerunCommand(one.row.place)));
    }
    html_ += "</section>";
    return {};
  }

  /// Pictures of the run, or why there are none.
  static std::string StripOf(const std::string& description, const StoredRow& row) {
    const auto none = [](const std::string& why) {
      return fmt::format("<p class='dim'>no pictures: {}</p>", logger::EscapeHtml(why));
    };
    const Result<RunRecord> record = RunRecord::InMemory();
    if (!record) return none(record.error().message);
    const RowResult again = RunForRow(description, *record);
    if (again.status != RowResult::Status::kRan) return none(again.error);
    const Result<logger::RunLog> log = logger::LoadRunLog(record->path(), {"", true});
    if (!log) return none(log.error().message);
    // Pictures of another run would lie.
    if (again.hash != row.result->hash) return none("it goes another way here");
    return logger::StripHtml(*log, kMoments, 200);
  }

  [[nodiscard]] std::string RerunCommand(int64_t place) const {
    return fmt::format("morphbus sweep rerun {} {} --log row-{}.log", ShellWord(store_.path()),
                       place, place);
  }

  /// The rows for the scripts, and the scripts.
  void Plots() {
    const std::string folder = ShareFolder("sweep");
    const Result<std::string> script = ReadFile(folder + "/report.js", size_t{16} << 20);
    const Result<std::string> licences = ReadFile(folder + "/licenses.txt", size_t{4} << 20);
    if (!script || !licences) {
      html_ +=
          "<section class='notes'><p>The plots are not there: this program was built without "
          "Node.js. morphbus sweep export has their numbers.</p></section>";
      return;
    }
    Json rows = columns_.TakeJson();
    rows["goal"] = by_->text();
    rows["smallest"] = smallest_;
    Json goals = Json::array();
    for (size_t i = 0; search_ && i < search_->goals.size(); ++i) {
      const SearchGoal& goal = search_->goals[i];
      goals.push_back({{"text", goal.expression.text()}, {"smallest", goal.smallest}});
    }
    rows["search"] = goals;
    rows["rerun"] = fmt::format("morphbus sweep rerun {} ", ShellWord(store_.path()));
    // Nothing in a text ends the element.
    std::string text = JsonText(rows);
    for (size_t at = 0; (at = text.find('<', at)) != std::string::npos;) {
      text.replace(at, 1, "\\u003c");
    }
    html_ += fmt::format(
        "<section id='plots'></section><script type='application/json' id='rows'>{}</script>"
        "<script>{}</script><details><summary>Software of others in this page</summary><pre>{}"
        "</pre></details>",
        text, *script, EscapedLines(*licences));
  }

  /// The file, so that the page says what it shows.
  void Source() {
    std::string text = origin_.text;
    for (const std::string& word : origin_.words) text += "# command line: " + word + "\n";
    html_ += fmt::format("<details><summary>The sweep's file</summary><pre>{}</pre></details>",
                         EscapedLines(text));
  }

  SweepStore& store_;
  const SweepPageOptions& options_;
  RowCounts counts_;
  SweepOrigin origin_;
  Totals totals_;
  /// If the rows are those of a search.
  std::optional<SearchFile> search_;
  std::optional<FigureExpression> by_;
  bool smallest_ = false;
  std::vector<RankedRow> best_;
  std::vector<ExpectationResult> expectations_;
  SweepColumns columns_;
  std::vector<std::string> notes_;
};

}  // namespace

Result<std::string> SweepPageHtml(SweepStore* store, const SweepPageOptions& options) {
  return SweepPage(store, options).Build();
}

}  // namespace morphbus::tools
