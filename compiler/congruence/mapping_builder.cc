#include "compiler/congruence/mapping_builder.h"

#include <algorithm>

namespace morphbus::congruence {

namespace {

/// Choices nested deeper than this are given up, so that the stack suffices.
constexpr int kMaxDepth = 400;

}  // namespace

MappingBuilder::MappingBuilder(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes,
                               Steps& steps)
    : matched_(a, b, classes),
      pieces_{Decompose(a, matched_.length_tolerance()), Decompose(b, matched_.length_tolerance())},
      steps_(steps),
      signatures_a_(SignaturesOf(pieces_.a, classes.joints[0])),
      signatures_b_(SignaturesOf(pieces_.b, classes.joints[1])) {}

/// By piece a hash of how many bodies it has and which classes its joints are in.
std::vector<uint64_t> MappingBuilder::SignaturesOf(const Decomposition& pieces,
                                                   const std::vector<uint64_t>& joint_classes) {
  std::vector<uint64_t> signatures;
  for (size_t p = 0; p < pieces.joints.size(); ++p) {
    uint64_t sum = pieces.bodies[p].size();
    for (const int joint : pieces.joints[p]) sum += joint_classes[joint] * 0x9e3779b97f4a7c15u;
    signatures.push_back(sum);
  }
  return signatures;
}

bool MappingBuilder::Build(int body, const Place& place) {
  if (steps_.gave_up()) return false;
  // The seed first, then all that hangs on it.
  std::vector<Entry> todo;
  if (PutAt(body, place) && MatchAtBody(body, -1, -1, todo) && MatchAll(std::move(todo))) {
    return true;
  }
  Clear();
  return false;
}

bool MappingBuilder::PutAt(int body, const Place& place) {
  if (matched_.classes().bodies[0][body] != matched_.classes().bodies[1][place.image]) return false;
  matched_.MatchBodies(body, place.image);
  if (place.free_axis.isZero()) {
    matched_.R().SetWhole(body, place.R);
  } else {
    matched_.R().SetUpToTurn(body, place.R, place.free_axis);
  }
  return true;
}

/// Matches all of `todo` and what hangs on it. The order does not matter, as none depends on
/// another.
bool MappingBuilder::MatchAll(std::vector<Entry> todo) {
  while (!todo.empty()) {
    const Entry entry = todo.back();
    todo.pop_back();
    if (KnownToFail(entry)) return false;
    Backtracker search(matched_, pieces_, steps_, entry);
    bool fits = search.Next();
    if (fits && search.last()) {
      // The common case, a piece that fits in one way, needs no recursion: a chain may have
      // thousands of pieces.
      if (!AddBeyond(search, todo)) return false;
      continue;
    }
    // A piece that fits in several ways: the first that leads on.
    if (++depth_ > kMaxDepth) steps_.left = 0;
    while (fits && !MatchBeyond(search)) fits = search.Next();
    --depth_;
    if (fits) continue;
    RememberFailure(entry);
    return false;
  }
  return true;
}

bool MappingBuilder::MatchBeyond(const Backtracker& search) {
  std::vector<Entry> todo;
  return AddBeyond(search, todo) && MatchAll(std::move(todo));
}

bool MappingBuilder::AddBeyond(const Backtracker& search, std::vector<Entry>& todo) {
  for (const int body : search.NewBodies()) {
    if (!MatchAtBody(body, search.entry().piece, search.entry().image, todo)) return false;
  }
  return true;
}

bool MappingBuilder::MatchPiece(const Entry& entry) {
  if (++depth_ > kMaxDepth) steps_.left = 0;
  const Correspondence::Mark before = matched_.mark();
  const bool fits = MatchAll({entry});
  if (!fits) {
    matched_.Undo(before);
    RememberFailure(entry);
  }
  --depth_;
  return fits;
}

/// Matches what is at `body` but for the piece through which it was reached, or adds it to `todo`
/// where there is no choice.
bool MappingBuilder::MatchAtBody(int body, int but_piece, int but_image, std::vector<Entry>& todo) {
  if (MatchJointsWithin(body) == 0) return false;
  std::optional<std::vector<InterchangeableSet>> sets = PiecesAt(body, but_piece, but_image);
  if (!sets) return false;
  for (InterchangeableSet& set : *sets) {
    // A piece with one possible image is left to the caller, which needs no recursion for it.
    if (set.pieces.size() == 1) {
      todo.push_back({set.pieces[0], set.images[0], body});
      continue;
    }
    // Else each piece takes the first image with which it can be matched, to its last joint.
    SortByModules(set);
    for (const int piece : set.pieces) {
      const auto image = std::find_if(set.images.begin(), set.images.end(), [&](int candidate) {
        return MatchPiece({piece, candidate, body});
      });
      if (image == set.images.end()) return false;
      set.images.erase(image);
    }
  }
  return true;
}

std::optional<std::vector<InterchangeableSet>> MappingBuilder::PiecesAt(int body, int but_piece,
                                                                        int but_image) {
  const std::vector<int>& pieces = pieces_.a.at_body[body];
  const std::vector<int>& images = pieces_.b.at_body[matched_.ImageOf(body)];
  // Pieces can only go to pieces of the same signature, so of each there must be as many.
  if (pieces.size() != images.size()) return std::nullopt;
  std::map<uint64_t, InterchangeableSet> by_signature;
  for (const int piece : pieces) {
    if (piece != but_piece) by_signature[signatures_a_[piece]].pieces.push_back(piece);
  }
  for (const int image : images) {
    if (image != but_image) by_signature[signatures_b_[image]].images.push_back(image);
  }
  std::vector<InterchangeableSet> sets;
  for (auto& [signature, set] : by_signature) {
    if (set.pieces.size() != set.images.size()) return std::nullopt;
    sets.push_back(std::move(set));
  }
  return sets;
}

/// Such that first matching with first gives the mapping that comes first by names: pieces of a by
/// their modules in declared order, those of b by the names of theirs.
void MappingBuilder::SortByModules(InterchangeableSet& set) const {
  const auto module_of = [](const ScrewGraph& graph, const std::vector<int>& joints) {
    return graph.joints[*std::min_element(joints.begin(), joints.end())].module;
  };
  const auto declared = [&](int piece) { return module_of(matched_.a(), pieces_.a.joints[piece]); };
  const auto name = [&](int image) -> const std::string& {
    const int module = module_of(matched_.b(), pieces_.b.joints[image]);
    return matched_.b().robot->modules[module].name;
  };
  std::stable_sort(set.pieces.begin(), set.pieces.end(),
                   [&](int x, int y) { return declared(x) < declared(y); });
  std::stable_sort(set.images.begin(), set.images.end(),
                   [&](int x, int y) { return name(x) < name(y); });
}

int64_t MappingBuilder::MatchJointsWithin(int body) {
  int64_t ways = 1;
  for (const int joint : matched_.a().bodies[body].joints) {
    if (pieces_.a.of_joint[joint] >= 0) continue;
    // As in MatchAtBody: those that fit are alike, so any of them will do.
    std::optional<Counterpart> first;
    int64_t fitting = 0;
    for (const int to : matched_.b().bodies[matched_.ImageOf(body)].joints) {
      if (pieces_.b.of_joint[to] >= 0 || !matched_.LockedValuesAgree(joint, to)) continue;
      std::vector<Counterpart> counterparts;
      matched_.AddCounterparts(body, joint, to, counterparts);
      if (counterparts.empty()) continue;
      if (!first) first = counterparts.front();
      ++fitting;
    }
    if (!first || !matched_.Commit(body, joint, *first)) return 0;
    ways = std::min(ways * fitting, kMaxCounted + 1);
  }
  return ways;
}

// --- What has failed -----------------------------------------------------------------------------

// One piece is come to again and again where pieces before it fit in several ways. That it failed
// is worth knowing then; that it fitted is not, for then the search is not taken back.

MappingBuilder::MemoEntry MappingBuilder::MemoOf(const Entry& entry) const {
  return {entry.piece, entry.image, entry.body, matched_.ImageOf(entry.body)};
}

bool MappingBuilder::KnownToFail(const Entry& entry) const {
  const auto failed = failed_.find(MemoOf(entry));
  if (failed == failed_.end() || !matched_.R().settled(entry.body)) return false;
  const Eigen::Matrix3d R = matched_.R().Value(entry.body);
  return std::any_of(
      failed->second.begin(), failed->second.end(),
      [&](const Eigen::Matrix3d& other) { return (other - R).norm() <= kGeometryTolerance; });
}

void MappingBuilder::RememberFailure(const Entry& entry) {
  if (steps_.gave_up() || !matched_.R().settled(entry.body) || KnownToFail(entry)) return;
  failed_[MemoOf(entry)].push_back(matched_.R().Value(entry.body));
}

}  // namespace morphbus::congruence
