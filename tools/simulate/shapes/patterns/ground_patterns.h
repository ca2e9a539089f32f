// Textures of grounds, roads, floors and wood.
#pragma once

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/patterns/pattern.h"

namespace perdure::tools::shapes {

Pattern asphaltPattern(Dice& dice);
Pattern pavingPattern(Dice& dice);
Pattern grassPattern(Dice& dice);
Pattern earthPattern(Dice& dice);
Pattern tilesPattern(Dice& dice);
Pattern markingsPattern(Dice& dice);
Pattern woodPattern(Dice& dice);
Pattern timberPattern(Dice& dice);

}  // namespace perdure::tools::shapes
