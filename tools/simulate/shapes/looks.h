// Materials that the generators share, with colours from palettes of real materials.
#pragma once

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::shapes {

/// Returns a texture with one of a few seeds, so that hundreds of objects share tens of textures.
/// The top byte of `look_seed` selects the look set; sets share no texture.
std::shared_ptr<const Texture> sharedTexture(TextureKind kind, std::uint64_t look_seed, Dice& dice,
                                             int size = 256);

Material plain(const Eigen::Vector3f& colour, float gloss = 0.0F);
Material textured(const Eigen::Vector3f& tint, std::shared_ptr<const Texture> texture,
                  float gloss = 0.0F);
Material glass(Dice& dice);
Material rubber();
Material chrome();
Eigen::Vector3f paintColour(Dice& dice);
Eigen::Vector3f clothColour(Dice& dice);
Eigen::Vector3f woodColour(Dice& dice);
Eigen::Vector3f skinColour(Dice& dice);
Eigen::Vector3f plasterColour(Dice& dice);

}  // namespace perdure::tools::shapes
