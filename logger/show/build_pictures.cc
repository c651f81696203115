#include "logger/show/build_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <queue>
#include <set>
#include <utility>

#include "logger/show/projection.h"

namespace morphbus::logger {
namespace {

using Eigen::Vector3d;
using LinkPoses = std::vector<std::vector<model::Pose>>;

/// Width of a picture in units of a drawing: such that texts are neither small on paper nor large
/// on a page.
constexpr double kPictureWidth_px = 400;
/// More modules than these are not drawn beside those that are put on, for painting takes the
/// square of their number: the nearest are enough to see where the new one goes.
constexpr size_t kMostStanding = 12;
/// A whole robot of more modules is drawn by its hulls, without names, which could not be read.
constexpr size_t kMostDetailed = 60;
/// How far off a module is drawn, as a part of its extent.
constexpr double kDrawnOff = 0.45;
/// What stands already is this much nearer to this grey.
constexpr double kPale = 0.82;
constexpr Color kPaleGrey = {0.80, 0.82, 0.85};
/// The colours of pairs of connectors that mate; they begin again.
constexpr Color kPairColors[] = {
    {0.81, 0.13, 0.18}, {0.12, 0.38, 0.80}, {0.10, 0.48, 0.22}, {0.50, 0.22, 0.70}};

struct NamedView {
  View view;
  const char* words;
};
constexpr NamedView kViews[] = {{View::kThreeQuarter, "seen from north-east and above"},
                                {View::kFromSouthEast, "seen from south-east and above"},
                                {View::kFromNorthWest, "seen from north-west and above"},
                                {View::kFromSouthWest, "seen from south-west and above"}};

/// Takes the colour out of a module's bodies.
void MakePale(Scene& scene, int owner) {
  for (SceneHull& hull : scene.hulls) {
    if (hull.owner != owner) continue;
    for (size_t i = 0; i < 3; ++i) {
      hull.color[i] = kPale * kPaleGrey[i] + (1 - kPale) * hull.color[i];
    }
  }
}

/// A view of a scene: what is seen where.
struct Sight {
  Projection projection;
  std::vector<VisibleFace> faces;

  Sight(const Scene& scene, View view) : projection(view), faces(VisibleFaces(scene, projection)) {}

  /// Whether the surface of an owner is seen at a point of it that looks in a direction (in W).
  [[nodiscard]] bool Sees(const Vector3d& p_W, const std::optional<Vector3d>& face_W,
                          int owner) const {
    if (face_W && projection.Direction(*face_W).z() < 0.1) return false;
    return OwnerAt(faces, projection.Project(p_W).head<2>()) == owner;
  }
};

/// A panel without a ground, not higher than wide, and not smaller than what is in it.
Panel PanelOfScene(Scene scene, const NamedView& view) {
  scene.ground = false;
  Panel panel = {std::move(scene), view.view, view.words};
  Eigen::AlignedBox2d extent = ExtentOf(panel);
  for (const SceneMark& mark : panel.scene.marks) {
    extent.extend(Eigen::Vector2d(Projection(view.view).Project(mark.p_W).head<2>()));
  }
  const double short_of = extent.sizes().y() * 1.15 - extent.sizes().x();
  if (short_of > 0) {
    extent.min().x() -= short_of / 2;
    extent.max().x() += short_of / 2;
  }
  // Above it is room for the compass and the scale bar, which are read where nothing is behind
  // them.
  constexpr double kRoomAbove = 0.15;
  extent.max().y() += kRoomAbove * extent.sizes().x();
  panel.extent = extent;
  return panel;
}

/// Some modules of a robot, as a robot to be drawn.
struct Part {
  model::Robot robot;
  LinkPoses X_WL;
  /// The modules of the whole robot that they are.
  std::vector<int> modules;
};

Part PartOf(const Assembly& assembly, const std::vector<int>& modules, const LinkPoses& X_RL) {
  Part part;
  part.modules = modules;
  for (const int module : modules) {
    part.robot.modules.push_back(assembly.robot.modules[module]);
    part.X_WL.push_back(X_RL[module]);
  }
  return part;
}

/// Those of the modules that stand before a step that are nearest to it, by dockings.
std::vector<int> NearestStanding(const Assembly& assembly,
                                 std::span<const model::AddedModule> added) {
  std::vector<std::vector<int>> beside(assembly.robot.modules.size());
  for (const model::Docking& d : assembly.robot.dockings) {
    beside[d.module_a].push_back(d.module_b);
    beside[d.module_b].push_back(d.module_a);
  }
  std::vector<bool> stands(assembly.robot.modules.size());
  for (const model::AddedModule& one : assembly.plan.modules) {
    if (&one == added.data()) break;
    stands[one.module] = true;
  }
  // Breadth first from all that are added.
  std::vector<int> nearest;
  std::queue<int> todo;
  for (const model::AddedModule& one : added) todo.push(one.module);
  while (!todo.empty() && nearest.size() < kMostStanding) {
    const int at = todo.front();
    todo.pop();
    for (const int next : beside[at]) {
      if (!stands[next]) continue;
      stands[next] = false;
      nearest.push_back(next);
      todo.push(next);
    }
  }
  return nearest;
}

/// The scene of a step, and what marks need to know.
class StepScene {
 public:
  StepScene(const Assembly& assembly, std::span<const model::AddedModule> added, int first_mark)
      : assembly_(assembly), added_(added), first_mark_(first_mark) {
    LinkPoses X_RL = assembly.plan.X_RL;
    std::vector<int> shown = NearestStanding(assembly, added);
    num_standing_ = static_cast<int>(shown.size());
    // What hangs from a module that is drawn off goes with it.
    std::map<int, Vector3d> off;
    for (const model::AddedModule& one : added) {
      Vector3d shift = Vector3d::Zero();
      if (!one.matings.empty()) {
        shift = kDrawnOff * model::ExtentOf(assembly.TypeOf(one.module)) * one.from_R;
        const auto parent = off.find(one.matings.front().standing);
        if (parent != off.end()) shift += parent->second;
      }
      off[one.module] = shift;
      for (model::Pose& X : X_RL[one.module]) X.translation() += shift;
      shown.push_back(one.module);
    }
    part_ = PartOf(assembly, shown, X_RL);
    std::vector<Color> colors(shown.size(), kPaleGrey);
    for (size_t i = 0; i < added.size(); ++i) {
      colors[num_standing_ + i] = PaletteColor(static_cast<int>(i) + 1);
    }
    scene_ = SceneOf(assembly.model, part_.robot, part_.X_WL, colors);
    for (int owner = 0; owner < num_standing_; ++owner) MakePale(scene_, owner);
    // A single module has its name in the heading, and the connectors need the room.
    if (added.size() == 1) {
      std::erase_if(scene_.names,
                    [&](const SceneName& name) { return name.owner >= num_standing_; });
    }
  }

  /// The picture from where most of the new modules is seen.
  SheetPicture Make() {
    std::optional<Sight> best;
    const NamedView* view = nullptr;
    double best_share = -1.0;
    for (const NamedView& one : kViews) {
      Sight sight(scene_, one.view);
      const double share = ShareSeen(sight);
      // The first view is kept unless another one shows clearly more.
      if (share < best_share + 0.15) continue;
      best_share = share;
      best.emplace(std::move(sight));
      view = &one;
    }
    AddMarks(*best, ExtentOf({scene_, view->view, ""}).sizes().maxCoeff());
    SheetPicture picture;
    picture.drawing.panel_width_px = kPictureWidth_px;
    picture.drawing.panels.push_back(PanelOfScene(std::move(scene_), *view));
    return picture;
  }

 private:
  /// SceneHull::owner of a module of the whole robot; -1 if it is not drawn.
  [[nodiscard]] int OwnerOf(int module) const {
    const auto at = std::ranges::find(part_.modules, module);
    return at == part_.modules.end() ? -1 : static_cast<int>(at - part_.modules.begin());
  }

  struct Place {
    Vector3d p_W;
    std::optional<Vector3d> face_W;
    int owner = 0;
  };
  /// Where a connector is drawn, a little in front of its face, and how it looks.
  [[nodiscard]] Place PlaceOf(int module, int connector) const {
    const int owner = OwnerOf(module);
    const model::Connector& c = assembly_.TypeOf(module).connectors[connector];
    return {part_.X_WL[owner][c.link] * c.p_MoCo_M, assembly_.plan.faces_R[module][connector],
            owner};
  }
  [[nodiscard]] static bool Sees(const Sight& sight, const Place& place) {
    return sight.Sees(place.p_W, place.face_W, place.owner);
  }

  /// How much of the corners of what is new, and of the connectors that mate, is seen (0…1); less
  /// where what is drawn off is so along the line of sight.
  [[nodiscard]] double ShareSeen(const Sight& sight) const {
    int seen = 0, all = 0;
    const auto count = [&](bool is_seen) {
      ++all;
      seen += is_seen ? 1 : 0;
    };
    for (const model::AddedModule& one : added_) {
      const int owner = OwnerOf(one.module);
      const model::ModuleType& type = assembly_.TypeOf(one.module);
      for (size_t l = 0; l < type.links.size(); ++l) {
        Vector3d middle = Vector3d::Zero();
        for (const Vector3d& p : type.links[l].hull) middle += p / type.links[l].hull.size();
        // Corners a little inwards, so that they lie on the body in the picture, too.
        for (const Vector3d& p : type.links[l].hull) {
          count(sight.Sees(part_.X_WL[owner][l] * (middle + 0.85 * (p - middle)), {}, owner));
        }
      }
      for (const model::Mating& mating : one.matings) {
        if (OwnerOf(mating.standing) < 0) continue;
        count(Sees(sight, PlaceOf(mating.standing, mating.standing_connector)) ||
              Sees(sight, PlaceOf(one.module, mating.own_connector)));
      }
    }
    const double share = all > 0 ? static_cast<double>(seen) / all : 1.0;
    double shortest = 1.0;
    for (const model::AddedModule& one : added_) {
      if (one.matings.empty()) continue;
      shortest = std::min(shortest, sight.projection.Direction(one.from_R).head<2>().norm());
    }
    // A line of at least seven tenths of its length is seen well enough.
    constexpr double kLong = 0.7;
    return share * std::min(1.0, shortest / kLong);
  }

  /// Numbered dots for what mates, and names of other connectors where they are seen: those of the
  /// new modules, and those of the standing ones that face alike. `size` is that of the picture
  /// (m).
  void AddMarks(const Sight& sight, double size) {
    std::set<std::pair<int, int>> used, named;
    int mark = first_mark_;
    size_t pair = 0;
    for (const model::AddedModule& one : added_) {
      for (const model::Mating& mating : one.matings) {
        const Color color = kPairColors[pair++ % std::size(kPairColors)];
        const std::pair<int, int> standing = {mating.standing, mating.standing_connector};
        const std::pair<int, int> own = {one.module, mating.own_connector};
        if (OwnerOf(mating.standing) >= 0) {
          scene_.lines.push_back({PlaceOf(standing.first, standing.second).p_W,
                                  PlaceOf(own.first, own.second).p_W, color});
        }
        for (const auto& [module, connector] : {standing, own}) {
          used.insert({module, connector});
          if (OwnerOf(module) >= 0) {
            const Place place = PlaceOf(module, connector);
            const auto kind = Sees(sight, place) ? SceneMark::Kind::kDot : SceneMark::Kind::kRing;
            scene_.marks.push_back({std::to_string(mark), place.p_W, color, kind});
          }
          ++mark;
        }
        for (const auto& [c, other] : mating.same_way) named.insert({mating.standing, other});
      }
      for (int c = 0; c < std::ssize(assembly_.TypeOf(one.module).connectors); ++c) {
        named.insert({one.module, c});
      }
    }
    std::vector<SceneMark> names;
    for (const auto& [module, connector] : named) {
      if (used.contains({module, connector}) || OwnerOf(module) < 0) continue;
      const Place place = PlaceOf(module, connector);
      if (!place.face_W || !Sees(sight, place)) continue;
      // A number goes before a name that would stand in the same place.
      constexpr double kNear = 0.045;
      const auto covers = [&](const SceneMark& one) {
        return sight.projection.Project(one.p_W - place.p_W).head<2>().norm() < kNear * size;
      };
      if (std::ranges::any_of(scene_.marks, covers)) continue;
      SceneMark& name = names.emplace_back();
      name.text = assembly_.TypeOf(module).connectors[connector].name;
      name.p_W = place.p_W;
      name.kind = SceneMark::Kind::kText;
    }
    scene_.marks.insert(scene_.marks.begin(), names.begin(), names.end());
  }

  const Assembly& assembly_;
  std::span<const model::AddedModule> added_;
  int first_mark_;
  int num_standing_ = 0;
  Part part_;
  Scene scene_;
};

}  // namespace

SheetPicture TypePicture(const model::Model& model, int type) {
  const model::ModuleType& of = model.module_types[type];
  model::Robot robot;
  robot.modules.push_back({"", type, std::vector<double>(of.joints.size(), 0.0)});
  const LinkPoses X_WL = {std::vector<model::Pose>(of.links.size(), model::Pose::Identity())};
  SheetPicture picture;
  picture.words = of.name + " with its connectors, from two opposite corners, all joints at 0";
  picture.drawing.panel_width_px = kPictureWidth_px / 2;
  picture.drawing.columns = 2;
  for (const NamedView& view : {NamedView{View::kThreeQuarter, "from one side"},
                                NamedView{View::kFromBelow, "from the opposite side"}}) {
    Scene scene = SceneOf(model, robot, X_WL, {PaletteColor(1)});
    scene.names.clear();
    const Sight sight(scene, view.view);
    for (const model::Connector& connector : of.connectors) {
      const auto face = connector.normals.find("");
      const bool known = face != connector.normals.end();
      const std::optional<Vector3d> way = known ? std::optional(face->second) : std::nullopt;
      if (!sight.Sees(connector.p_MoCo_M, way, 0)) continue;
      scene.marks.push_back({connector.name, connector.p_MoCo_M, {}, SceneMark::Kind::kText});
      // A step tells which points meet, and a person must find them on the module: where the
      // connector is not seen so much from the side that their names would lie on each other.
      constexpr double kFlat = 0.4;
      if (way && sight.projection.Direction(*way).z() < kFlat) continue;
      for (size_t i = 0; i < connector.subpoints.size(); ++i) {
        scene.marks.push_back(
            {connector.subpoint_names[i], connector.subpoints[i], {}, SceneMark::Kind::kSmallText});
      }
    }
    picture.drawing.panels.push_back(PanelOfScene(std::move(scene), view));
    // A module in the hand has no north.
    picture.drawing.panels.back().compass = false;
  }
  return picture;
}

SheetPicture StepPicture(const Assembly& assembly, std::span<const model::AddedModule> added,
                         int first_mark) {
  SheetPicture picture = StepScene(assembly, added, first_mark).Make();
  std::vector<std::string> names;
  for (const model::AddedModule& one : added) names.push_back(assembly.NameOf(one.module));
  picture.words =
      ListWords(names) +
      (added.front().matings.empty() ? ", the first" : ", drawn off from where it goes");
  return picture;
}

SheetPicture PosePicture(const Assembly& assembly, const LinkPoses& X_RL, std::string words) {
  SheetPicture picture;
  picture.words = std::move(words);
  picture.drawing.panel_width_px = kPictureWidth_px;
  const size_t modules = assembly.robot.modules.size();
  model::Model plain;
  if (modules > kMostDetailed) {
    plain.module_types = assembly.model.module_types;
    for (model::ModuleType& type : plain.module_types) {
      for (model::Link& link : type.links) link.visual.clear();
    }
  }
  Scene scene = SceneOf(modules > kMostDetailed ? plain : assembly.model, assembly.robot, X_RL,
                        PaletteColors(modules));
  if (modules > kMostDetailed) scene.names.clear();
  picture.drawing.panels.push_back(PanelOfScene(std::move(scene), kViews[0]));
  return picture;
}

}  // namespace morphbus::logger
