// Materials that the generators share, with colours drawn from palettes of the real thing.
#pragma once

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::shapes {

/// A texture of one of a few seeds, so that a town of hundreds of things holds tens of pictures.
/// The top byte of the look's seed (the set of looks) keeps sets apart.
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
