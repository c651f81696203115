#pragma once
// What all subcommands share: exit statuses, printing, JSON, files.

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compiler/m3l/compile.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/source/diagnostics.h"
#include "compiler/source/result.h"
#include "tools/files.h"

namespace morphbus::tools {

// Exit statuses (docs/cli.md).
inline constexpr int kDone = 0;      ///< Done; the answer is yes.
inline constexpr int kNo = 1;        ///< The answer is no: differs, a check failed.
inline constexpr int kUnusable = 2;  ///< Input or options cannot be used.
inline constexpr int kFailed = 3;    ///< A process failed at run time.

/// JSON whose keys keep the order in which docs/cli.md lists them.
using Json = nlohmann::ordered_json;

/// What a parsed subcommand does; returns the exit status.
using Action = std::function<int()>;

/// True if `fd` is a terminal and the user has not asked for plain output (NO_COLOR, TERM=dumb).
bool IsFancyTerminal(int fd);

/// Prints `morphbus: error: message` on stderr and returns kUnusable.
int Unusable(const std::string& message);
/// The same for failures at run time; returns kFailed.
int Failed(const std::string& message);
/// `morphbus: warning: message` on stderr.
void Warn(const std::string& message);

/// How many of a kind are named where there may be thousands.
inline constexpr size_t kMostNamed = 10;

/// Warnings that may be thousands: of each kind the first kMostNamed, then how many more there are.
/// Of one kind are those that differ only in words with a point or a digit in them, as the names of
/// a robot's parts and figures have.
void WarnOfMany(const std::vector<std::string>& messages);

/// Diagnostics on stderr, in colour on a terminal.
void PrintDiagnostics(const source::Diagnostics& diagnostics, const source::SourceSet& sources);

/// One JSON object on stdout, indented for people.
void PrintJson(const Json& json);

/// Compiles M3L files and prints what there is to say about them. Empty if there were errors.
/// `read`, if given, gets the files that this read, imports included.
std::optional<model::Model> LoadModel(const std::vector<std::string>& paths,
                                      std::vector<std::string>* read = nullptr);

/// True if `output` is none of the files `inputs` that a command reads (IsOneOf); else says, before
/// anything is written, that it would be overwritten.
bool SparesInputs(const std::string& output, const std::vector<std::string>& inputs);

/// The robot called `name` (the only one if `name` is empty); if there is none, says so on stderr
/// with the nearest name and returns nullptr.
const model::Robot* PickRobot(const model::Model& model, const std::string& name);

/// `{"p":[x,y,z],"q":[w,x,y,z]}`, metres; w >= 0 and no negative zeros.
Json PoseJson(const model::Pose& X);
/// `[x,y,z]` without negative zeros.
Json VectorJson(const Eigen::Vector3d& v);
/// A JSON bool, number or string.
Json AttributeJson(const model::AttributeValue& value);

/// " (did you mean 'x'?)" with the one of `names` that is nearest to `name`; "" if none is near.
std::string DidYouMean(const std::string& name, const std::vector<std::string>& names);

/// "mobility 16", or that it was not computed, and why.
std::string MobilityText(const model::KinematicGraph& graph);

/// "a, b, c"; of more than kMostNamed names the first ones "and 1234 more".
std::string NameSome(const std::vector<std::string>& names);

/// "file", "files": the noun with an s unless `count` is 1.
std::string Plural(size_t count, const std::string& noun);

}  // namespace morphbus::tools
