#include "tools/simulate/shapes/vehicles/vehicle_body.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace perdure::tools::shapes {
namespace {

constexpr std::size_t kHalf = 9;               // points from the keel to the roof's middle
constexpr std::size_t kAll = 2 * (kHalf - 1);  // points of a whole ring
constexpr float kSeam = 0.0022F;               // share of the length

class Body {
 public:
  Body(MeshBuilder& builder, const BodyProfile& profile, const Vec3& size, const BodyMaterials& m)
      : b_(builder), p_(profile), size_(size), m_(m) {}

  void add() {
    const std::vector<float> stations = stationsOf();
    std::vector<Ring> rings;
    for (float x : stations) rings.push_back(ringAt(x));
    b_.begin(32.0F);
    b_.skin(rings, [&](std::size_t i, std::size_t k) {
      return materialAt((stations[i] + stations[i + 1]) / 2.0F, stations[i + 1] - stations[i],
                        k < kHalf - 1 ? k : kAll - 1 - k);
    });
    end(rings.front(), true);
    end(rings.back(), false);
    b_.closed();
    plates();
  }

 private:
  std::vector<float> stationsOf() const {
    std::vector<float> xs{0.0F, 0.012F, 0.035F, 0.95F, 0.975F, 0.99F, 1.0F};
    for (const Vec2& v : p_.top) xs.push_back(v.x());
    for (const Span& s : p_.side_glass) xs.insert(xs.end(), {s.from, s.to});
    for (const Span& s : {p_.windscreen, p_.rear_glass}) xs.insert(xs.end(), {s.from, s.to});
    for (float x : p_.seams) xs.insert(xs.end(), {x - kSeam / 2.0F, x + kSeam / 2.0F});
    for (float axle : {p_.front_axle, p_.rear_axle}) {
      for (float c : {1.0F, 0.85F, 0.45F}) {
        const float reach = c * archRadius() / size_.x();
        xs.insert(xs.end(), {axle - reach, axle + reach});
      }
      const float outside = 1.02F * archRadius() / size_.x();
      xs.insert(xs.end(), {axle, axle - outside, axle + outside});
    }
    std::erase_if(xs, [](float x) { return x < 0.0F || x > 1.0F; });
    std::ranges::sort(xs);
    // Merges stations that are closer than a few millimetres; seams are wider.
    xs.erase(std::unique(xs.begin(), xs.end(), [](float a, float c) { return c - a < 1.2e-3F; }),
             xs.end());
    return xs;
  }

  float archRadius() const { return 1.16F * p_.wheel_radius * size_.z(); }

  /// Height of the underside in metres: the sill, or the arch over a wheel.
  float undersideAt(float x, bool& in_arch) const {
    const float sill = p_.sill * size_.z(), radius = archRadius();
    in_arch = false;
    for (float axle : {p_.front_axle, p_.rear_axle}) {
      const float d = (x - axle) * size_.x();
      if (std::abs(d) > radius * 1.001F) continue;
      in_arch = true;
      return p_.wheel_radius * size_.z() + std::sqrt(std::max(0.0F, radius * radius - d * d));
    }
    const float lift = std::max(smooth(0.06F - x, 0.06F), smooth(x - 0.95F, 0.05F));
    return sill + 0.05F * size_.z() * lift;
  }
  static float smooth(float x, float width) {
    const float s = std::clamp(x / width, 0.0F, 1.0F);
    return s * s;
  }

  float halfWidthAt(float x) const {
    const float front = std::clamp(1.0F - x * size_.x() / 0.5F, 0.0F, 1.0F);
    const float rear = std::clamp(1.0F - (1.0F - x) * size_.x() / 0.35F, 0.0F, 1.0F);
    return size_.y() / 2.0F * (1.0F - p_.nose_taper * front * front - p_.tail_taper * rear * rear);
  }

  Ring ringAt(float x) const {
    const float h = size_.z(), w = halfWidthAt(x), zt = lineAt(p_.top, x) * h;
    bool arch = false;
    const float zb = undersideAt(x, arch);
    const float belt = std::min(lineAt(p_.belt, x) * h, zt - 0.035F * h);
    const float lip = zb + (arch ? 0.015F : 0.05F) * h;
    const float middle = std::max(lip + 0.02F * h, p_.sill * h + 0.62F * (belt - p_.sill * h));
    const float cabin = std::clamp((zt - belt) / (0.3F * h) - 0.12F, 0.0F, 1.0F);
    const float roof = p_.roof_width * w;
    const auto blend = [&](const Vec2& low, const Vec2& high) {
      return Vec2(low + cabin * (high - low));
    };
    const std::array<Vec2, kHalf> half{{
        {0.0F, zb},
        {(arch ? 0.9F : 0.88F) * w, zb},
        {0.985F * w, lip},
        {w, middle},
        {0.985F * w, std::max(belt, middle + 0.01F * h)},
        {0.945F * w, std::max(belt, middle + 0.01F * h) + 0.018F * h},
        blend({0.86F * w, zt - 0.006F * h}, {roof, zt - 0.055F * h}),
        blend({0.72F * w, zt}, {0.9F * roof, zt - 0.014F * h}),
        {0.0F, zt + 0.01F * h},
    }};
    Ring ring;
    const float along = (0.5F - x) * size_.x();
    for (std::size_t i = 0; i < kHalf; ++i) ring.emplace_back(along, half[i].x(), half[i].y());
    for (std::size_t i = kHalf - 2; i > 0; --i) ring.emplace_back(along, -half[i].x(), half[i].y());
    return ring;
  }

  int materialAt(float x, float width, std::size_t segment) const {
    if (segment == 0) return m_.dark;
    if (segment == 1) return m_.trim;
    const bool seam = width < 1.2F * kSeam && std::ranges::any_of(p_.seams, [&](float s) {
                        return std::abs(s - x) < kSeam;
                      });
    if (seam && segment < 5) return m_.dark;
    if (segment == 3 && x < 0.035F) return m_.headlight;
    if (segment == 3 && x > 0.975F) return m_.taillight;
    if (segment == 5) {
      for (const Span& s : p_.side_glass) {
        if (s.holds(x)) return m_.glass;
      }
    }
    if (segment == 7 && (p_.windscreen.holds(x) || p_.rear_glass.holds(x))) return m_.glass;
    return m_.paint;
  }

  int endMaterial(bool front, std::size_t strip, std::size_t column) const {
    const bool outer = column != 1;
    if (strip <= 1) return m_.trim;
    if (front && strip == 2) return outer || !p_.split_grille ? m_.paint : m_.dark;
    if (strip == 3)
      return outer ? (front ? m_.headlight : m_.taillight) : front ? m_.dark : m_.paint;
    if (!front && strip == 5 && p_.rear_doors_with_glass && !outer) return m_.glass;
    return m_.paint;
  }

  /// Adds a flat end, in strips between both flanks and in three columns.
  void end(const Ring& ring, bool front) {
    constexpr std::array<float, 4> kColumns{0.0F, 0.2F, 0.8F, 1.0F};
    const auto at = [&](std::size_t i, std::size_t column) {
      const Vec3 &left = ring[i], &right = ring[(kAll - i) % kAll];
      return Vec3(left + kColumns[column] * (right - left));
    };
    for (std::size_t i = 0; i + 1 < kHalf; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const int m = endMaterial(front, i, c);
        const Vec3 a = at(i, c), b = at(i + 1, c), d = at(i, c + 1), e = at(i + 1, c + 1);
        if (front) {
          b_.quad(b, a, d, e, m);
        } else {
          b_.quad(a, b, e, d, m);
        }
      }
    }
  }

  void plates() {
    const float z = 0.3F * size_.z(), half = 0.14F * size_.y(), tall = 0.035F * size_.z();
    const float front = 0.5F * size_.x(), thick = 0.006F * size_.x();
    b_.box({front - thick, -half, z - tall}, {front + thick / 2.0F, half, z + tall}, m_.plate);
    const float rear_z = 0.42F * size_.z();
    b_.box({-front - thick / 2.0F, -half, rear_z - tall}, {-front + thick, half, rear_z + tall},
           m_.plate);
  }

  MeshBuilder& b_;
  const BodyProfile& p_;
  Vec3 size_;
  BodyMaterials m_;
};

}  // namespace

float lineAt(const std::vector<Vec2>& points, float x) {
  if (x <= points.front().x()) return points.front().y();
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (x > points[i].x()) continue;
    const float s = (x - points[i - 1].x()) / (points[i].x() - points[i - 1].x());
    return points[i - 1].y() + s * (points[i].y() - points[i - 1].y());
  }
  return points.back().y();
}

void addBody(MeshBuilder& builder, const BodyProfile& profile, const Vec3& size,
             const BodyMaterials& materials) {
  Body(builder, profile, size, materials).add();
}

}  // namespace perdure::tools::shapes
