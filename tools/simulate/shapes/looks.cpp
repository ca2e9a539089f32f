#include "tools/simulate/shapes/looks.h"

#include <utility>

namespace perdure::tools::shapes {
namespace {

using Eigen::Vector3f;

constexpr std::uint64_t kPicturesOfAKind = 12;

Vector3f varied(const Vector3f& colour, Dice& dice, float amount) {
  const float light = dice.uniform(1.0F - amount, 1.0F + amount);
  return (colour * light).cwiseMin(0.95F);
}

}  // namespace

std::shared_ptr<const Texture> sharedTexture(TextureKind kind, std::uint64_t look_seed, Dice& dice,
                                             int size) {
  const std::uint64_t set = look_seed >> 56U;
  return makeTexture(kind, set * kPicturesOfAKind + dice.seed() % kPicturesOfAKind, size);
}

Material plain(const Vector3f& colour, float gloss) {
  Material m;
  m.colour = colour;
  m.gloss = gloss;
  return m;
}

Material textured(const Vector3f& tint, std::shared_ptr<const Texture> texture, float gloss) {
  Material m = plain(tint, gloss);
  m.texture = std::move(texture);
  return m;
}

Material glass(Dice& dice) {
  const float tint = dice.uniform(0.012F, 0.05F);
  return plain({tint, tint * 1.08F, tint * 1.12F}, 0.9F);
}
Material rubber() { return plain({0.018F, 0.018F, 0.019F}, 0.04F); }
Material chrome() { return plain({0.55F, 0.56F, 0.58F}, 0.7F); }

Vector3f paintColour(Dice& dice) {
  static const std::array<Vector3f, 14> kPaints{{{0.72F, 0.72F, 0.71F},
                                                 {0.8F, 0.8F, 0.79F},
                                                 {0.02F, 0.02F, 0.022F},
                                                 {0.05F, 0.05F, 0.055F},
                                                 {0.4F, 0.41F, 0.42F},
                                                 {0.22F, 0.23F, 0.24F},
                                                 {0.5F, 0.02F, 0.02F},
                                                 {0.3F, 0.01F, 0.015F},
                                                 {0.02F, 0.06F, 0.28F},
                                                 {0.05F, 0.16F, 0.42F},
                                                 {0.02F, 0.12F, 0.06F},
                                                 {0.42F, 0.33F, 0.2F},
                                                 {0.75F, 0.42F, 0.03F},
                                                 {0.12F, 0.3F, 0.36F}}};
  return varied(dice.pick(kPaints), dice, 0.2F);
}

Vector3f clothColour(Dice& dice) {
  static const std::array<Vector3f, 14> kCloths{{{0.03F, 0.04F, 0.09F},
                                                 {0.02F, 0.02F, 0.02F},
                                                 {0.45F, 0.43F, 0.4F},
                                                 {0.7F, 0.68F, 0.65F},
                                                 {0.4F, 0.04F, 0.04F},
                                                 {0.06F, 0.2F, 0.09F},
                                                 {0.1F, 0.2F, 0.45F},
                                                 {0.32F, 0.22F, 0.12F},
                                                 {0.65F, 0.5F, 0.1F},
                                                 {0.25F, 0.06F, 0.22F},
                                                 {0.08F, 0.28F, 0.3F},
                                                 {0.7F, 0.28F, 0.08F},
                                                 {0.14F, 0.14F, 0.15F},
                                                 {0.5F, 0.3F, 0.32F}}};
  return varied(dice.pick(kCloths), dice, 0.3F);
}

Vector3f woodColour(Dice& dice) {
  static const std::array<Vector3f, 5> kWoods{{{1.0F, 0.95F, 0.9F},
                                               {0.75F, 0.65F, 0.55F},
                                               {0.5F, 0.38F, 0.3F},
                                               {0.95F, 0.8F, 0.6F},
                                               {0.3F, 0.22F, 0.2F}}};
  return varied(dice.pick(kWoods), dice, 0.15F);
}

Vector3f skinColour(Dice& dice) {
  static const std::array<Vector3f, 5> kSkins{{{0.72F, 0.47F, 0.36F},
                                               {0.6F, 0.36F, 0.25F},
                                               {0.4F, 0.22F, 0.14F},
                                               {0.22F, 0.11F, 0.07F},
                                               {0.78F, 0.55F, 0.44F}}};
  return varied(dice.pick(kSkins), dice, 0.1F);
}

Vector3f plasterColour(Dice& dice) {
  static const std::array<Vector3f, 8> kPlasters{{{0.85F, 0.82F, 0.74F},
                                                  {0.8F, 0.66F, 0.45F},
                                                  {0.72F, 0.5F, 0.4F},
                                                  {0.6F, 0.62F, 0.62F},
                                                  {0.9F, 0.88F, 0.85F},
                                                  {0.55F, 0.6F, 0.52F},
                                                  {0.62F, 0.42F, 0.34F},
                                                  {0.5F, 0.56F, 0.66F}}};
  return varied(dice.pick(kPlasters), dice, 0.12F);
}

}  // namespace perdure::tools::shapes
