#include "logger/show/labels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace morphbus::logger {
namespace {

/// Owners of cells that belong to no module.
constexpr int kNobody = -1;
/// A name stands there.
constexpr int kTaken = -2;
/// At least so much of a name's rectangle (0…1) must be on its module to be read as its name.
constexpr double kMuchSeen = 0.75;

/// A rectangle of cells of an OwnerGrid, (column, row); high ends excluded. It may reach beyond the
/// grid.
using CellBox = Eigen::AlignedBox2i;

/// Which module is seen in each cell of the picture plane. Faces are painted into it as into the
/// picture, so that the nearest one counts. Placed names are entered, too.
class OwnerGrid {
 public:
  OwnerGrid(const LabelPlane& plane, const std::vector<VisibleFace>& faces)
      : plane_(plane),
        columns_(CellsIn(plane.high.x() - plane.low.x())),
        rows_(CellsIn(plane.high.y() - plane.low.y())),
        owners_(columns_ * rows_, kNobody) {
    for (const VisibleFace& face : faces) Paint(face);
  }

  /// Calls visit(column, row) for the cells of a box that lie in the grid, or for all.
  template <class Visit>
  void ForCells(const CellBox& box, const Visit& visit) const {
    const CellBox in = box.intersection(whole());
    for (int row = in.min().y(); row < in.max().y(); ++row) {
      for (int column = in.min().x(); column < in.max().x(); ++column) visit(column, row);
    }
  }
  [[nodiscard]] CellBox whole() const {
    return {Eigen::Vector2i(0, 0), Eigen::Vector2i(columns_, rows_)};
  }
  /// The module that is seen in a cell; kNobody or kTaken.
  [[nodiscard]] int At(int column, int row) const { return owners_[row * columns_ + column]; }
  /// The middle of a cell (m).
  [[nodiscard]] Eigen::Vector2d Middle(int column, int row) const {
    return plane_.low + plane_.cell * Eigen::Vector2d(column + 0.5, row + 0.5);
  }
  /// The cells of a name that is centred on a point.
  [[nodiscard]] CellBox BoxOf(const std::string& text, const Eigen::Vector2d& centre) const {
    const Eigen::Vector2d half =
        0.5 * Eigen::Vector2d(text.size() * plane_.character_width, plane_.character_height);
    return CellsOf({centre - half, centre + half});
  }
  /// How much of a box is `owner`'s, 0…1; 0 if it leaves the picture or touches a name.
  /// A name that would be cut by the picture's edge is of no use.
  [[nodiscard]] double Share(const CellBox& box, int owner) const {
    if (!whole().contains(box)) return 0.0;
    int own = 0;
    bool taken = false;
    ForCells(box, [&](int column, int row) {
      taken = taken || At(column, row) == kTaken;
      own += At(column, row) == owner ? 1 : 0;
    });
    const int all = box.volume();
    return taken || all == 0 ? 0.0 : static_cast<double>(own) / all;
  }
  /// No other name may stand in the box from now on.
  void Take(const CellBox& box) {
    ForCells(box, [&](int column, int row) { owners_[row * columns_ + column] = kTaken; });
  }

 private:
  /// How many cells a length (m) of the picture takes.
  [[nodiscard]] int CellsIn(double length) const {
    constexpr double kMost = 1000;  // Finer than any picture needs.
    return static_cast<int>(std::clamp(std::ceil(length / plane_.cell), 1.0, kMost));
  }

  /// The cells that a rectangle of the picture (m) touches.
  [[nodiscard]] CellBox CellsOf(const Eigen::AlignedBox2d& box) const {
    const Eigen::Array2d low = (box.min() - plane_.low) / plane_.cell;
    const Eigen::Array2d high = (box.max() - plane_.low) / plane_.cell;
    return {low.floor().cast<int>().matrix(), high.ceil().cast<int>().matrix()};
  }

  /// Gives the cells whose middle lies in a face to the face's owner. Faces are convex.
  /// Only the cells within the face's box need to be looked at.
  void Paint(const VisibleFace& face) {
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : face.outline) box.extend(p);
    ForCells(CellsOf(box), [&](int column, int row) {
      if (Covers(face, Middle(column, row))) owners_[row * columns_ + column] = face.owner;
    });
  }

  LabelPlane plane_;
  int columns_, rows_;
  std::vector<int> owners_;
};

/// A place for a name.
struct Spot {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double share = -1.0;  ///< Of its box that is as it should be; below 0: there is no place.
  /// From the point that the name is to be near, on the picture plane (m).
  double distance = std::numeric_limits<double>::infinity();
};

/// The best place for a name centred on a cell of the module itself.
Spot BestOnModule(const OwnerGrid& grid, const SceneName& name, const Eigen::Vector2d& anchor) {
  // Every cell of the module is tried, which a picture of a few hundred cells a side bears.
  Spot best;
  grid.ForCells(grid.whole(), [&](int column, int row) {
    if (grid.At(column, row) != name.owner) return;
    const Eigen::Vector2d centre = grid.Middle(column, row);
    // More than enough need not be more still: then the nearer place counts.
    const double share = std::min(grid.Share(grid.BoxOf(name.text, centre), name.owner), kMuchSeen);
    const double distance = (centre - anchor).norm();
    if (share > best.share || (share == best.share && distance < best.distance)) {
      best = {centre, share, distance};
    }
  });
  return best;
}

/// The place nearest to `tip` at which a name hides nothing.
Spot NearestFree(const OwnerGrid& grid, const SceneName& name, const Eigen::Vector2d& tip) {
  // Free are cells of no module, so that the name hides neither a module nor another name.
  Spot best;
  grid.ForCells(grid.whole(), [&](int column, int row) {
    const Eigen::Vector2d centre = grid.Middle(column, row);
    const double distance = (centre - tip).norm();
    if (distance >= best.distance) return;
    if (grid.Share(grid.BoxOf(name.text, centre), kNobody) < 1.0) return;
    best = {centre, 1.0, distance};
  });
  return best;
}

}  // namespace

std::vector<PlacedLabel> PlaceLabels(const Scene& scene, const std::vector<VisibleFace>& faces,
                                     const Projection& projection, const LabelPlane& plane) {
  OwnerGrid grid(plane, faces);
  std::vector<PlacedLabel> labels;
  for (const SceneName& name : scene.names) {
    const Eigen::Vector2d anchor = projection.Project(name.p_W).head<2>();
    const bool has_hull = std::any_of(scene.hulls.begin(), scene.hulls.end(), [&](const auto& h) {
      return h.owner == name.owner && !h.points_L.empty();
    });
    // A module without bodies has no place of its own: its name stands where the caller put it.
    Spot spot{anchor, kMuchSeen, 0.0};
    if (has_hull) spot = BestOnModule(grid, name, anchor);
    if (spot.share < 0) continue;  // Nothing of the module is seen.
    PlacedLabel label{name.text, spot.centre, std::nullopt};
    if (spot.share < kMuchSeen) {
      // Too little of the module is seen to write on: the name stands beside the robot.
      const Spot free = NearestFree(grid, name, spot.centre);
      if (free.share > 0) {
        label.tip = spot.centre;
        label.centre = free.centre;
      }
    }
    grid.Take(grid.BoxOf(label.text, label.centre));
    labels.push_back(std::move(label));
  }
  return labels;
}

}  // namespace morphbus::logger
