#include "bridge/lockstep/sim/run_ending.h"

#include <algorithm>
#include <utility>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "compiler/base/text.h"

namespace morphbus::bridge {

RunEnding::RunEnding(int num_modules, bool logger, bool realtime, std::string planned)
    : num_modules_(num_modules),
      logger_(logger),
      realtime_(realtime),
      planned_(std::move(planned)),
      told_(static_cast<size_t>(num_modules + (logger ? 1 : 0))) {}

void RunEnding::AskFor(const std::string& reason) {
  if (outcome_.reason.empty()) outcome_.reason = CutText(reason, kLongestText);
}

void RunEnding::Refuse(const std::string& why) {
  if (refusal_.empty()) refusal_ = why;
}

std::string RunEnding::Wrong(const Facts& facts) const {
  // So many are named; a robot may have thousands.
  constexpr size_t kMostSilentNamed = 3;
  if (!refusal_.empty() || facts.silent.empty()) return refusal_;
  // The sentence begins with their names, that of the logger first: there is but one.
  std::vector<std::string> names = facts.silent;
  std::stable_partition(names.begin(), names.end(),
                        [](const auto& name) { return name == kLogProcess; });
  const std::string text = NameFirst(names, kMostSilentNamed) +
                           (names.size() == 1 ? " does not answer" : " do not answer");
  return facts.ticks == 0 ? text + " (the run had not begun)" : text;
}

const std::string& RunEnding::ChooseReason(const Facts& facts) {
  std::string& reason = outcome_.reason;
  if (!reason.empty()) return reason;
  const std::string wrong = Wrong(facts);
  // A run that is done again ends as the first one did.
  if (wrong.empty() && !planned_.empty()) return reason = planned_;
  reason = wrong.empty() ? "finished" : CutText(wrong, kLongestText);
  // A reader of nothing but the reason learns that the run was not the whole robot's.
  for (const std::string& gone : facts.gone) reason += ", without " + gone;
  return reason = CutText(reason, kLongestText);
}

void RunEnding::Conclude(const Facts& facts, std::vector<ChannelTotal> own) {
  outcome_.ticks = facts.ticks;
  outcome_.missed_deadlines = facts.missed_deadlines;
  // The totals of the run: the simulator's channels, and those that the modules told.
  outcome_.totals = std::move(own);
  for (int i = 0; i < num_modules_; ++i) {
    const std::vector<ChannelTotal>& told = told_[i].totals();
    outcome_.totals.insert(outcome_.totals.end(), told.begin(), told.end());
  }
  std::ranges::sort(outcome_.totals, {}, &ChannelTotal::channel);
  outcome_.messages = 0;
  for (const ChannelTotal& total : outcome_.totals) outcome_.messages += total.count;
  const bool recorded = logger_ && told_.back().complete();
  if (recorded) outcome_.recorded_hash = RunHash(told_.back().totals());
  // Without the totals of every module there is no hash of the whole run. What a module published
  // that died and left nothing behind, only the logger has.
  outcome_.run_hash = !facts.all_acknowledged    ? ""
                      : !facts.unvouched.empty() ? outcome_.recorded_hash
                                                 : RunHash(outcome_.totals);
  outcome_.error = Wrong(facts);
  // A run that was stopped before it began moved nothing. In real time the log lacks what was lost.
  if (outcome_.error.empty() && recorded && facts.ticks > 0 && !realtime_) {
    outcome_.error = WhereTheLogDiffers(outcome_.totals, told_.back().totals(), facts.unvouched);
  }
  outcome_.ok = outcome_.error.empty();
}

}  // namespace morphbus::bridge
