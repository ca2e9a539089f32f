// Textures of walls, plants, cloth, metal and screens.
#pragma once

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/patterns/pattern.h"

namespace perdure::tools::shapes {

Pattern brickPattern(Dice& dice);
Pattern plasterPattern(Dice& dice);
Pattern windowsPattern(Dice& dice);
Pattern barkPattern(Dice& dice);
Pattern leavesPattern(Dice& dice);
Pattern fabricPattern(Dice& dice);
Pattern metalPattern(Dice& dice);
Pattern carPaintPattern(Dice& dice);
Pattern screenPattern(Dice& dice);
Pattern skinPattern(Dice& dice);
Pattern booksPattern(Dice& dice);
Pattern signPattern(Dice& dice);
Pattern paintingPattern(Dice& dice);

}  // namespace perdure::tools::shapes
