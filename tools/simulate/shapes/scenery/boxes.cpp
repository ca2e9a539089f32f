#include <algorithm>
#include <cmath>

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"

namespace perdure::tools::shapes {
namespace {

int wallSkin(MeshBuilder& b, const Order& order, Dice& dice) {
  if (dice.chance(0.4F)) {
    return b.material(
        textured(Vec3::Ones(), sharedTexture(TextureKind::kBrick, order.look_seed, dice, 512)),
        1.25F);
  }
  return b.material(textured(plasterColour(dice),
                             sharedTexture(TextureKind::kPlaster, order.look_seed, dice, 512)),
                    2.2F);
}

/// Adds pictures on both broad sides of a wall if it is as high as a room.
void addPictures(MeshBuilder& b, const Order& order, const Vec3& s, float depth, Dice& dice) {
  const bool along_x = s.x() > s.y();
  const float length = along_x ? s.x() : s.y();
  const int frame = b.material(plain(0.4F * woodColour(dice), 0.2F));
  const int count = std::min(8, static_cast<int>(length / 1.6F));
  for (int i = 0; i < 2 * count; ++i) {
    if (dice.chance(0.3F)) continue;
    const int picture = b.material(textured(
        Vec3::Constant(0.9F), sharedTexture(TextureKind::kPainting, order.look_seed, dice, 128)));
    const float u = length * ((static_cast<float>(i % count) + dice.uniform(0.3F, 0.7F)) /
                                  static_cast<float>(count) -
                              0.5F);
    const float z = dice.uniform(-0.05F, 0.25F), wide = dice.uniform(0.15F, 0.4F),
                tall = dice.uniform(0.15F, 0.35F);
    const float turn = (along_x ? 0.0F : 0.5F) + (i < count ? 0.0F : 1.0F);
    b.placing = Eigen::AngleAxisf(turn * 3.14159265F, Vec3::UnitZ());
    const float y = -0.5F * (along_x ? s.y() : s.x());
    b.box({u - wide, y, z - tall}, {u + wide, y + depth + 0.01F, z + tall}, frame);
    b.begin();
    b.picture({u - 0.9F * wide, y - 0.001F, z - 0.9F * tall},
              {u + 0.9F * wide, y - 0.001F, z - 0.9F * tall},
              {u + 0.9F * wide, y - 0.001F, z + 0.9F * tall},
              {u - 0.9F * wide, y - 0.001F, z + 0.9F * tall}, picture);
  }
  b.placing.setIdentity();
}

}  // namespace

Mesh makeWall(const Order& order) {
  Dice dice(order.look_seed ^ 0x3A11ULL);
  MeshBuilder b;
  const Vec3 s = order.size.cast<float>(), half = s / 2.0F;
  const int skin = wallSkin(b, order, dice);
  const int trim =
      b.material(textured(Vec3::Constant(dice.uniform(0.4F, 0.8F)),
                          sharedTexture(TextureKind::kPlaster, order.look_seed, dice, 256)),
                 1.1F);
  const float in = std::min(0.03F, 0.2F * std::min(s.x(), s.y()));
  b.box({-half.x() + in, -half.y() + in, -half.z()},
        {half.x() - in, half.y() - in, half.z() - 0.02F}, skin);
  if (s.z() > 2.1F) {  // wall of a room: add skirting and pictures
    b.box({-half.x() + 0.5F * in, -half.y() + 0.5F * in, -half.z()},
          {half.x() - 0.5F * in, half.y() - 0.5F * in, -half.z() + 0.1F}, trim);
    addPictures(b, order, s, in, dice);
    return b.finish(order.size);
  }
  b.box({-half.x(), -half.y(), half.z() - 0.08F}, half, trim);
  return b.finish(order.size);
}

Mesh makeKerb(const Order& order) {
  Dice dice(order.look_seed ^ 0x4E5BULL);
  MeshBuilder b;
  const Vec3 s = order.size.cast<float>(), half = s / 2.0F;
  const auto texture = sharedTexture(TextureKind::kPlaster, order.look_seed, dice, 256);
  std::array<int, 3> stones{};
  for (int& m : stones)
    m = b.material(textured(Vec3::Constant(dice.uniform(0.3F, 0.55F)), texture), 0.9F);
  const bool along_x = s.x() > s.y();
  const float length = along_x ? s.x() : s.y();
  const int count = std::clamp(static_cast<int>(std::lround(length)), 1, 120);
  const float step = length / static_cast<float>(count);
  for (int i = 0; i < count; ++i) {
    const float from = -0.5F * length + step * static_cast<float>(i), to = from + 0.985F * step;
    const float end = i + 1 == count ? 0.5F * length : to;
    const Vec3 low = along_x ? Vec3(from, -half.y(), -half.z()) : Vec3(-half.x(), from, -half.z());
    const Vec3 high = along_x ? Vec3(end, half.y(), half.z()) : Vec3(half.x(), end, half.z());
    b.box(low, high, dice.pick(stones));
  }
  return b.finish(order.size);
}

Mesh makeFloor(const Order& order) {
  Dice dice(order.look_seed ^ 0xF100ULL);
  MeshBuilder b;
  const int kind = dice.below(3);
  const auto texture = sharedTexture(kind == 0   ? TextureKind::kWood
                                     : kind == 1 ? TextureKind::kTiles
                                                 : TextureKind::kFabric,
                                     order.look_seed, dice, 512);
  const Vec3 tint = kind == 2 ? clothColour(dice) : Vec3(Vec3::Ones());
  const int m =
      b.material(textured(tint, texture, kind == 2 ? 0.0F : 0.2F), kind == 2 ? 1.6F : 1.4F);
  const Vec3 half = order.size.cast<float>() / 2.0F;
  b.box(-half, half, m);
  return b.finish(order.size);
}

Mesh makeCrate(const Order& order) {
  Dice dice(order.look_seed ^ 0xC3A7EULL);
  MeshBuilder b;
  const Vec3 half = order.size.cast<float>() / 2.0F;
  const auto wood = sharedTexture(TextureKind::kWood, order.look_seed, dice, 256);
  const int boards = b.material(textured(woodColour(dice), wood), 0.9F);
  const int battens = b.material(textured(woodColour(dice), wood), 0.7F);
  const float t = 0.05F * half.minCoeff();
  const float wide = 0.24F * half.minCoeff();
  b.box(-half + Vec3::Constant(t), half - Vec3::Constant(t), boards);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (float i : {1.0F, -1.0F}) {
      for (float j : {1.0F, -1.0F}) {
        Vec3 a = -half, c = half;
        a[u] = i > 0.0F ? half[u] - wide : -half[u];
        c[u] = a[u] + wide;
        a[v] = j > 0.0F ? half[v] - wide : -half[v];
        c[v] = a[v] + wide;
        b.box(a, c, battens);
      }
    }
  }
  return b.finish(order.size);
}

Mesh makeShelf(const Order& order) {
  Dice dice(order.look_seed ^ 0x5E1FULL);
  MeshBuilder b;
  const Vec3 s = order.size.cast<float>(), half = s / 2.0F;
  const auto wood = sharedTexture(TextureKind::kTimber, order.look_seed, dice, 256);
  const int boards = b.material(textured(woodColour(dice), wood, 0.1F), 1.1F);
  const int paper = b.material(plain({0.6F, 0.57F, 0.5F}));
  // Books are along the longer side and visible from both sides.
  const bool turned = s.x() > s.y();
  const float length = turned ? s.x() : s.y(), depth = turned ? s.y() : s.x();
  b.placing = Eigen::AngleAxisf(turned ? 1.57079633F : 0.0F, Vec3::UnitZ());
  const float x = depth / 2.0F, y = length / 2.0F, board = 0.024F;
  for (float side : {-y, y - board})
    b.box({-x, side, -half.z()}, {x, side + board, half.z()}, boards);
  const int levels = std::max(1, static_cast<int>(std::lround(s.z() / 0.36F)));
  const float step = (s.z() - board) / static_cast<float>(levels);
  for (int i = 0; i <= levels; ++i) {
    const float z = -half.z() + step * static_cast<float>(i);
    b.box({-x, -y, z}, {x, y, z + board}, boards);
    if (i == levels) break;
    const int books = b.material(
        textured(Vec3::Ones(), sharedTexture(TextureKind::kBooks, order.look_seed, dice, 256)));
    const float from = -y + board + 0.01F,
                to = from + (length - 2.0F * board - 0.02F) * dice.uniform(0.6F, 1.0F);
    const float low = z + board, high = z + board + (step - board) * dice.uniform(0.7F, 0.92F),
                deep = 0.75F * x;
    const Vec2 repeats((to - from) / 1.0F, 0.98F);
    b.begin();
    b.picture({deep, from, low}, {deep, to, low}, {deep, to, high}, {deep, from, high}, books,
              repeats);
    b.picture({-deep, to, low}, {-deep, from, low}, {-deep, from, high}, {-deep, to, high}, books,
              repeats);
    b.quad({-deep, from, low}, {deep, from, low}, {deep, from, high}, {-deep, from, high}, boards);
    b.quad({deep, to, low}, {-deep, to, low}, {-deep, to, high}, {deep, to, high}, boards);
    b.quad({deep, from, high}, {deep, to, high}, {-deep, to, high}, {-deep, from, high}, paper);
  }
  b.placing.setIdentity();
  return b.finish(order.size);
}

}  // namespace perdure::tools::shapes
