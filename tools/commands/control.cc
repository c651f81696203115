// morphbus control: acts on a running robot.

#include <fmt/format.h>

#include <optional>

#include "bridge/bus/lcm_bus.h"
#include "compiler/base/text.h"
#include "tools/base/inspection_report.h"
#include "tools/base/json.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/commands/inspect.h"
#include "tools/control/commander.h"
#include "tools/control/controlled_run.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/network.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/control_script.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus control`.
struct ControlOptions {
  std::vector<std::string> words;
  std::string run;
  std::string to;
  std::string at;
  bool cold = false;
  bool json = false;
};

/// One of every command; the suite runs them as they stand here, one after the other.
constexpr const char* kControlExamples =
    "  morphbus control pause\n"
    "  morphbus control push m5 EAST 20 0.5\n"
    "  morphbus control disconnect m2.c3\n"
    "  morphbus control connect m2.c3 m5.c4\n"
    "  morphbus control step 5\n"
    "  morphbus control resume\n"
    "  morphbus control speed 2\n"
    "  morphbus control deploy models/programs/quadruped_careful.dyn --to m5 --at 60\n"
    "  morphbus control set stride_deg 35 --at 90\n"
    "  morphbus control invoke FrontLeftUpperHalf.move_thigh --to m3\n"
    "  morphbus control inspect m5\n"
    "  morphbus control kill m2\n"
    "  morphbus control restart m2\n"
    "  morphbus control restart m7 --cold\n"
    "  morphbus control lose m6\n"
    "  morphbus control stop";

/// Compiles the program of a deployment for the run's model and lays it where the sim finds it.
/// Says on stderr what is wrong.
bool HandOver(const ControlledRun& run, bridge::ControlCommand* command) {
  const std::optional<std::string> image =
      ImageFor(run.plan.model, command->program, &command->program_hash);
  if (!image) return false;
  // The command carries only the program's hash, under which the sim finds the file.
  const std::string path = ImagePath(run.entry.folder, command->program_hash);
  const Result<void> written = WriteFile(path, *image);
  if (!written) Unusable(written.error().message);
  return written.has_value();
}

/// What the run said, for people or scripts; `modules`: what those said that were inspected, null
/// for other commands. Returns the exit status.
int Report(const ControlledRun& run, const bridge::ControlAnswer& answer, bool json,
           const Json& modules) {
  Json object = AnswerJson(run, answer);
  if (!modules.is_null()) {
    // Their answers have come, whatever the run had said before.
    object["pending"] = false;
    object["modules"] = modules;
  }
  const std::string command = EscapeControl(answer.command);
  // A refusal has no tick; what it says goes to stderr, also beside JSON.
  const bool refused = !object["refused"].is_null();
  if (json) {
    PrintJson(object);
  } else if (!refused) {
    const auto at = object.find("switch_seconds");
    Print("{}: tick {} ({:.2f} s){}{}\n", command, answer.tick, object["seconds"].get<double>(),
          at == object.end() ? "" : fmt::format("; it runs from {} s on", at->get<double>()),
          object["pending"].get<bool>() ? ", once the run goes on" : "");
    if (!modules.is_null()) PrintText(AnswersText(modules));
  }
  if (!refused) return kDone;
  Unusable(fmt::format("{}: {}", command, EscapeControl(answer.reason)));
  // A refusal has a status of its own: 1 where the run cannot do it now, 2 where the command is
  // wrong, 3 where it takes a launcher and there is none.
  return answer.status;
}

/// Gives one command and waits for the answer.
int Control(const ControlOptions& options) {
  // The words are put together again and read as those of a script, which must find the same ones:
  // blanks part them there, so that a path must hold none.
  for (const std::string& word : options.words) {
    if (options.words.front() != "deploy" || word.find(' ') == std::string::npos) continue;
    return Unusable("deploy: a path must not hold blanks: " + word);
  }
  // The options become words of the command again, so that one parser checks them all.
  std::string text = fmt::format("{}", fmt::join(options.words, " "));
  if (options.cold) text += " --cold";
  if (!options.to.empty()) text += " --to " + options.to;
  if (!options.at.empty()) text += " --at " + options.at;
  Result<bridge::ControlCommand> command = bridge::ParseControl(text);
  if (!command) return Unusable(command.error().message);
  const Result<ControlledRun> run = FindControlled(options.run);
  if (!run) return Unusable(run.error().message);
  // The program is compiled here, where people see its errors, and for the model of that very run.
  const bool deploys = command->kind == bridge::ControlKind::kDeploy;
  if (deploys && !HandOver(*run, &*command)) return kUnusable;
  // The private network is entered before LCM starts a thread.
  if (Result<void> joined = JoinNetworkOf(run->entry); !joined) {
    return Unusable(joined.error().message);
  }
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(run->entry.url);
  if (!bus) return Unusable(bus.error().message);
  CatchSignals();
  const bool inspects = command->kind == bridge::ControlKind::kInspect;
  std::optional<InspectionListener> listener;
  // It listens before the command is given: the modules' answers may come at once.
  if (inspects) listener.emplace(bus->get(), *run, command->part.module);
  const auto stop = [] { return CaughtSignal() != 0; };
  const Result<bridge::ControlAnswer> answer = GiveTo(*run, bus->get(), *command, stop);
  if (!answer) return Failed(answer.error().message);
  if (!inspects || answer->state == bridge::ControlAnswer::State::kRefused) {
    return Report(*run, *answer, options.json, nullptr);
  }
  // The modules answer once the tick is computed.
  if (answer->state == bridge::ControlAnswer::State::kLater) {
    Say("{} waits for tick {}, once the run goes on\n", EscapeControl(answer->command),
        answer->tick);
  }
  const std::string why = listener->Await(answer->tick, bridge::MonotonicTime(), stop);
  const int status = Report(*run, *answer, options.json, listener->answers());
  return why.empty() ? status : Failed(fmt::format("{}: {}", EscapeControl(answer->command), why));
}

}  // namespace

void AddControl(CommandLine* line) {
  Subcommand sub = line->Add("control", "Act on a running robot: pause, push, deploy, invoke, ...");
  auto options = std::make_shared<ControlOptions>();
  sub.Add("COMMAND", &options->words, "What to do, see below").Required();
  sub.Add("--run", &options->run, "The run to command (default: the only one; see morphbus runs)")
      .TypeName("RUN");
  sub.Add("--to", &options->to, "deploy, invoke: the module that gets it (default: the root)")
      .TypeName("MODULE");
  sub.Add("--at", &options->at,
          "deploy, set: sim time, seconds, at which all modules go over to the program, or value "
          "(default: as soon as all have it)")
      .TypeName("SECONDS");
  sub.Flag("--cold", &options->cold, "restart: the module begins anew");
  sub.Json(&options->json);
  sub.Footer(fmt::format(
      "Commands:\n  {}\n"
      "BODY is a module or one of its links, DIRECTION one of NORTH SOUTH UP DOWN EAST WEST or\n"
      "north,up,east. Words that begin with - stand behind --.\n"
      "Exit status 1: refused, for the run is not in a state to do it; 3: the run does not "
      "answer.\n"
      "Examples, in an order that works on the quadruped:\n{}",
      fmt::join(bridge::ControlUsages(), "\n  "), kControlExamples));
  sub.Do([options] { return Control(*options); });
}

}  // namespace morphbus::tools
