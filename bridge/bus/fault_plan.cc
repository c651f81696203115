#include "bridge/bus/fault_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>

#include "compiler/base/quantity.h"

namespace morphbus::bridge {
namespace {

using source::Span;

/// The largest time that is taken, seconds of sim time: as that of --seconds.
constexpr double kMostSeconds = 1e6;
/// The largest lateness, seconds: longer than any party waits for an answer.
constexpr double kMostLateSeconds = 10;

/// A word of the file, without blanks, and where it stands.
struct Word {
  std::string_view text;
  Span span;
};

/// The keys of a rule, in the order in which messages list them.
const std::vector<std::string>& Keys() {
  static const std::vector<std::string> keys = {"loss",    "duplicate", "reorder", "delay",
                                                "late",    "by",        "corrupt", "process",
                                                "channel", "from",      "until"};
  return keys;
}

/// Seconds of a text with a unit; a number alone is none here.
std::optional<double> TimeIn(std::string_view text) {
  return text.ends_with('s') ? ReadSeconds(text) : std::nullopt;
}

/// Reads one file.
class Parser {
 public:
  Parser(const source::SourceSet& sources, int file, const std::vector<std::string>& modules,
         source::Diagnostics* diagnostics)
      : text_(sources.text(file)), file_(file), modules_(modules), diagnostics_(diagnostics) {}

  /// The whole file, line by line; after an error in one line it goes on with the next.
  FaultPlan Parse() {
    size_t begin = 0;
    while (begin < text_.size() && !diagnostics_->full()) {
      // The last line need not end with a newline.
      const size_t end = std::min(text_.find('\n', begin), text_.size());
      ParseLine(WordsOf(begin, end));
      begin = end + 1;
    }
    return std::move(plan_);
  }

 private:
  /// The words of the line [begin, end) before its comment.
  [[nodiscard]] std::vector<Word> WordsOf(size_t begin, size_t end) const {
    constexpr std::string_view kBlanks = " \t\r";
    // What stands behind # is for people.
    end = begin + std::min(text_.substr(begin, end - begin).find('#'), end - begin);
    std::vector<Word> words;
    while (true) {
      const std::string_view rest = text_.substr(begin, end - begin);
      const size_t first = rest.find_first_not_of(kBlanks);
      if (first == std::string_view::npos) return words;
      const size_t last = std::min(rest.find_first_of(kBlanks, first), rest.size());
      // Each word keeps its place, at which errors point.
      words.push_back({rest.substr(first, last - first), {file_, begin + first, begin + last}});
      begin += last;
    }
  }

  /// A line is empty, the seed or a rule.
  void ParseLine(const std::vector<Word>& words) {
    if (words.empty()) return;
    if (words[0].text == "seed") return ParseSeed(words);
    if (words[0].text == "fault") return ParseRule(words);
    diagnostics_->Error(words[0].span, "expected 'seed' or 'fault' at the beginning of a line")
        .Hint(source::NearestHint(std::string(words[0].text), {"seed", "fault"},
                                  "for example: fault loss=0.3 duplicate=0.1"));
  }

  /// "seed NUMBER", once in the file.
  void ParseSeed(const std::vector<Word>& words) {
    const auto seed = words.size() == 2 ? ReadNumber<uint64_t>(words[1].text) : std::nullopt;
    if (!seed) {
      diagnostics_->Error(words.back().span, "expected one whole number after 'seed'");
    } else if (plan_.seed) {
      diagnostics_->Error(words[0].span, "the seed is given twice");
    } else {
      plan_.seed = seed;
    }
  }

  /// "fault KEY=VALUE ...", each key once, in any order.
  void ParseRule(const std::vector<Word>& words) {
    const int errors = diagnostics_->error_count();
    FaultRule rule;
    std::set<std::string_view> given;
    for (size_t i = 1; i < words.size(); ++i) {
      const Word& word = words[i];
      const size_t sign = word.text.find('=');
      if (sign == std::string_view::npos || sign == 0) {
        diagnostics_->Error(word.span, "expected KEY=VALUE")
            .Hint("a rule has no blanks around '='");
        continue;
      }
      const std::string_view key = word.text.substr(0, sign);
      if (!given.insert(key).second) {
        diagnostics_->Error(word.span, "'" + std::string(key) + "' is given twice");
        continue;
      }
      // Both sides of the sign, with their places.
      const Word value = {word.text.substr(sign + 1),
                          {file_, word.span.begin + sign + 1, word.span.end}};
      ParseValue(Word{key, {file_, word.span.begin, word.span.begin + sign}}, value, &rule);
    }
    // What single values cannot show is looked at where these are sound.
    if (diagnostics_->error_count() == errors) CheckRule(words[0], given, rule);
    // A rule with errors counts as well, since the plan is used only if there are none.
    if (plan_.rules.size() == kMostFaultRules) {
      diagnostics_->Error(words[0].span,
                          "too many rules: at most " + std::to_string(kMostFaultRules));
      return;
    }
    plan_.rules.push_back(rule);
  }

  /// One key of a rule and its value.
  void ParseValue(const Word& key, const Word& value, FaultRule* rule) {
    // Chances are all alike.
    const std::array<std::pair<std::string_view, double*>, 5> chances = {
        {{"loss", &rule->loss},
         {"duplicate", &rule->duplicate},
         {"reorder", &rule->reorder},
         {"late", &rule->late},
         {"corrupt", &rule->corrupt}}};
    for (const auto& [name, chance] : chances) {
      if (key.text == name) return ParseChance(value, chance);
    }
    if (key.text == "delay") return ParseDelay(value, &rule->delay);
    if (key.text == "by") return ParseLateness(value, &rule->by_us);
    if (key.text == "process") return ParsePattern(value, Processes(), &rule->process);
    if (key.text == "channel") return ParsePattern(value, Channels(), &rule->channel);
    if (key.text == "from") return ParseTime(value, &rule->from_tick, &rule->from_us);
    if (key.text == "until") return ParseTime(value, &rule->until_tick, &rule->until_us);
    diagnostics_->Error(key.span, "a rule has no '" + std::string(key.text) + "'")
        .Hint(source::NearestHint(
            std::string(key.text), Keys(),
            "it has loss, duplicate, reorder, delay, late, by, corrupt, process, "
            "channel, from and until"));
  }

  /// A probability.
  void ParseChance(const Word& value, double* chance) {
    if (const std::optional<double> fraction = ReadFraction(value.text)) {
      *chance = *fraction;
      return;
    }
    diagnostics_->Error(value.span, "expected a probability, 0 to 1").Hint("such as 0.2 or 20%");
  }

  /// How many later messages may come before a late one.
  void ParseDelay(const Word& value, int* delay) {
    const auto number = ReadNumber<int>(value.text);
    if (number && *number >= 1 && *number <= kMostFaultDelay) {
      *delay = *number;
      return;
    }
    diagnostics_->Error(value.span,
                        "expected a number of messages, 1 to " + std::to_string(kMostFaultDelay));
  }

  /// How late a message is at most.
  void ParseLateness(const Word& value, int64_t* us) {
    const std::optional<double> seconds = TimeIn(value.text);
    if (seconds && *seconds >= 1e-6 && *seconds <= kMostLateSeconds) {
      *us = std::llround(*seconds * 1e6);
      return;
    }
    diagnostics_->Error(value.span, "expected seconds, 0.000001s to 10s")
        .Hint("a time ends in s or ms: by=0.03s");
  }

  /// Seconds of sim time end in s; a number alone is a tick.
  void ParseTime(const Word& value, int64_t* tick, int64_t* us) {
    const auto number = ReadNumber<int64_t>(value.text);
    if (number && *number >= 0) {
      *tick = *number;
      return;
    }
    // The bound keeps the product below in 64 bits.
    const std::optional<double> seconds = TimeIn(value.text);
    if (seconds && *seconds >= 0 && *seconds <= kMostSeconds) {
      *us = std::llround(*seconds * 1e6);
      return;
    }
    diagnostics_->Error(value.span, "expected a time")
        .Hint("seconds of sim time end in s or ms (2.5s); a whole number alone is a tick (125)");
  }

  /// @param names  what the pattern may stand for; empty: that is not known.
  void ParsePattern(const Word& value, const std::vector<std::string>& names,
                    std::string* pattern) {
    *pattern = value.text;
    if (pattern->empty()) {
      diagnostics_->Error(value.span,
                          "expected a name or a pattern, in which * stands for anything");
      return;
    }
    // A pattern that fits no name is mistyped, and its rule would do nothing without a word.
    const auto fits = [&](const std::string& name) { return MatchesPattern(*pattern, name); };
    if (names.empty() || std::any_of(names.begin(), names.end(), fits)) return;
    diagnostics_->Error(value.span, "nothing in this run is called '" + *pattern + "'")
        .Hint(source::NearestHint(*pattern, names, "for example: " + names.front()));
  }

  /// What the values of a rule must not be together: all 0, or a time that is empty.
  void CheckRule(const Word& first, const std::set<std::string_view>& given,
                 const FaultRule& rule) {
    if (rule.loss + rule.duplicate + rule.reorder + rule.late + rule.corrupt <= 0) {
      diagnostics_->Error(first.span, "the rule does nothing")
          .Hint("it needs a loss, duplicate, reorder, late or corrupt above 0");
    }
    // A `late` of 0 with a `by` would do nothing, and a `late` without one has no bound.
    if (given.contains("by") != (rule.late > 0)) {
      diagnostics_->Error(first.span, "'late' above 0 and 'by' need each other")
          .Hint(
              "late is the chance that a message is late, by how late it can be: late=0.1 "
              "by=0.03s");
    }
    if (given.contains("delay") && rule.reorder <= 0) {
      diagnostics_->Error(first.span, "'delay' needs a 'reorder' above 0")
          .Hint("reorder is the chance that a message is late, delay how late it can be");
    }
    // Ticks and times are both looked at; what is not given is 0 or without end, which passes.
    if (rule.from_tick >= rule.until_tick || rule.from_us >= rule.until_us) {
      diagnostics_->Error(first.span, "the rule ends before it begins");
    }
  }

  /// Names of the processes that receive, and of the channels that they have among them.
  [[nodiscard]] std::vector<std::string> Processes() const {
    if (modules_.empty()) return {};
    std::vector<std::string> names = modules_;
    names.insert(names.end(), {"SIM", "LOG"});
    return names;
  }
  [[nodiscard]] std::vector<std::string> Channels() const {
    if (modules_.empty()) return {};
    // As lcmtypes/README.md lists them; END stands in logs only.
    std::vector<std::string> names = {"SIM/CLOCK", "SIM/SENSORS",  "SIM/WORLD",    "SIM/ADMIT",
                                      "SIM/LEAVE", "SIM/VERDICT",  "SIM/ANSWER",   "HELLO",
                                      "TOTALS",    "SIM/PROGRESS", "LOG/PROGRESS", "INFO",
                                      "CONTROL"};
    for (const std::string& module : modules_) {
      for (const char* topic : {"/TRANSFORM", "/ACTUATOR", "/STATUS"}) {
        names.push_back(module + topic);
      }
    }
    for (const std::string& process : Processes()) {
      names.push_back(process + "/HEALTH");
      names.push_back(process + "/RESEND");
    }
    return names;
  }

  std::string_view text_;
  int file_;
  const std::vector<std::string>& modules_;
  source::Diagnostics* diagnostics_;
  FaultPlan plan_;
};

}  // namespace

std::optional<FaultPlan> ParseFaultPlan(const source::SourceSet& sources, int file,
                                        const std::vector<std::string>& modules,
                                        source::Diagnostics* diagnostics) {
  source::CheckUtf8(sources, file, diagnostics);
  FaultPlan plan = Parser(sources, file, modules, diagnostics).Parse();
  if (diagnostics->had_errors()) return std::nullopt;
  return plan;
}

}  // namespace morphbus::bridge
