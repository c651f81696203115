#include "tools/monitor/live_source.h"

#include <fmt/format.h>

#include <cmath>
#include <morphbus/resend_t.hpp>

#include "bridge/bus/lcm_bus.h"
#include "bridge/control/control_command.h"
#include "bridge/lockstep/outbox.h"
#include "bridge/observe/description_finder.h"
#include "bridge/wire/channels.h"
#include "tools/base/files.h"
#include "tools/control/controlled_run.h"
#include "tools/plan/control_script.h"

namespace morphbus::tools {
namespace {

/// So long a run's description is waited for on the bus, and so often it is asked for, seconds.
constexpr double kDescriptionPatience = 5.0, kAskEvery = 0.5;
/// Seconds between two tellings of the channels' rates.
constexpr double kCountsEvery = 1.0;

/// Asks for the description of a run on the bus, and puts it together from what comes. An empty
/// `run` is the first that says anything.
Result<std::string> DescriptionFromBus(bridge::Bus* bus, std::string run) {
  bridge::DescriptionFinder finder(run);
  std::optional<std::string> whole;
  bus->SubscribePrefix("", [&](std::string_view channel, const uint8_t* data, size_t size) {
    if (whole) return;
    // Of a run without a name CLOCK tells it.
    const std::optional<bridge::ChannelName> name = bridge::ParseChannel(channel);
    if (name && run.empty() && name->topic == bridge::Topic::kClock) run = name->run;
    whole = finder.Take(channel, data, size);
  });
  // The logger has the description and repeats it for who asks, once the run's name is known.
  bridge::Ledger ledger;
  std::unique_ptr<bridge::Outbox> outbox;
  const WallTimer timer;
  for (double next_ask = 0; !whole && timer.seconds() < kDescriptionPatience; bus->Handle(20)) {
    if (run.empty() || timer.seconds() < next_ask) continue;
    if (outbox == nullptr) {
      outbox =
          std::make_unique<bridge::Outbox>(bus, bridge::Sender{run, NameOfAsker(), 0, 0}, &ledger);
    }
    morphbus::resend_t ask = {};
    ask.sender = outbox->sender().process;
    ask.channel = bridge::Channel(run, "", bridge::Topic::kInfo);
    outbox->Send(bridge::Channel(run, bridge::kLogProcess, bridge::Topic::kResend), 0, 0, &ask);
    next_ask = timer.seconds() + kAskEvery;
  }
  bus->Unsubscribe("");
  if (whole) return *whole;
  return Fail(run.empty() ? "nothing of a run is on that bus; morphbus doctor says why"
                          : "run " + run +
                                " does not tell its description; of another host's run its key is "
                                "needed (--key FILE)");
}

/// A member of a request as text; "" if there is none. Numbers are written shortest.
std::string TextOf(const nlohmann::json& request, const char* name) {
  const auto found = request.find(name);
  if (found == request.end()) return "";
  if (found->is_string()) return found->get<std::string>();
  if (found->is_number_integer()) return fmt::format("{}", found->get<int64_t>());
  if (found->is_number()) return fmt::format("{}", found->get<double>());
  return "";
}

/// The command that a service's request stands for, in the words of `morphbus control`.
Result<std::string> CommandOf(const std::string& service, const nlohmann::json& request) {
  const auto needs = [&](const char* name) {
    return Fail(fmt::format("the request needs \"{}\"", name));
  };
  // The words of a command as they are, but for programs, which the monitor must compile.
  if (service == "control") {
    std::string text = TextOf(request, "command");
    // A deployment needs the program's text, for which this service has no member.
    if (text.starts_with("deploy")) return Fail("a program is deployed by the service deploy");
    if (text.empty()) return needs("command");
    return text;
  }
  if (service == "pause" || service == "resume") return service;
  if (service == "step") {
    const std::string ticks = TextOf(request, "ticks");
    return ticks.empty() ? "step" : "step " + ticks;
  }
  if (service == "speed") {
    const std::string speed = TextOf(request, "speed");
    if (speed.empty()) return needs("speed");
    return "speed " + speed;
  }
  // Newtons along a direction of the world; without seconds, for a tick.
  if (service == "push") {
    for (const char* name : {"body", "direction", "newtons"}) {
      if (TextOf(request, name).empty()) return needs(name);
    }
    return fmt::format("push {} {} {} {}", TextOf(request, "body"), TextOf(request, "direction"),
                       TextOf(request, "newtons"), TextOf(request, "seconds"));
  }
  // Both that follow may name the module that they are for.
  const std::string to = TextOf(request, "to").empty() ? "" : " --to " + TextOf(request, "to");
  if (service == "invoke") {
    std::string text = "invoke " + TextOf(request, "command");
    if (TextOf(request, "command").empty()) return needs("command");
    const auto arguments = request.find("arguments");
    if (arguments != request.end() && arguments->is_array()) {
      // Arguments are numbers and flags, as in the program's declaration.
      for (const nlohmann::json& argument : *arguments) {
        const nlohmann::json holder = {{"value", argument}};
        text += argument.is_boolean() ? (argument.get<bool>() ? " true" : " false")
                                      : " " + TextOf(holder, "value");
      }
    }
    return text + to;
  }
  // deploy
  const std::string name = TextOf(request, "name");
  if (name.empty() || name.find(' ') != std::string::npos) {
    return Fail("deploy: the program needs a \"name\" without blanks");
  }
  if (TextOf(request, "text").empty()) return needs("text");
  const std::string at = TextOf(request, "at");
  return "deploy " + name + to + (at.empty() ? "" : " --at " + at);
}

}  // namespace

LiveSource::LiveSource(std::shared_ptr<const bridge::RunModel> run, std::string description,
                       std::unique_ptr<bridge::Bus> bus, const bridge::RunKey* key)
    : run_(std::move(run)),
      description_(std::move(description)),
      lcm_(std::move(bus)),
      sealed_(key == nullptr ? nullptr : std::make_unique<bridge::SealedBus>(lcm_.get(), *key)),
      bus_(sealed_ != nullptr ? sealed_.get() : lcm_.get()),
      texts_(run_->model, run_->program_file),
      present_(bus_, run_),
      outline_(run_) {
  name_ = run_->run;
}

LiveSource::~LiveSource() = default;

Result<std::unique_ptr<LiveSource>> LiveSource::Create(const RunChoice& choice) {
  // A bus that is named may be that of another host; else the run is one of this machine's.
  const bool elsewhere = choice.run.empty() && !choice.lcm_url.empty();
  std::optional<RunEntry> entry;
  if (!elsewhere) {
    Result<RunEntry> found = FindRun(choice.run);
    if (!found) return Fail(found.error().message);
    entry = std::move(*found);
  }
  // What is in the run's folder is read before its network is entered, which may change the user.
  std::string description;
  if (entry) description = ReadFile(entry->folder + "/description.pb").value_or("");
  Result<ControlledRun> controlled = entry ? FindControlled(entry->name) : Fail("elsewhere");
  std::optional<bridge::RunKey> key;
  if (controlled) key = controlled->key;
  // A key file that was named has the last word: of another host's run no folder is at hand.
  if (!choice.key_file.empty()) {
    Result<bridge::RunKey> chosen = bridge::RunKey::Read(choice.key_file);
    if (!chosen) return Fail(chosen.error().message);
    key = *chosen;
  }
  const Result<std::string> url = JoinRun(choice);
  if (!url) return Fail(url.error().message);
  Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(*url);
  if (!bus) return Fail(bus.error().message);
  if (description.empty()) {
    // The logger answers who has the run's key.
    bridge::SealedBus sealed(bus->get(), key.value_or(bridge::RunKey()));
    Result<std::string> heard =
        DescriptionFromBus(key ? &sealed : bus->get(), entry ? entry->name : choice.run);
    if (!heard) return Fail(heard.error().message);
    description = std::move(*heard);
  }
  // What names and shapes the messages speak of.
  auto run = bridge::ReadRunWithRobot(description);
  if (!run) return Fail(run.error().message);
  std::unique_ptr<LiveSource> source(
      new LiveSource(*run, std::move(description), std::move(*bus), key ? &*key : nullptr));
  if (controlled) {
    // Commands have a bus of their own, for they wait for answers.
    Result<std::unique_ptr<bridge::Bus>> own = bridge::OpenLcmBus(*url);
    if (!own) return Fail(own.error().message);
    const auto way =
        std::make_shared<Commander::Way>(Commander::Way{std::move(*controlled), std::move(*own)});
    source->commander_ = std::make_unique<Commander>([way] { return way; });
  }
  return source;
}

Json LiveSource::Info() const {
  return {{"name", name_}, {"kind", "live"}, {"robot", run_->robot->name}};
}

std::vector<std::string> LiveSource::services() const {
  return {"control", "deploy", "pause",  "resume",        "step",
          "speed",   "push",   "invoke", "missing_roles", "explain_role"};
}

void LiveSource::Open(bridge::SessionHub* server, size_t first_channel, bool tells_time) {
  MonitorSource::Open(server, first_channel, tells_time);
  sink_ = [this](bridge::OutwardTopic topic, int64_t time_ns, const std::string& bytes) {
    // All clients see the same moment of the run, unlike those of a log.
    server_->Publish(ChannelOf(topic), time_ns, bytes);
    if (tells_time_ && topic == bridge::OutwardTopic::kClock) server_->PublishTime(time_ns);
  };
  converter_ = std::make_unique<bridge::Converter>(
      run_, name_,
      [this](uint64_t hash, const std::string& file) { return texts_.Find(hash, file); });
  // The converter says what is known before the first message, then what each message means.
  converter_->Begin(sink_);
  server_->SetParameter(Parameter("paused"), false);
  server_->SetParameter(Parameter("speed"), converter_->speed());
  bus_->SubscribePrefix(run_->run + "/", [this](std::string_view channel, const uint8_t* data,
                                                size_t size) { OnMessage(channel, data, size); });
}

void LiveSource::OnMessage(std::string_view channel, const uint8_t* data, size_t size) {
  // All channels are counted, those that viewers are not told of among them.
  const double now_s = static_cast<double>(converter_->time_us()) * 1e-6;
  rates_.Take(channel, data, size, now_s);
  const bool sound = converter_->Take(channel, data, size, sink_);
  if (sound) present_.Take(channel, data, size);
  if (sound) outline_.Take(channel, data, size);
  if (!channel.ends_with("/SIM/CLOCK")) return;
  // Before the first CLOCK nobody knows what time it is: rates are those from then on.
  if (counted_s_ < 0 && converter_->tick() >= 0) {
    counted_s_ = static_cast<double>(converter_->time_us()) * 1e-6;
    rates_.Roll(counted_s_);
  }
  server_->SetParameter(Parameter("paused"), converter_->paused());
  server_->SetParameter(Parameter("speed"), converter_->speed());
}

int LiveSource::Step(int wait_ms) {
  bus_->Handle(wait_ms);
  // Rates go out by the wall clock and are those of sim time. While the run holds still there are
  // none.
  const double now_s = static_cast<double>(converter_->time_us()) * 1e-6;
  if (timer_.seconds() >= next_counts_s_ && counted_s_ >= 0 && now_s > counted_s_) {
    counted_s_ = now_s;
    morphbus::Channels counts = rates_.Roll(now_s);
    bridge::SetTime(converter_->time_us(), counts.mutable_timestamp());
    sink_(bridge::OutwardTopic::kChannels, converter_->time_us() * 1000,
          counts.SerializeAsString());
    next_counts_s_ = timer_.seconds() + kCountsEvery;
  }
  return 0;
}

void LiveSource::AskForRoles(const bridge::ClientRequest& request) {
  if (inquiry_ == nullptr) inquiry_ = std::make_unique<RoleInquiry>(description_);
  inquiry_->Ask(
      RoleQuestionIn(request.value),
      [now = StandingOf(*converter_)]() -> Result<RobotStanding> { return now; },
      [server = server_, request](const Result<Json>& answer) {
        if (!answer) return server->RefuseCall(request, answer.error().message);
        server->AnswerCall(request, *answer);
      });
}

void LiveSource::Command(const bridge::ClientRequest& request, const std::string& text,
                         const std::string& program) {
  // A parameter is set by a command as well; only the answer has another form.
  const bool is_call = request.kind == bridge::ClientRequest::Kind::kCall;
  const auto done = [server = server_, request, is_call](const Json& answer,
                                                         const std::string& refusal) {
    if (!is_call) {
      if (!refusal.empty()) server->SendStatus(request.client, 2, refusal);
      return server->AnswerSet(request);
    }
    if (!refusal.empty()) return server->RefuseCall(request, refusal);
    server->AnswerCall(request, answer);
  };
  // A client without the token may watch the run, and must not steer it.
  if (!request.may_control) {
    return done({}, "control needs the token: use the URL that morphbus monitor printed");
  }
  // The run may be of another host, or a replay.
  if (commander_ == nullptr) {
    return done({},
                "this run cannot be controlled from here: it is none of this machine's that "
                "takes commands");
  }
  const Result<bridge::ControlCommand> command = bridge::ParseControl(text);
  if (!command) return done({}, command.error().message);
  // A program is laid where the sim finds it; the command names it by its hash.
  const auto complete = [this, program](const ControlledRun& run,
                                        bridge::ControlCommand* deploy) -> Result<void> {
    if (deploy->kind != bridge::ControlKind::kDeploy) return {};
    const auto compiled = texts_.Compile(deploy->program, program);
    if (!compiled) return tl::unexpected(compiled.error());
    deploy->program_hash = compiled->hash;
    return WriteFile(ImagePath(run.entry.folder, compiled->hash), compiled->image);
  };
  commander_->Give({*command, complete, done});
}

void LiveSource::Take(const bridge::ClientRequest& request, const std::string& what) {
  using Kind = bridge::ClientRequest::Kind;
  if (request.kind == Kind::kCall && IsRoleService(what)) return AskForRoles(request);
  if (request.kind == Kind::kCall) {
    // A service and a parameter are both commands in the end.
    const Result<std::string> text = CommandOf(what, request.value);
    if (!text) return server_->RefuseCall(request, text.error().message);
    return Command(request, *text, what == "deploy" ? TextOf(request.value, "text") : "");
  }
  // Clients that come and go change nothing here: they all get what the bus says.
  if (request.kind != Kind::kSet) return;
  if (what == "paused" && request.value.is_boolean()) {
    return Command(request, request.value.get<bool>() ? "pause" : "resume", "");
  }
  if (what == "speed" && request.value.is_number()) {
    return Command(request, fmt::format("speed {}", request.value.get<double>()), "");
  }
  server_->SendStatus(request.client, 2,
                      request.name + ": expected " + (what == "paused" ? "a flag" : "a number"));
  server_->AnswerSet(request);
}

}  // namespace morphbus::tools
