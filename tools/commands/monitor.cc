// morphbus monitor: runs and logs in a browser, or in any viewer of Foxglove's protocol.

#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <set>

#include "bridge/outward/outward_server.h"
#include "compiler/base/text.h"
#include "compiler/base/version.h"
#include "logger/log/facts_text.h"
#include "tools/base/files.h"
#include "tools/base/print.h"
#include "tools/base/share_folder.h"
#include "tools/commands/commands.h"
#include "tools/commands/run_pairs.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/run_choice.h"
#include "tools/machine/wall_clock.h"
#include "tools/monitor/live_source.h"
#include "tools/monitor/log_source.h"
#include "tools/monitor/page_files.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus monitor`.
struct MonitorOptions {
  std::vector<std::string> logs;
  RunChoice run;
  int port = 8765;
  std::string bind = "127.0.0.1";
  std::string token;
  std::vector<std::string> origins;
  std::string page;
  double seconds = 0.0;
  bool json = false;
};

using Sources = std::vector<std::unique_ptr<MonitorSource>>;
using LogSources = std::vector<std::unique_ptr<LogSource>>;

/// Bytes of the token: 128 bits cannot be guessed.
constexpr int kTokenBytes = 16;
/// While a run goes on, requests of clients wait no longer than this.
constexpr int kLiveWaitMs = 10;

/// A secret of random bytes, as hexadecimal digits.
Result<std::string> NewToken() {
  std::array<unsigned char, kTokenBytes> bytes;
  if (getrandom(bytes.data(), bytes.size(), 0) != kTokenBytes) {
    return Fail("the system has no random numbers");
  }
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

/// A token that people choose stands in a URL as it is.
bool IsUsableToken(const std::string& token) {
  return token.size() >= 8 && std::all_of(token.begin(), token.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '-' || c == '_';
         });
}

bool IsLoopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1";
}

/// This machine's name, in lower case; empty if it has none.
std::string MachineName() {
  std::array<char, 256> name = {};
  if (gethostname(name.data(), name.size() - 1) != 0) return "";
  std::string text = name.data();
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// Who is let in, and what page is served.
Result<bridge::ServerOptions> ServerOptionsOf(const MonitorOptions& options) {
  bridge::ServerOptions server;
  server.address = options.bind;
  server.port = options.port;
  // Beyond this machine even looking wants the token; on it only commands do.
  server.gate.token_to_read = !IsLoopback(options.bind);
  server.gate.origins = options.origins;
  // Besides localhost and addresses, which are let in anyway, browsers may ask for this machine by
  // its name.
  if (const std::string name = MachineName(); !name.empty()) server.gate.hosts = {name};
  if (!options.token.empty() && !IsUsableToken(options.token)) {
    return Fail("--token: expected at least 8 of A-Z a-z 0-9 - _");
  }
  const Result<std::string> token = options.token.empty() ? NewToken() : options.token;
  if (!token) return Fail(token.error().message);
  server.gate.token = *token;
  // A page that is named must be there; without the build's own there is a plain one.
  const bool chosen = !options.page.empty();
  auto page = LoadPage(chosen ? options.page : ShareFolder("monitor"));
  if (!page && chosen) return Fail("--page: " + page.error().message);
  if (!page) {
    Warn(
        "this program was built without the monitor's page (Node.js, see tools/setup); viewers "
        "of Foxglove's protocol can connect all the same");
  }
  server.gate.files = page ? std::move(*page) : PageOfNoPage();
  return server;
}

/// The logs of the command line, in its order, each with the name of its run; they are not read
/// yet.
Result<LogSources> OpenLogs(const MonitorOptions& options) {
  LogSources logs;
  for (const std::string& path : options.logs) {
    auto log = LogSource::Create(path);
    if (!log) return Fail(log.error().message);
    logs.push_back(std::move(*log));
  }
  return logs;
}

/// The log that a run of this machine is writing, as far as it has come; null if there is none.
std::unique_ptr<LogSource> PastOf(const RunChoice& choice) {
  const Result<RunEntry> entry = FindRun(choice.run);
  if (!entry || entry->log.empty() || !choice.lcm_url.empty()) return nullptr;
  // It gets its name when it is whole.
  auto log = LogSource::Create(entry->log + ".partial");
  return log ? std::move(*log) : nullptr;
}

/// All sources: the logs, then the run. Entering the run's network comes last, and before any
/// thread is started.
Result<Sources> OpenSources(const MonitorOptions& options, LogSources logs) {
  Sources sources;
  std::vector<LogSource*> unread;
  for (auto& log : logs) {
    unread.push_back(log.get());
    sources.push_back(std::move(log));
  }
  // Where no log is named, or a run is, one looks at a run.
  const bool live =
      options.logs.empty() || !options.run.run.empty() || !options.run.lcm_url.empty();
  std::unique_ptr<LogSource> past = live ? PastOf(options.run) : nullptr;
  if (live) {
    auto run = LiveSource::Create(options.run);
    if (!run) {
      return Fail(run.error().message +
                  (options.logs.empty() ? "; morphbus monitor LOG shows a log" : ""));
    }
    if (past != nullptr) {
      past->SetPastOf((*run)->name());
      past->Rename((*run)->name() + "-past");
      unread.push_back(past.get());
      sources.push_back(std::move(past));
    }
    sources.push_back(std::move(*run));
  }
  // Runs of one name are told apart by a number.
  std::set<std::string> names;
  for (const auto& source : sources) {
    std::string name = source->name();
    for (int n = 2; !names.insert(name).second; ++n) name = fmt::format("{}-{}", source->name(), n);
    source->Rename(name);
  }
  // A past is that of the run as it is called now.
  for (LogSource* log : unread) {
    if (!log->past_of().empty()) log->SetPastOf(sources.back()->name());
  }
  // The index of a log names its topics, so that it comes after the renaming.
  for (LogSource* log : unread) {
    const Result<void> indexed = log->Index();
    if (indexed) continue;
    if (log->past_of().empty()) return Fail(indexed.error().message);
    // A run that has only begun has no past.
    std::erase_if(sources, [&](const auto& source) { return source.get() == log; });
  }
  return sources;
}

/// The sources that are compared with each other: a run and its past are one and the same.
std::vector<MonitorSource*> Compared(const Sources& sources) {
  std::vector<MonitorSource*> compared;
  for (const auto& source : sources) {
    if (source->past_of().empty()) compared.push_back(source.get());
  }
  return compared;
}

/// What the server offers: all topics and services of all sources.
bridge::Catalogue CatalogueOf(const Sources& sources, const std::string& session) {
  bridge::Catalogue catalogue;
  catalogue.name = std::string("morphbus ") + Version();
  catalogue.session_id = session;
  // All topics of one source, then all of the next: sources count on this order.
  Json infos = Json::array();
  for (const auto& source : sources) {
    infos.push_back(source->Info());
    for (const bridge::OutwardTopicInfo& row : bridge::kOutwardTopics) {
      catalogue.channels.push_back({bridge::TopicPath(source->name(), row.topic),
                                    std::string(row.schema), bridge::SchemaOf(row.schema),
                                    row.is_state});
    }
    for (const std::string& service : source->services()) {
      catalogue.services.push_back("/" + source->name() + "/" + service);
    }
  }
  catalogue.metadata["sources"] = JsonText(infos);
  // Logs can be played; a run cannot. The server's times are those of the first source.
  const bool logs = std::ranges::all_of(infos, [](const Json& i) { return i["kind"] == "log"; });
  if (logs && !infos.empty()) {
    const int64_t begin_us = infos[0]["begin_us"], end_us = infos[0]["end_us"];
    catalogue.playback_ns = {begin_us * 1000, end_us * 1000};
  }
  // Behind all of them: who answers to whom.
  if (Compared(sources).size() > 1) {
    const std::string schema = "morphbus.Pairs";
    catalogue.channels.push_back({"/pairs", schema, bridge::SchemaOf(schema), true});
  }
  return catalogue;
}

/// Hands a client's request to the source that its name begins with; that a client came or went,
/// and how it wants to play, is told to all.
void Route(const bridge::ClientRequest& request, const Sources& sources, bridge::SessionHub* hub) {
  using Kind = bridge::ClientRequest::Kind;
  const bool to_all = request.kind == Kind::kConnected || request.kind == Kind::kDisconnected ||
                      request.kind == Kind::kPlayback;
  for (const auto& source : sources) {
    const std::string prefix = "/" + source->name() + "/";
    if (to_all) {
      source->Take(request, "");
    } else if (request.name.starts_with(prefix)) {
      return source->Take(request, request.name.substr(prefix.size()));
    }
  }
  // No source has taken it. A client waits for the answer to a call, and to a parameter that it
  // set, so that these two get one.
  if (request.kind == Kind::kCall) hub->RefuseCall(request, "there is no such service");
  if (request.kind == Kind::kSet) hub->AnswerSet(request);
}

/// What was refused, for people: "host 2, token 1".
std::string RefusedText(const bridge::SessionHub& hub) {
  std::string text;
  for (const auto& [kind, count] : hub.refused()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", kind, count);
  }
  return text;
}

/// Says where to look, at once, also through a pipe.
void Announce(const MonitorOptions& options, const bridge::OutwardServer& server,
              const std::string& token, const Sources& sources) {
  // Behind "any interface" the machine is reached by its name.
  std::string host =
      options.bind == "0.0.0.0" || options.bind == "::" ? MachineName() : options.bind;
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  const std::string url = fmt::format("http://{}:{}/?token={}", host, server.port(), token);
  if (options.json) {
    Json names = Json::array();
    for (const MonitorSource* source : Compared(sources)) names.push_back(source->Info());
    Print("{}\n",
          JsonText(
              Json{{"url", url}, {"port", server.port()}, {"token", token}, {"sources", names}}));
  } else {
    Print("{}\n", url);
    for (const MonitorSource* source : Compared(sources)) {
      Print("  {}: {}\n", source->name(), source->Info()["kind"].get<std::string>());
    }
    if (sources.empty()) {
      Print("  Nothing runs here; the page shows the first run that begins (morphbus run).\n");
    }
    Print("Open it in a browser; Foxglove connects to ws://{}:{}/. Ctrl-C ends it.\n", host,
          server.port());
  }
  FlushResult();
}

/// Lets every source do its part, and gives it what clients want of it, until a signal comes or the
/// time is over. One thread looks after all sources; the server's own never waits for it.
void Serve(const MonitorOptions& options, const Sources& sources, bridge::SessionHub* hub) {
  // A run waits for messages in its Step, so what clients want is only looked at.
  // OpenSources puts the run last.
  const bool live = dynamic_cast<LiveSource*>(sources.back().get()) != nullptr;
  const WallTimer timer;
  PairTeller pairs(Compared(sources), hub, sources.size() * bridge::kOutwardTopics.size());
  int wait_ms = 0;
  while (CaughtSignal() == 0 && !(options.seconds > 0 && timer.seconds() >= options.seconds)) {
    int next_ms = kLiveWaitMs;
    for (const auto& source : sources) {
      next_ms = std::min(next_ms, source->Step(std::min(wait_ms, kLiveWaitMs)));
    }
    pairs.Step();
    const auto requests = hub->TakeRequests(live ? 0 : next_ms);
    for (const bridge::ClientRequest& request : requests) Route(request, sources, hub);
    // Where there was one request the next is likely to follow, as while a slider is dragged.
    wait_ms = requests.empty() ? kLiveWaitMs : 0;
  }
}

/// Whether a run of this machine is to be shown, whichever it is, and there is none.
bool NothingRuns(const MonitorOptions& options) {
  if (!options.logs.empty() || !options.run.run.empty() || !options.run.lcm_url.empty()) {
    return false;
  }
  const Result<std::vector<RunEntry>> runs = ListRuns();
  return runs && runs->empty();
}

/// Shows that nothing runs, until something does; false if a signal comes or the time is over
/// before. A page connects again by itself when the next server is there.
bool ServeUntilRun(const MonitorOptions& options, bridge::OutwardServer* server,
                   const std::string& token) {
  constexpr int kLookEveryMs = 200;
  server->Start(CatalogueOf({}, "waiting"));
  Announce(options, *server, token, {});
  const WallTimer timer;
  while (CaughtSignal() == 0 && !(options.seconds > 0 && timer.seconds() >= options.seconds)) {
    for (const bridge::ClientRequest& request : server->hub().TakeRequests(kLookEveryMs)) {
      Route(request, {}, &server->hub());
    }
    // A run that others can hear has a bus, and has laid down what it is.
    const Result<RunEntry> run = FindRun("");
    if (run && !run->url.empty() && ReadFile(run->folder + "/description.pb")) return true;
  }
  return false;
}

int Monitor(const MonitorOptions& options) {
  if (!(options.seconds >= 0)) return Unusable("--seconds: expected a number, 0 or more");
  // The error about a log that is not there must not stand behind a warning about the page.
  Result<LogSources> logs = OpenLogs(options);
  if (!logs) return Unusable(logs.error().message);
  Result<bridge::ServerOptions> server_options = ServerOptionsOf(options);
  if (!server_options) return Unusable(server_options.error().message);
  const std::string token = server_options->gate.token;
  CatchSignals();
  // The port is opened here, where people are, before a run's private network is entered.
  const bridge::ServerOptions again = *server_options;
  auto server = bridge::OutwardServer::Open(std::move(*server_options));
  if (!server) return Unusable(server.error().message + "; --port chooses another, 0 any");
  const bool waited = NothingRuns(options);
  if (waited) {
    if (!ServeUntilRun(options, server->get(), token)) return kDone;
    // Another server takes the place of the one that waited: what there is, is told once.
    bridge::ServerOptions same = again;
    same.port = (*server)->port();
    server->reset();
    server = bridge::OutwardServer::Open(std::move(same));
    if (!server) return Failed(server.error().message);
  }
  Result<Sources> sources = OpenSources(options, std::move(*logs));
  if (!sources) return Unusable(sources.error().message);
  // By the session a client that connects again tells whether this is still the same monitor.
  const Result<std::string> session = NewToken();
  if (!session) return Failed(session.error().message);
  (*server)->Start(CatalogueOf(*sources, *session));
  bridge::SessionHub& hub = (*server)->hub();
  // Channels are numbered as in the catalogue; the server's time is that of the first source.
  for (size_t s = 0; s < sources->size(); ++s) {
    const bool first = (*sources)[s].get() == Compared(*sources).front();
    (*sources)[s]->Open(&hub, s * bridge::kOutwardTopics.size(), first);
  }
  if (!waited) Announce(options, **server, token, *sources);
  Serve(options, *sources, &hub);
  // Sources, whose commands answer through the server, go before it.
  sources->clear();
  if (const std::string refused = RefusedText(hub); !refused.empty()) {
    Warn("refused: " + refused);
  }
  return kDone;
}

}  // namespace

void AddMonitor(CommandLine* line) {
  Subcommand sub =
      line->Add("monitor", "A run or logs in the browser, or in any viewer of Foxglove's protocol");
  auto options = std::make_shared<MonitorOptions>();
  sub.Add("LOG", &options->logs, "Logs to play (default: the run that goes on here)");
  AddRunChoice(&sub, &options->run);
  sub.Add("--port", &options->port, "TCP port (default: 8765; 0: any that is free)")
      .Range(0, 65535);
  sub.Add("--bind", &options->bind,
          "Address of the interface to listen on (default: 127.0.0.1, this machine only); any "
          "other asks everybody for the token")
      .TypeName("ADDRESS");
  sub.Add("--token", &options->token, "The token in the URL (default: a new one)")
      .TypeName("TOKEN");
  sub.Add("--allow-origin", &options->origins,
          "A web site whose pages may connect, such as https://app.foxglove.dev")
      .TypeName("URL")
      .Repeatable();
  sub.Add("--page", &options->page, "Folder of the page (default: the one of this build)")
      .TypeName("FOLDER");
  sub.Add("--seconds", &options->seconds, "Stop after this many seconds (default: until Ctrl-C)")
      .Seconds();
  sub.Flag("--json", &options->json, "Where to look as one JSON object, on a line");
  sub.Footer(
      "Whoever has the URL may control the run; without its token one can only look, and with "
      "--bind not even that.\n"
      "Examples:\n  morphbus monitor\n  morphbus monitor walk.log\n"
      "  morphbus monitor before.log after.log --port 9000\n"
      "  morphbus monitor yesterday.log --run walk\n"
      "  morphbus monitor --bind 0.0.0.0");
  sub.Do([options] { return Monitor(*options); });
}

}  // namespace morphbus::tools
