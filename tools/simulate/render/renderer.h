// Renders the image of one camera: one ray through each pixel of the distorted image, shading, up
// to four additional rays at edges, and motion blur. The result is independent of the number of
// threads.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "tools/simulate/render/lens.h"
#include "tools/simulate/render/lighting.h"
#include "tools/simulate/render/workers.h"
#include "tools/simulate/render/world.h"

namespace perdure::tools {

inline constexpr int kTile = 32;  ///< pixels; side of the square that a task draws

/// Poses of a camera during one exposure. With a rolling shutter, the middle row is exposed at
/// `time_s`; the first and the last row half the readout before and after it. Objects have their
/// poses of `time_s`.
struct Shot {
  double time_s = 0.0;  ///< scene time at the middle of the exposure
  sim::MotionState body;
  RigidTransform T_BC;
  double exposure_s = 0.0, readout_s = 0.0;
};
Shot shotAt(const sim::Scene& scene, std::size_t camera, double time_s);

struct Picture {
  int width = 0, height = 0;
  std::vector<Eigen::Vector4f> radiance;  ///< linear RGB and padding, for vector instructions
  std::vector<std::uint32_t> instance;    ///< index at the pixel centre; see World::instances
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
};

class Renderer {
 public:
  /// Both arguments must outlive the renderer.
  Renderer(World& world, Workers& workers);

  /// Moves the world to the shot's time and renders it.
  void render(const Lens& lens, const Shot& shot, Picture& picture);
  /// Identifies the visible instances without shading, in each `step`-th pixel of each `step`-th
  /// row: picture.instance, with picture.width = ceil(lens.width() / step).
  void identify(const Lens& lens, const Shot& shot, int step, Picture& picture);

 private:
  struct Eye {
    Eigen::Matrix3f R;  ///< rotation of C in W
    Eigen::Vector3f p;
  };
  struct Packet {
    unsigned count = 0;
    std::array<Eigen::Vector3f, kPacket> origins, directions;
    std::array<Hit, kPacket> hits;
    std::array<bool, kPacket> in_sun;
  };
  struct Place {
    int column = 0, row = 0;
  };
  struct Samples {
    Packet packet;
    std::array<Place, kPacket> places;
    std::array<float, kPacket> shares{};
  };
  /// Data of a pixel besides its radiance.
  struct Detail {
    std::uint32_t key = 0;  ///< instance, material and whether the sun is visible
    float inverse_distance = 0.0F;
    Eigen::Vector3f normal;
  };

  void begin(const Lens& lens, const Shot& shot, Picture& picture, int step);
  void aim(Packet& packet, int column, int row, float dx, float dy) const;
  void follow(Packet& packet) const;
  void findSun(Packet& packet) const;
  void drawTile(int left, int top, Picture& picture);
  void drawBlock(Packet& packet, const Place* places, Picture& picture);
  /// One bit for each of the four neighbours beyond an edge that needs antialiasing.
  unsigned edgesOf(const Picture& picture, int column, int row) const;
  void smoothTile(int left, int top, Picture& picture);
  void addSamples(Samples& samples, Picture& picture) const;
  Eigen::Vector2f smear(const Picture& picture, int column, int row) const;
  void blurRow(int row, const Picture& picture);
  void forTiles(const Picture& picture, const std::function<void(int, int)>& task);

  World& world_;
  Workers& workers_;
  Lighting lighting_;
  const Lens* lens_ = nullptr;
  std::vector<Eye> eyes_;  ///< one for each row, or one for all
  Eigen::Matrix3f R_CW_;
  Eigen::Vector3f eye_velocity_C_, turn_rate_C_;
  float exposure_s_ = 0.0F;
  std::vector<Detail> details_;
  std::vector<Eigen::Vector4f> blurred_;
};

}  // namespace perdure::tools
