
#include "tools/simulate/shapes/dice.h"
#include "tools/simulate/shapes/looks.h"
#include "tools/simulate/shapes/shapes.h"
#include "tools/simulate/shapes/vehicles/vehicle_body.h"
#include "tools/simulate/shapes/vehicles/vehicle_parts.h"

namespace perdure::tools::shapes {
namespace {

BodyProfile hatchback() {
  BodyProfile p;
  p.top = {{0.0F, 0.45F},  {0.035F, 0.51F}, {0.1F, 0.56F}, {0.25F, 0.64F},
           {0.42F, 0.94F}, {0.5F, 0.985F},  {0.62F, 1.0F}, {0.78F, 0.985F},
           {0.88F, 0.94F}, {0.975F, 0.66F}, {0.99F, 0.6F}, {1.0F, 0.5F}};
  p.belt = {{0.0F, 0.42F}, {0.1F, 0.5F}, {0.28F, 0.6F}, {0.9F, 0.65F}, {1.0F, 0.56F}};
  p.windscreen = {0.255F, 0.42F};
  p.rear_glass = {0.88F, 0.97F};
  p.side_glass = {{0.31F, 0.53F}, {0.55F, 0.75F}, {0.765F, 0.84F}};
  p.seams = {0.3F, 0.54F, 0.74F};
  p.front_axle = 0.185F;
  p.rear_axle = 0.825F;
  return p;
}

BodyProfile sedan() {
  BodyProfile p;
  p.top = {{0.0F, 0.44F},  {0.035F, 0.51F}, {0.1F, 0.57F},  {0.28F, 0.65F},
           {0.42F, 0.94F}, {0.5F, 0.99F},   {0.6F, 1.0F},   {0.69F, 0.96F},
           {0.84F, 0.7F},  {0.97F, 0.67F},  {0.99F, 0.62F}, {1.0F, 0.5F}};
  p.belt = {{0.0F, 0.42F}, {0.1F, 0.51F}, {0.3F, 0.61F}, {0.84F, 0.65F}, {1.0F, 0.57F}};
  p.windscreen = {0.285F, 0.42F};
  p.rear_glass = {0.69F, 0.83F};
  p.side_glass = {{0.34F, 0.52F}, {0.54F, 0.69F}, {0.7F, 0.745F}};
  p.seams = {0.31F, 0.53F, 0.71F};
  p.front_axle = 0.19F;
  p.rear_axle = 0.785F;
  p.sill = 0.16F;
  return p;
}

BodyProfile estate() {
  BodyProfile p = sedan();
  p.top = {{0.0F, 0.44F},  {0.035F, 0.51F}, {0.1F, 0.57F},  {0.27F, 0.65F},
           {0.41F, 0.94F}, {0.5F, 0.99F},   {0.62F, 1.0F},  {0.8F, 0.985F},
           {0.91F, 0.95F}, {0.98F, 0.68F},  {0.99F, 0.62F}, {1.0F, 0.5F}};
  p.windscreen = {0.275F, 0.41F};
  p.rear_glass = {0.915F, 0.975F};
  p.side_glass = {{0.33F, 0.51F}, {0.53F, 0.69F}, {0.71F, 0.88F}};
  p.seams = {0.3F, 0.52F, 0.7F};
  return p;
}

BodyProfile suv() {
  BodyProfile p;
  p.top = {{0.0F, 0.5F},   {0.025F, 0.56F}, {0.08F, 0.61F}, {0.25F, 0.66F},
           {0.39F, 0.94F}, {0.47F, 0.99F},  {0.62F, 1.0F},  {0.85F, 0.98F},
           {0.93F, 0.95F}, {0.98F, 0.68F},  {0.99F, 0.6F},  {1.0F, 0.5F}};
  p.belt = {{0.0F, 0.48F}, {0.08F, 0.57F}, {0.3F, 0.63F}, {0.9F, 0.67F}, {1.0F, 0.57F}};
  p.windscreen = {0.255F, 0.39F};
  p.rear_glass = {0.93F, 0.98F};
  p.side_glass = {{0.31F, 0.5F}, {0.52F, 0.71F}, {0.73F, 0.88F}};
  p.seams = {0.29F, 0.51F, 0.72F};
  p.wheel_radius = 0.22F;
  p.sill = 0.19F;
  p.roof_width = 0.8F;
  return p;
}

/// Varies cars of one kind: shifts the cabin, and raises or lowers roof and belt line.
void vary(BodyProfile& p, Dice& dice) {
  const float bonnet = dice.uniform(-0.03F, 0.03F), belt = dice.uniform(-0.02F, 0.02F);
  for (Vec2& v : p.top) {
    if (v.x() < 0.3F) v.y() += bonnet;
  }
  for (Vec2& v : p.belt) v.y() += v.x() < 0.2F ? bonnet : belt;
  p.roof_width += dice.uniform(-0.03F, 0.03F);
  p.wheel_radius *= dice.uniform(0.96F, 1.06F);
  p.nose_taper = dice.uniform(0.12F, 0.24F);
  p.split_grille = dice.chance(0.6F);
}

}  // namespace

Mesh makeCar(const Order& order) {
  Dice dice(order.look_seed ^ 0xCA5ULL);
  const std::string shape = chosenShape(order, "car", {"hatchback", "sedan", "estate", "suv"});
  BodyProfile profile = shape == "sedan"    ? sedan()
                        : shape == "estate" ? estate()
                        : shape == "suv"    ? suv()
                                            : hatchback();
  vary(profile, dice);
  MeshBuilder builder;
  addVehicle(builder, profile, order, dice, shape == "suv" && dice.chance(0.5F));
  return builder.finish(order.size);
}

}  // namespace perdure::tools::shapes
