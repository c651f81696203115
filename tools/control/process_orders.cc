#include "tools/control/process_orders.h"

#include <algorithm>
#include <utility>

namespace morphbus::tools {

using bridge::ControlKind;

void ProcessOrders::Order(const GivenCommand& given, uint32_t incarnation) {
  // Noted first: it may be done at once.
  under_way_.push_back(given);
  send_(given.command, incarnation);
}

std::optional<GivenCommand> ProcessOrders::Done(bool done) {
  // The launcher answers in order.
  if (under_way_.empty()) return std::nullopt;
  GivenCommand given = std::move(under_way_.front());
  under_way_.erase(under_way_.begin());
  const std::string& module = given.command.part.module;
  if (done && given.command.kind == ControlKind::kKill) killed_.insert(module);
  if (done && given.command.kind == ControlKind::kRestart) killed_.erase(module);
  return given;
}

void ColdRestarts::Take(const GivenCommand& given) {
  // A dead module must answer the present tick first, as the one that it was. It may share its
  // process with another that was killed; one that lives loses nothing by starting again.
  if (orders_.any_killed()) {
    GivenCommand warm = {kNobody, given.command, given.text};
    warm.command.cold = false;
    warm.silent = true;
    orders_.Order(warm, 0);
  }
  waiting_.push_back(given);
  // The old process ends between two ticks.
  sim_.set_barrier([this] { AtBarrier(); });
}

void ColdRestarts::AtBarrier() {
  // Counted before the first is ordered, which may be done at once.
  const std::vector<GivenCommand> begun = std::exchange(waiting_, {});
  under_way_ = static_cast<int>(begun.size());
  if (begun.empty()) return sim_.pass_barrier();
  for (const GivenCommand& given : begun) {
    orders_.Order(given, sim_.begin_incarnation(given.command));
  }
}

void ColdRestarts::OnDone() {
  if (under_way_ == 0 || --under_way_ > 0) return;
  // What was taken meanwhile goes on at once, for the tick still waits.
  AtBarrier();
}

}  // namespace morphbus::tools
