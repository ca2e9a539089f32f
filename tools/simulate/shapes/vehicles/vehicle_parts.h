// Parts of every road vehicle besides its body: wheels, mirrors, handles, and all materials.
#pragma once

#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/mesh_builder.h"
#include "tools/simulate/shapes/shapes.h"
#include "tools/simulate/shapes/vehicles/vehicle_body.h"

namespace perdure::tools::shapes {

void addVehicle(MeshBuilder& builder, const BodyProfile& profile, const Order& order, Dice& dice,
                bool roof_rails);

}  // namespace perdure::tools::shapes
