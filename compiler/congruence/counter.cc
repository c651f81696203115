#include "compiler/congruence/counter.h"

#include <algorithm>
#include <map>

namespace morphbus::congruence {

using Eigen::Matrix3d;

namespace {

/// Deeper nesting of choices than this is given up, so that the stack suffices.
constexpr int kMaxDepth = 400;

}  // namespace

/// For each piece of a (side 0) or b what its images must share; made when first asked for.
const std::vector<uint64_t>& Counter::Signatures(int side) {
  std::vector<uint64_t>& signatures = signatures_[side];
  if (!signatures.empty()) return signatures;
  const Pieces& pieces = side == 0 ? cut_.a : cut_.b;
  for (size_t p = 0; p < pieces.joints.size(); ++p) {
    uint64_t sum = pieces.bodies[p].size();
    for (const int joint : pieces.joints[p]) {
      sum += matched_.classes().joints[side][joint] * 0x9e3779b97f4a7c15u;
    }
    signatures.push_back(sum);
  }
  return signatures;
}

int64_t Counter::Ways(int body, const Place& place) {
  const int64_t ways = Begin(body, place, Goal::kCount);
  Clear();
  return ways;
}

bool Counter::Make(int body, const Place& place) {
  if (Begin(body, place, Goal::kMake) > 0) return true;
  Clear();
  return false;
}

int64_t Counter::Begin(int body, const Place& place, Goal goal) {
  if (matched_.classes().bodies[0][body] != matched_.classes().bodies[1][place.image]) return 0;
  matched_.MatchBodies(body, place.image);
  if (place.free_axis.isZero()) {
    matched_.R().SetWhole(body, place.R);
  } else {
    matched_.R().SetUpToTurn(body, place.R, place.free_axis);
  }
  std::vector<Entry> todo;
  const int64_t ways = Hang(body, -1, -1, goal, todo);
  return ways == 0 ? 0 : Times(ways, Fulfil(std::move(todo), goal));
}

/// The number of ways to fulfil all of `todo`. If it is not 0, a way may be left in place: where
/// the goal is to make one, it is.
int64_t Counter::Fulfil(std::vector<Entry> todo, Goal goal) {
  int64_t ways = 1;
  while (!todo.empty()) {
    const Entry entry = todo.back();
    todo.pop_back();
    const Known* known = Recall(entry);
    if (known != nullptr && (goal == Goal::kCount || known->ways == 0)) {
      ways = Times(ways, known->ways);
    } else {
      PieceSearch search(matched_, cut_, steps_, entry);
      if (!search.Next()) return 0;
      if (search.last()) {
        // The common case needs no nesting: a chain may have thousands of pieces.
        ways = Times(ways, HangAll(search.NewBodies(), entry, goal, todo));
      } else {
        const bool settled = matched_.R().settled(entry.body);
        const Matrix3d R = matched_.R().Value(entry.body);
        const int64_t sum = FulfilEach(search, goal);
        if (settled && (goal == Goal::kCount || sum == 0)) Remember(entry, R, sum);
        ways = Times(ways, sum);
      }
    }
    if (ways == 0) return 0;
  }
  return ways;
}

/// A piece that can be matched in several ways: the sum over them, or the first that leads on.
int64_t Counter::FulfilEach(PieceSearch& search, Goal goal) {
  if (++depth_ > kMaxDepth) steps_.left = 0;
  int64_t sum = 0;
  do {
    const Correspondence::Mark mark = matched_.mark();
    std::vector<Entry> todo;
    int64_t ways = HangAll(search.NewBodies(), search.entry(), goal, todo);
    if (ways > 0) ways = Times(ways, Fulfil(std::move(todo), goal));
    sum = Plus(sum, ways);
    if (ways > 0 && goal == Goal::kMake) break;
    matched_.Undo(mark);
  } while (search.Next());
  --depth_;
  return sum;
}

int64_t Counter::HangAll(const std::vector<int>& bodies, const Entry& entry, Goal goal,
                         std::vector<Entry>& todo) {
  int64_t ways = 1;
  for (const int body : bodies) {
    ways = Times(ways, Hang(body, entry.piece, entry.image, goal, todo));
    if (ways == 0) return 0;
  }
  return ways;
}

/// Matches what is at `body` but for the piece through which it was reached: counts what can be
/// counted here and adds the rest to `todo`.
int64_t Counter::Hang(int body, int but_piece, int but_image, Goal goal, std::vector<Entry>& todo) {
  int64_t ways = MatchStill(body, goal);
  if (ways == 0) return 0;
  const std::vector<int>& pieces = cut_.a.at_body[body];
  const std::vector<int>& images = cut_.b.at_body[matched_.ImageOf(body)];
  if (pieces.size() != images.size()) return 0;
  std::map<uint64_t, std::pair<std::vector<int>, std::vector<int>>> alike;
  for (const int piece : pieces) {
    if (piece != but_piece) alike[Signatures(0)[piece]].first.push_back(piece);
  }
  for (const int image : images) {
    if (image != but_image) alike[Signatures(1)[image]].second.push_back(image);
  }
  for (const auto& [signature, both] : alike) {
    const auto& [from, to] = both;
    if (from.size() != to.size()) return 0;
    if (from.size() == 1) {
      todo.push_back({from[0], to[0], body});
      continue;
    }
    ways = Times(ways, MatchAlike(body, from, to, goal, todo));
    if (ways == 0) return 0;
  }
  return ways;
}

/// Sorts pieces at a body into kinds. To count them, all of a kind are tried only with one of the
/// other side.
int64_t Counter::MatchAlike(int body, const std::vector<int>& pieces, std::vector<int> images,
                            Goal goal, std::vector<Entry>& todo) {
  std::vector<Kind> kinds;
  for (const int piece : pieces) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const Kind& k) {
      return k.pieces.size() < k.images.size() && WaysOf({piece, k.images[0], body}) > 0;
    });
    if (kind != kinds.end()) {
      kind->pieces.push_back(piece);
      continue;
    }
    Kind fresh{{piece}, {}, 0};
    std::vector<int> others;
    for (const int image : images) {
      const int64_t ways = WaysOf({piece, image, body});
      if (ways > 0) fresh.ways = ways;
      (ways > 0 ? fresh.images : others).push_back(image);
    }
    if (fresh.images.empty()) return 0;
    images = std::move(others);
    kinds.push_back(std::move(fresh));
  }
  int64_t ways = 1;
  for (Kind& kind : kinds) {
    if (kind.pieces.size() != kind.images.size()) return 0;
    if (goal == Goal::kMake) SortByModules(kind);
    for (size_t i = 0; i < kind.pieces.size(); ++i) {
      ways = Times(ways, Times(static_cast<int64_t>(i + 1), kind.ways));
      if (goal == Goal::kMake) todo.push_back({kind.pieces[i], kind.images[i], body});
    }
  }
  return ways;
}

/// Of the ways to pair them that which comes first by names: modules of a in declared order, those
/// of b by name.
void Counter::SortByModules(Kind& kind) const {
  const auto module_of = [](const Assembly& assembly, const std::vector<int>& joints) {
    return assembly.joints[*std::min_element(joints.begin(), joints.end())].module;
  };
  const auto declared = [&](int piece) { return module_of(matched_.a(), cut_.a.joints[piece]); };
  const auto name = [&](int image) -> const std::string& {
    const int module = module_of(matched_.b(), cut_.b.joints[image]);
    return matched_.b().robot->modules[module].name;
  };
  std::stable_sort(kind.pieces.begin(), kind.pieces.end(),
                   [&](int x, int y) { return declared(x) < declared(y); });
  std::stable_sort(kind.images.begin(), kind.images.end(),
                   [&](int x, int y) { return name(x) < name(y); });
}

/// Joints with both ends in `body`: any whose axis lies in place will do.
int64_t Counter::MatchStill(int body, Goal goal) {
  const int image = matched_.ImageOf(body);
  std::vector<bool> taken(matched_.b().bodies[image].joints.size(), false);
  int64_t ways = 1;
  for (const int joint : matched_.a().bodies[body].joints) {
    if (cut_.a.of_joint[joint] >= 0) continue;
    int64_t fitting = 0;
    int first = -1;
    for (size_t i = 0; i < taken.size(); ++i) {
      const int to = matched_.b().bodies[image].joints[i];
      if (cut_.b.of_joint[to] >= 0 || taken[i] || !matched_.MayCorrespond(joint, to)) continue;
      if (!matched_.StillFits(joint, {to, 1.0}) && !matched_.StillFits(joint, {to, -1.0})) continue;
      if (!matched_.Plausible(body, joint, {to, 1.0}) &&
          !matched_.Plausible(body, joint, {to, -1.0})) {
        continue;
      }
      ++fitting;
      if (first < 0) first = static_cast<int>(i);
    }
    if (fitting == 0) return 0;
    taken[first] = true;
    ways = Times(ways, fitting);
    if (goal != Goal::kMake) continue;
    const int to = matched_.b().bodies[image].joints[first];
    const double sign = matched_.Plausible(body, joint, {to, 1.0}) ? 1.0 : -1.0;
    if (!matched_.Commit(body, joint, {to, sign})) return 0;
  }
  return ways;
}

int64_t Counter::WaysOf(const Entry& entry) {
  if (!FirstJointFits(entry)) return 0;
  if (++depth_ > kMaxDepth) steps_.left = 0;
  const bool settled = matched_.R().settled(entry.body);
  const Matrix3d R = matched_.R().Value(entry.body);
  const Correspondence::Mark mark = matched_.mark();
  const int64_t ways = Fulfil({entry}, Goal::kCount);
  matched_.Undo(mark);
  --depth_;
  if (settled && Recall(entry) == nullptr) Remember(entry, R, ways);
  return ways;
}

/// Quick: does any joint of the image at the body lie where one of the piece does?
bool Counter::FirstJointFits(const Entry& entry) const {
  const int image = matched_.ImageOf(entry.body);
  for (const int joint : cut_.a.joints[entry.piece]) {
    const AssemblyJoint& j = matched_.a().joints[joint];
    if (j.body_a != entry.body && j.body_b != entry.body) continue;
    for (const int to : cut_.b.joints[entry.image]) {
      const AssemblyJoint& j_to = matched_.b().joints[to];
      if (j_to.body_a != image && j_to.body_b != image) continue;
      if (matched_.Plausible(entry.body, joint, {to, 1.0})) return true;
      if (matched_.Plausible(entry.body, joint, {to, -1.0})) return true;
    }
    return false;
  }
  return false;
}

uint64_t Counter::KeyOf(const Entry& entry) const {
  return static_cast<uint64_t>(entry.piece) * cut_.b.joints.size() +
         static_cast<uint64_t>(entry.image);
}

const Counter::Known* Counter::Recall(const Entry& entry) const {
  const auto found = known_.find(KeyOf(entry));
  if (found == known_.end() || !matched_.R().settled(entry.body)) return nullptr;
  const int image = matched_.ImageOf(entry.body);
  const Matrix3d R = matched_.R().Value(entry.body);
  for (const Known& known : found->second) {
    if (known.body == entry.body && known.image == image &&
        (known.R - R).norm() <= kGeometryTolerance) {
      return &known;
    }
  }
  return nullptr;
}

void Counter::Remember(const Entry& entry, const Matrix3d& R, int64_t ways) {
  if (steps_.gave_up()) return;
  known_[KeyOf(entry)].push_back({entry.body, matched_.ImageOf(entry.body), R, ways});
}

}  // namespace morphbus::congruence
