#include <algorithm>
#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"

namespace perdure::tools {
namespace {

using namespace shapes;

// Layers are a few millimetres apart, so that the upper one hides the lower ones; the road is at z
// = 0.
constexpr float kGrassZ = -0.01F, kPavementZ = -0.005F, kRoadZ = 0.0F, kPatchZ = 0.002F,
                kSpotZ = 0.004F, kMarkingZ = 0.006F;
constexpr float kPavement = 3.4F;  // width beside the road, metres

Eigen::AlignedBox2f extentOf(const sim::Scene& scene, float margin) {
  Eigen::AlignedBox2f box;
  const auto add = [&](double x, double y) {
    box.extend(Vec2(static_cast<float>(x), static_cast<float>(y)));
  };
  for (const sim::Road& road : scene.roads) {
    add(road.from.x(), road.from.y());
    add(road.to.x(), road.to.y());
  }
  for (const sim::Prop& prop : scene.props) add(prop.T_WP.p.x(), prop.T_WP.p.y());
  for (const sim::SceneObject& object : scene.objects) {
    const Eigen::Vector3d p = object.motion.poseAt(0.0).p;
    add(p.x(), p.y());
  }
  for (double t = 0.0; t <= scene.seconds; t += 1.0) {
    const Eigen::Vector3d p = scene.body.poseAt(t).p;
    add(p.x(), p.y());
  }
  if (box.isEmpty()) add(0.0, 0.0);
  return Eigen::AlignedBox2f(box.min() - Vec2::Constant(margin),
                             box.max() + Vec2::Constant(margin));
}

void addPlane(MeshBuilder& b, const Eigen::AlignedBox2f& box, float z, int material) {
  b.begin();
  b.quad({box.min().x(), box.min().y(), z}, {box.max().x(), box.min().y(), z},
         {box.max().x(), box.max().y(), z}, {box.min().x(), box.max().y(), z}, material);
}

/// Coordinates of a road: along it, and to its left.
struct Lane {
  Vec2 from, along, left;
  float length, half;

  explicit Lane(const sim::Road& road)
      : from(road.from.cast<float>()),
        along((road.to - road.from).normalized().cast<float>()),
        left(-along.y(), along.x()),
        length(static_cast<float>((road.to - road.from).norm())),
        half(static_cast<float>(road.width_m) / 2.0F) {}
  Vec3 at(float s, float t, float z) const {
    const Vec2 p = from + s * along + t * left;
    return {p.x(), p.y(), z};
  }
  bool holds(const Vec2& p, float margin) const {
    const float s = (p - from).dot(along), t = (p - from).dot(left);
    return s > -half - margin && s < length + half + margin && std::abs(t) < half + margin;
  }
};

class Street {
 public:
  Street(const sim::Scene& scene, MeshBuilder& b)
      : scene_(scene), b_(b), dice_(scene.seed ^ 0x57EE7ULL) {
    for (const sim::Road& road : scene.roads) {
      if ((road.to - road.from).norm() > 1.0) lanes_.emplace_back(road);
    }
    // The top byte of every look selects the look set; the ground uses the set of its objects.
    look_ = !scene.objects.empty() ? scene.objects.front().look_seed
            : !scene.props.empty() ? scene.props.front().look_seed
                                   : scene.seed;
  }

  void add() {
    const auto picture = [&](TextureKind kind, int size) {
      return sharedTexture(kind, look_, dice_, size);
    };
    const int grass = b_.material(textured(Vec3::Ones(), picture(TextureKind::kGrass, 512)), 2.6F);
    const int paving =
        b_.material(textured(Vec3::Ones(), picture(TextureKind::kPaving, 512)), 2.4F);
    const auto tar = picture(TextureKind::kAsphalt, 1024);
    const int asphalt = b_.material(textured(Vec3::Ones(), tar), 5.0F);
    patch_ = {b_.material(textured(Vec3::Constant(0.62F), tar), 3.7F),
              b_.material(textured(Vec3::Constant(1.35F), tar), 4.3F)};
    crack_ = b_.material(plain({0.02F, 0.02F, 0.02F}));
    stain_ = b_.material(textured(Vec3(0.4F, 0.38F, 0.36F), tar), 5.0F);
    iron_ =
        b_.material(textured(Vec3(0.16F, 0.14F, 0.12F), picture(TextureKind::kTiles, 256)), 0.5F);
    rim_ = b_.material(plain({0.05F, 0.05F, 0.05F}));
    white_ =
        b_.material(textured(Vec3(0.8F, 0.8F, 0.78F), picture(TextureKind::kMarkings, 256)), 1.7F);
    addPlane(b_, extentOf(scene_, 120.0F), kGrassZ, grass);
    b_.begin();
    for (const Lane& lane : lanes_)
      strip(lane, -kPavement, lane.length + kPavement, -lane.half - kPavement,
            lane.half + kPavement, kPavementZ, paving);
    for (const Lane& lane : lanes_)
      strip(lane, -lane.half, lane.length + lane.half, -lane.half, lane.half, kRoadZ, asphalt);
    for (const Lane& lane : lanes_) {
      markings(lane);
      details(lane);
    }
  }

 private:
  void strip(const Lane& lane, float s0, float s1, float t0, float t1, float z, int material) {
    b_.quad(lane.at(s0, t0, z), lane.at(s1, t0, z), lane.at(s1, t1, z), lane.at(s0, t1, z),
            material);
  }

  bool crossing(const Lane& own, float s, float t) const {
    const Vec3 p = own.at(s, t, 0.0F);
    return std::ranges::any_of(lanes_, [&](const Lane& other) {
      return &other != &own && other.holds({p.x(), p.y()}, 0.3F);
    });
  }

  void markings(const Lane& lane) {
    constexpr float kDash = 3.0F, kPeriod = 7.5F, kEdgePiece = 2.0F;
    for (float s = 1.0F; s + kDash < lane.length; s += kPeriod) {
      if (crossing(lane, s, 0.0F) || crossing(lane, s + kDash, 0.0F)) continue;
      strip(lane, s, s + kDash, -0.07F, 0.07F, kMarkingZ, white_);
    }
    for (float side : {1.0F, -1.0F}) {
      const float t = side * (lane.half - 0.25F);
      for (float s = 0.0F; s < lane.length; s += kEdgePiece) {
        const float end = std::min(s + kEdgePiece, lane.length);
        if (crossing(lane, s, t) || crossing(lane, end, t)) continue;
        strip(lane, s, end, t - 0.06F, t + 0.06F, kMarkingZ, white_);
      }
    }
  }

  void details(const Lane& lane) {
    const int count = static_cast<int>(lane.length / 3.0F);
    for (int i = 0; i < count; ++i) {
      const float s = 3.0F * (static_cast<float>(i) + dice_.uniform(0.0F, 1.0F));
      const float t = dice_.uniform(-0.85F, 0.85F) * lane.half;
      const int kind = dice_.below(10);
      if (kind < 2) patch(lane, s, t);
      if (kind >= 2 && kind < 6) crack(lane, s, t);
      if (kind >= 6 && kind < 9) stain(lane, s, t);
      if (kind == 9) manhole(lane, s, t);
    }
  }

  void patch(const Lane& lane, float s, float t) {
    const float length = dice_.uniform(0.8F, 4.0F), half = dice_.uniform(0.3F, 0.9F);
    const float low = std::max(t - half, -lane.half), high = std::min(t + half, lane.half);
    strip(lane, s - 0.03F, s + length + 0.03F, low - 0.03F, high + 0.03F, 0.5F * kPatchZ, rim_);
    strip(lane, s, s + length, low, high, kPatchZ, dice_.pick(patch_));
  }

  void crack(const Lane& lane, float s, float t) {
    float heading = dice_.uniform(-kPi, kPi);
    Vec2 at(s, t);
    const int pieces = 4 + dice_.below(8);
    float width = dice_.uniform(0.008F, 0.022F);
    for (int i = 0; i < pieces; ++i) {
      heading += dice_.uniform(-0.6F, 0.6F);
      const Vec2 way(std::cos(heading), std::sin(heading)), side = width * Vec2(-way.y(), way.x());
      const Vec2 next = at + dice_.uniform(0.15F, 0.5F) * way;
      if (std::abs(next.y()) > lane.half) return;
      const auto point = [&](const Vec2& p) { return lane.at(p.x(), p.y(), kSpotZ); };
      b_.quad(point(at - side), point(next - 0.8F * side), point(next + 0.8F * side),
              point(at + side), crack_);
      at = next;
      width *= 0.9F;
    }
  }

  void blob(const Vec3& centre, float radius, float rough, int sides, int material) {
    Ring ring = circle(centre, Vec3::UnitZ(), radius, sides, dice_.uniform(0.0F, kPi));
    for (Vec3& p : ring) p = centre + (p - centre) * dice_.uniform(1.0F - rough, 1.0F + rough);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      b_.triangle(centre, ring[i], ring[(i + 1) % ring.size()], material);
    }
  }

  void stain(const Lane& lane, float s, float t) {
    blob(lane.at(s, t, kSpotZ), dice_.uniform(0.08F, 0.45F), 0.4F, 11, stain_);
  }

  void manhole(const Lane& lane, float s, float t) {
    blob(lane.at(s, t, kSpotZ), 0.36F, 0.0F, 20, rim_);
    blob(lane.at(s, t, kSpotZ + 0.001F), 0.31F, 0.0F, 20, iron_);
  }

  const sim::Scene& scene_;
  MeshBuilder& b_;
  Dice dice_;
  std::uint64_t look_ = 0;
  std::vector<Lane> lanes_;
  std::array<int, 2> patch_{};
  int crack_ = 0, stain_ = 0, iron_ = 0, rim_ = 0, white_ = 0;
};

void addRoom(const sim::Scene& scene, MeshBuilder& b) {
  Dice dice(scene.seed ^ 0x4003ULL);
  const std::uint64_t look = scene.objects.empty() ? scene.seed : scene.objects.front().look_seed;
  const int kind = dice.below(3);
  const TextureKind texture = kind == 0   ? TextureKind::kWood
                              : kind == 1 ? TextureKind::kTiles
                                          : TextureKind::kFabric;
  const Vec3 tint = kind == 2 ? Vec3(1.3F * clothColour(dice).cwiseMin(0.6F)) : Vec3(Vec3::Ones());
  const int floor =
      b.material(textured(tint, sharedTexture(texture, look, dice, 1024), kind == 2 ? 0.0F : 0.25F),
                 kind == 0 ? 1.6F : 1.8F);
  addPlane(b, extentOf(scene, 6.0F), 0.0F, floor);
}

}  // namespace

Mesh makeGroundMesh(const sim::Scene& scene) {
  MeshBuilder b;
  if (scene.ground == sim::GroundKind::kRoom) {
    addRoom(scene, b);
  } else {
    Street(scene, b).add();
  }
  return b.finish({});
}

}  // namespace perdure::tools
