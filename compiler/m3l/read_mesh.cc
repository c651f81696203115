#include "compiler/m3l/read_mesh.h"

#include <assimp/BaseImporter.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/model/convex_hull.h"
#include "compiler/source/source_text.h"

namespace morphbus::m3l {
namespace {

// Binary STL: 80 bytes of any text, the number of triangles, and 50 bytes for each.
constexpr size_t kHeaderBytes = 84;
constexpr size_t kTriangleBytes = 50;
// A triangle of a text file takes more than this.
constexpr size_t kTextTriangleBytes = 60;

/// How many triangles a binary file says it has, if it is as long as it then must be.
std::optional<size_t> BinaryTriangles(const std::string& bytes) {
  if (bytes.size() < kHeaderBytes) return std::nullopt;
  size_t count = 0;
  // Four bytes, the lowest first.
  for (int i = 3; i >= 0; --i) count = count << 8U | static_cast<uint8_t>(bytes[80 + i]);
  if (bytes.size() != kHeaderBytes + kTriangleBytes * count) return std::nullopt;
  return count;
}

/// Opens no file, whatever others a mesh names: all that is read has been given as bytes.
class NoFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char* /*path*/) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* /*path*/, const char* /*mode*/) override { return nullptr; }
  void Close(Assimp::IOStream* /*file*/) override {}
};

/// Lets the importer read one format and nothing else, whatever the bytes look like.
/// @param extension  among those of the format: "stl".
void KeepOnly(const std::string& extension, Assimp::Importer* importer) {
  // From the last to the first, since unregistering moves those behind.
  for (size_t i = importer->GetImporterCount(); i-- > 0;) {
    const aiImporterDesc* description = importer->GetImporterInfo(i);
    // Its extensions are a list with spaces between them.
    const std::string all = description ? fmt::format(" {} ", description->mFileExtensions) : "";
    if (all.find(" " + extension + " ") != std::string::npos) continue;
    // What is unregistered is ours to delete.
    const std::unique_ptr<Assimp::BaseImporter> other(importer->GetImporter(i));
    importer->UnregisterLoader(other.get());
  }
}

// What a mesh of a robot's link has far fewer of. The library copies a mesh for each node that
// shows it, goes down into nodes by calling itself, and cuts a face up in the square of its
// corners.
constexpr size_t kMostNodes = 10'000;
constexpr size_t kMostNesting = 64;
constexpr unsigned kMostCorners = 200;

/// What of a glTF is more than the library should even read; empty if nothing is.
std::string ExcessOfText(std::string_view bytes) {
  // Brackets in strings count for nothing; a binary part behind the text only adds to them.
  size_t nesting = 0, nodes = 0;
  bool in_string = false;
  for (size_t i = 0; i < bytes.size(); ++i) {
    const char c = bytes[i];
    if (in_string && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_string = !in_string;
      if (in_string && bytes.substr(i).starts_with("\"children\"")) ++nodes;
    } else if (!in_string && (c == '{' || c == '[')) {
      ++nesting;
    } else if (!in_string && (c == '}' || c == ']') && nesting > 0) {
      --nesting;
    }
    if (nesting > kMostNesting) return fmt::format("nests deeper than {}", kMostNesting);
    if (nodes > kMostNodes) return fmt::format("has more than {} nodes", kMostNodes);
  }
  return "";
}

/// What of a binary glTF the library would believe without looking; empty if nothing is. Its parts
/// say how long they are.
std::string ExcessOfParts(std::string_view bytes) {
  // A part begins with its length and its kind, 4 bytes each, the lowest first.
  const auto number = [&](size_t at) {
    size_t value = 0;
    for (size_t i = 4; i-- > 0;) value = value << 8U | static_cast<uint8_t>(bytes[at + i]);
    return value;
  };
  if (bytes.size() < 12 || number(8) != bytes.size()) return "is not as long as it says";
  for (size_t at = 12; at < bytes.size(); at += 8 + number(at)) {
    if (bytes.size() - at < 8 || number(at) > bytes.size() - at - 8)
      return "has a part that is cut";
  }
  return "";
}

/// What of an OBJ file the library takes for something else; empty if nothing is.
std::string ExcessOfNumbers(std::string_view bytes) {
  // Longer ones overflow where they are indices, and then name any place in memory.
  constexpr size_t kMostDigits = 9;
  for (size_t begin = 0; begin < bytes.size();) {
    const size_t end = std::min(bytes.find('\n', begin), bytes.size());
    const std::string_view line = bytes.substr(begin, end - begin);
    const size_t word = line.find_first_not_of(" \t\r");
    // Faces, lines and points have indices; what else there is has coordinates or names.
    const bool indices = word != std::string_view::npos &&
                         std::string_view("flp").find(line[word]) != std::string_view::npos;
    size_t digits = 0;
    for (const char c : line) {
      digits = c >= '0' && c <= '9' ? digits + 1 : 0;
      if (indices && digits > kMostDigits) return "has an index of more than 9 digits";
    }
    begin = end + 1;
  }
  return "";
}

/// The lines of an OBJ file that say where corners and faces are. Materials are other files, and at
/// words that it does not know the library has read beyond the end.
std::string GeometryOf(std::string_view bytes) {
  constexpr std::string_view kWords[] = {"v", "vt", "vn", "f", "l", "p", "o", "g", "s"};
  std::string kept;
  for (size_t begin = 0; begin < bytes.size();) {
    const size_t end = std::min(bytes.find('\n', begin), bytes.size());
    const std::string_view line = bytes.substr(begin, end - begin);
    const size_t from = std::min(line.find_first_not_of(" \t\r"), line.size());
    const std::string_view word = line.substr(from, line.find_first_of(" \t\r", from) - from);
    if (std::ranges::find(kWords, word) != std::end(kWords)) kept.append(line).append("\n");
    begin = end + 1;
  }
  return kept;
}

/// What of a scene is more than the library should process; empty if nothing is.
std::string ExcessOf(const aiScene& scene) {
  std::vector<size_t> triangles(scene.mNumMeshes, 0);
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const unsigned corners = mesh.mFaces[f].mNumIndices;
      if (corners > kMostCorners) {
        return fmt::format("has a face of {} corners, the most is {}", corners, kMostCorners);
      }
      triangles[m] += corners > 2 ? corners - 2 : 1;
    }
  }
  // A mesh counts as often as nodes show it.
  size_t total = 0, nodes = 0;
  std::vector<const aiNode*> open;
  if (scene.mRootNode != nullptr) open.push_back(scene.mRootNode);
  while (!open.empty()) {
    const aiNode* node = open.back();
    open.pop_back();
    if (++nodes > kMostNodes) return fmt::format("has more than {} nodes", kMostNodes);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) total += triangles[node->mMeshes[i]];
    if (total > kMaxTriangles) {
      return fmt::format("has {} triangles, the most is {}", total, kMaxTriangles);
    }
    open.insert(open.end(), node->mChildren, node->mChildren + node->mNumChildren);
  }
  return "";
}

/// What people call the format of that extension.
const char* FormatOf(const std::string& extension) {
  if (extension == "stl") return "STL";
  return extension == "obj" ? "OBJ" : "glTF";
}

/// The triangles of bytes that have been looked at, read as the format of that extension.
/// @param flags  what the library is to do with them, of aiPostProcessSteps.
Result<MeshTriangles> ParseAs(const std::string& extension, unsigned flags, const std::string& name,
                              const std::string& bytes) {
  const auto bad = [&](const std::string& why) { return Fail("mesh '" + name + "' " + why); };
  Assimp::Importer importer;
  importer.SetIOHandler(new NoFiles);
  KeepOnly(extension, &importer);
  const aiScene* scene =
      importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, extension.c_str());
  if (scene == nullptr) {
    const std::string why = importer.GetErrorString();
    // The library calls bytes without a file by a name of its own.
    if (why.starts_with("No suitable reader")) {
      return bad(fmt::format("is no {} file, which its name says it is", FormatOf(extension)));
    }
    return bad("cannot be read: " + why);
  }
  if (flags != 0) {
    if (const std::string excess = ExcessOf(*scene); !excess.empty()) return bad(excess);
    scene = importer.ApplyPostProcessing(flags);
    if (scene == nullptr) return bad(std::string("cannot be read: ") + importer.GetErrorString());
  }
  // Triangles share their corners: each is taken once.
  MeshTriangles result;
  std::map<std::array<float, 3>, int> known;
  size_t triangles = 0;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    triangles += mesh.mNumFaces;
    if (triangles > kMaxTriangles) {
      return bad(fmt::format("has {} triangles, the most is {}", triangles, kMaxTriangles));
    }
    std::vector<int> index_of;
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      const Eigen::Vector3d point(p.x, p.y, p.z);
      if (!point.allFinite()) return bad("has a coordinate that is not finite");
      const auto [at, is_new] =
          known.try_emplace({p.x, p.y, p.z}, static_cast<int>(result.points.size()));
      if (is_new) result.points.push_back(point);
      index_of.push_back(at->second);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      const std::array<int, 3> corners = {index_of[face.mIndices[0]], index_of[face.mIndices[1]],
                                          index_of[face.mIndices[2]]};
      const Eigen::Vector3d& a = result.points[corners[0]];
      const Eigen::Vector3d side_1 = result.points[corners[1]] - a;
      const Eigen::Vector3d side_2 = result.points[corners[2]] - a;
      // Triangles without area, as rounding leaves them, have no plane; their corners still count
      // for the hull.
      if (side_1.cross(side_2).norm() > 0.0) result.triangles.push_back(corners);
    }
  }
  if (result.points.empty()) return bad("has no triangle");
  return result;
}

}  // namespace

Result<std::vector<Eigen::Vector3d>> ReadMeshHull(const std::string& path) {
  const Result<std::string> bytes = source::ReadSourceFile(path);
  if (!bytes) return Fail(bytes.error().message);
  return MeshHull(path, *bytes);
}

Result<MeshTriangles> ParseMesh(const std::string& name, const std::string& bytes) {
  const auto bad = [&](const std::string& why) { return Fail("mesh '" + name + "' " + why); };
  // What is neither a whole binary file nor begins as a text does is not given to the library.
  const std::optional<size_t> binary = BinaryTriangles(bytes);
  // Binary files may begin with the same word, and are known by their length first.
  const bool text = bytes.rfind("solid", 0) == 0 && bytes.find('\0') == std::string::npos;
  if (!binary && !text) return bad("is no STL file, or one that was cut");
  const size_t most = binary ? *binary : bytes.size() / kTextTriangleBytes;
  if (binary && most > kMaxTriangles) {
    return bad(fmt::format("has {} triangles, the most is {}", most, kMaxTriangles));
  }
  return ParseAs("stl", 0, name, bytes);
}

Result<MeshTriangles> ReadMesh(const std::string& path) {
  const Result<std::string> bytes = source::ReadSourceFile(path);
  if (!bytes) return Fail(bytes.error().message);
  return ParseAnyMesh(path, *bytes);
}

Result<MeshTriangles> ParseAnyMesh(const std::string& name, const std::string& bytes) {
  std::string extension = std::filesystem::path(name).extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".stl") return ParseMesh(name, bytes);
  // Nodes of a scene stand where their parents put them, and faces may have more than three
  // corners.
  constexpr unsigned kFlags = aiProcess_Triangulate | aiProcess_PreTransformVertices;
  if (extension == ".obj") {
    if (const std::string excess = ExcessOfNumbers(bytes); !excess.empty()) {
      return Fail("mesh '" + name + "' " + excess);
    }
    return ParseAs("obj", kFlags, name, GeometryOf(bytes));
  }
  if (extension == ".gltf" || extension == ".glb") {
    std::string excess = ExcessOfText(bytes);
    // The library goes by the first bytes and not by the name.
    if (excess.empty() && bytes.starts_with("glTF")) excess = ExcessOfParts(bytes);
    if (!excess.empty()) return Fail("mesh '" + name + "' " + excess);
    return ParseAs(extension.substr(1), kFlags, name, bytes);
  }
  return Fail("mesh '" + name + "': its name ends in none of .stl, .obj, .gltf and .glb");
}

Result<std::vector<Eigen::Vector3d>> MeshHull(const std::string& name, const std::string& bytes) {
  Result<MeshTriangles> mesh = ParseMesh(name, bytes);
  if (!mesh) return Fail(mesh.error().message);
  // The order does not depend on that of the triangles.
  std::vector<Eigen::Vector3d>& points = mesh->points;
  std::sort(points.begin(), points.end(), [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  return model::ComputeHull(points).vertices;
}

}  // namespace morphbus::m3l
