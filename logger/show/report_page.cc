#include "logger/show/report_page.h"

#include <fmt/format.h>

#include "logger/show/report_style.h"

namespace morphbus::logger {

std::string TableHead(const std::vector<std::string>& columns, const std::string& kind) {
  std::string html = fmt::format("<div class='scroll'><table{}><thead><tr>",
                                 kind.empty() ? "" : fmt::format(" class='{}'", kind));
  for (const std::string& column : columns) {
    // A column's text says how it is set, so that a table's head can be written as one list.
    const bool number = column.starts_with('#');
    const size_t unit = column.find('|');
    html += (number ? "<th class='n'>" : "<th>") + column.substr(0, unit).substr(number ? 1 : 0);
    if (unit != std::string::npos) html += "<br><small>" + column.substr(unit + 1) + "</small>";
    html += "</th>";
  }
  return html + "</tr></thead><tbody>";
}

PlotPoints Over(const ScalarTrack& track, double scale) {
  PlotPoints points;
  for (size_t i = 0; i < track.value.size(); ++i) {
    points.emplace_back(Seconds(track.time_us[i]), track.value[i] * scale);
  }
  return points;
}

void ReportPage::Begin(const std::string& title, const std::string& heading, const char* style) {
  // The style stands in the page itself, which is one file that can be sent to anybody.
  html_ = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'>"
      "<title>{}</title><style>{}{}</style></head><body><main><h1>{}</h1>",
      EscapeHtml(title), kReportStyle, style, EscapeHtml(heading));
}

std::string ReportPage::End() {
  html_ += "</main></body></html>\n";
  return std::move(html_);
}

void ReportPage::Fact(const char* name, const std::string& value) {
  // What is not known has no line.
  if (!value.empty()) html_ += fmt::format("<dt>{}</dt><dd>{}</dd>", name, EscapeHtml(value));
}

void ReportPage::RunFacts(const RunLog& log) {
  const LogFacts& f = log.facts;
  Fact("robot", f.robot_name + (f.model_file.empty() ? "" : "  (" + f.model_file + ")"));
  Fact("program", f.program_file);
  Fact("parameters", dynarole::ParametersText(f.parameters));
  Fact("set of the model", fmt::format("{}", fmt::join(f.attributes, ", ")));
  Fact("run", f.run + (f.mode.empty() ? "" : ", " + f.mode));
  Fact("length",
       fmt::format("{:.3f} s, {} ticks of {:.0f} ms", f.seconds, f.ticks, f.tick_us * 1e-3));
  Fact("modules",
       fmt::format("{}, root {}", log.modules.size(), f.root_module.empty() ? "?" : f.root_module));
}

void ReportPage::MessageFact(const LogFacts& facts) {
  Fact("messages", fmt::format("{} events, {} lost, {} damaged places", facts.events, facts.lost(),
                               facts.num_damage));
}

void ReportPage::BuildFacts(const LogFacts& facts) {
  Fact("started", facts.started);
  Fact("build", facts.build);
  // Logs of earlier versions do not tell of the machine's arithmetic.
  Fact("arithmetic", facts.arithmetic.empty() ? "not known" : facts.arithmetic);
}

void ReportPage::Notes(const std::vector<std::string>& notes) {
  if (notes.empty()) return;
  html_ += "<section class='notes'><h2>What to know</h2><ul>";
  for (const std::string& note : notes) html_ += "<li>" + EscapeHtml(note) + "</li>";
  html_ += "</ul></section>";
}

void ReportPage::Figure(const std::vector<PlotLine>& lines, const PlotOptions& options) {
  html_ += "<figure>" + PlotSvg(lines, options) + "</figure>";
}

PlotOptions ReportPage::OverTime(std::string title, const char* unit, int height,
                                 double least) const {
  // All plots over time have one width, so that instants lie below each other.
  return {std::move(title), "sim time (s)", unit, 640, height, false, least, marks_};
}

}  // namespace morphbus::logger
