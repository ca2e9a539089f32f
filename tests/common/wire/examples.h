// Valid messages of every type with random content from a seed. For tests only.
#pragma once

#include <Eigen/Cholesky>
#include <random>

#include "common/wire/topics.h"

namespace perdure::wire {

class Examples {
 public:
  explicit Examples(unsigned seed) : random_(seed) {}

  double uniform(double low = -10, double high = 10) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::uint64_t bits() { return random_(); }
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
  bool coin() { return (random_() & 1) != 0; }
  TimePoint time() { return fromNanoseconds(static_cast<std::int64_t>(bits() >> 2)); }
  std::string word() {
    std::string text = "ä";
    for (std::uint32_t n = below(12); n > 0; --n) text += static_cast<char>('a' + below(26));
    return text;
  }
  template <class M>
  M matrix() {
    M m;
    for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = uniform();
    return m;
  }
  template <class M>
  M covariance() {
    const M a = matrix<M>();
    M P = a * a.transpose() + M::Identity();
    P = (0.5 * (P + P.transpose())).eval();
    return P;
  }
  Eigen::Vector3d unit() { return matrix<Eigen::Vector3d>().normalized(); }
  RigidTransform pose() {
    return {Eigen::Quaterniond(matrix<Eigen::Vector4d>().normalized()), matrix<Eigen::Vector3d>()};
  }
  FrameStamp stamp() { return {bits(), bits(), time(), static_cast<std::int64_t>(bits() >> 2)}; }
  WorldId world() { return {bits(), below(9)}; }
  Box box() {
    const double x = uniform(-50, 500), y = uniform(-50, 500);
    return {x, y, x + uniform(1, 99), y + uniform(1, 99)};
  }
  template <class Make>
  auto several(Make make) {
    std::vector<decltype(make())> list;
    for (std::uint32_t n = below(4); n > 0; --n) list.push_back(make());
    return list;
  }

  void fill(Frame& m) {
    m.stamp = stamp();
    m.camera = word();
    m.width = 1 + below(20);
    m.height = 1 + below(20);
    m.encoding = coin() ? ImageEncoding::kBgr8 : ImageEncoding::kMono8;
    std::vector<std::uint8_t> pixels(std::size_t{m.width} * m.height * channelsOf(m.encoding));
    for (auto& p : pixels) p = static_cast<std::uint8_t>(bits());
    m.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  }
  void fill(ImuSample& m) {
    m = {bits(), bits(), time(), matrix<Eigen::Vector3d>(), matrix<Eigen::Vector3d>()};
  }
  void fill(SpeedSample& m) { m = {bits(), bits(), time(), uniform(), uniform(0.1, 1)}; }
  CameraCalibration camera() {
    CameraCalibration c{
        word(),
        1 + below(2000),
        1 + below(2000),
        uniform(1, 900),
        uniform(1, 900),
        uniform(),
        uniform(),
        DistortionModel::kEquidistant,
        {},
        pose(),
        uniform(),
        uniform(),
        uniform(1, 60),
        {uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(0, 1)}};
    if (coin()) c.distortion = DistortionModel::kRational;
    while (c.distortion_coefficients.size() < coefficientsOf(c.distortion)) {
      c.distortion_coefficients.push_back(uniform(-1, 1));
    }
    return c;
  }
  void fill(Calibration& m) {
    m.source = bits();
    m.cameras = several([&] { return camera(); });
    if (coin()) m.imu = {uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(1, 9)};
    m.has_speed = coin();
    if (coin()) m.anchor = {time(), uniform(-80, 80), uniform(-80, 80), uniform(), uniform(-3, 3)};
  }
  void fill(Odometry& m) {
    m = {stamp(),
         bits(),
         world(),
         OdometryState::kDegraded,
         pose(),
         matrix<Eigen::Vector3d>(),
         covariance<Matrix9d>(),
         unit(),
         matrix<Eigen::Vector3d>(),
         matrix<Eigen::Vector3d>(),
         coin(),
         bits(),
         matrix<Matrix6d>(),
         covariance<Matrix6d>()};
  }
  Landmark landmark() {
    Landmark l{bits(),
               matrix<Eigen::Vector3d>(),
               covariance<Eigen::Matrix3d>(),
               matrix<Eigen::Matrix<double, 3, 6>>(),
               matrix<Eigen::Vector2d>(),
               {}};
    for (auto& byte : l.descriptor) byte = static_cast<std::uint8_t>(bits());
    return l;
  }
  void fill(Landmarks& m) {
    m = {stamp(), bits(), world(), word(), several([&] { return landmark(); })};
  }
  Detection detection() {
    Detection d{box(), several([&] { return static_cast<float>(uniform()); }),
                {},    uniform(0.1, 1),
                {},    coin()};
    for (double& sigma : d.side_sigma) sigma = uniform(0, 9);
    d.primed_for = bits();
    if (coin()) d.azimuth = uniform(-3, 3);
    return d;
  }
  void fill(Detections& m) {
    m = {stamp(),       word(),       bits(), bits(), several([&] { return detection(); }),
         uniform(0, 1), uniform(0, 1)};
  }
  void fill(ModelInfo& m) {
    m = {bits(),
         bits(),
         word(),
         several([&] { return word(); }),
         below(999),
         below(999),
         uniform(0, 1),
         {},
         coin()   ? BoxExtent::kOutline
         : coin() ? BoxExtent::kCuboid
                  : BoxExtent::kUnknown};
    for (std::size_t i = 0; i < 4 * m.classes.size(); ++i) {
      m.side_insets.push_back(uniform(-0.4, 0.4));
    }
  }
  LedgerEntry ledgerEntry() {
    const auto first = static_cast<std::int64_t>(bits() >> 3);
    return {uniform(), below(99), fromNanoseconds(first), fromNanoseconds(first + below(999))};
  }
  std::vector<double> nats() {
    return several([&] { return uniform(); });
  }
  Ledger ledger() {
    Ledger l;
    l.existence = several([&] { return ledgerEntry(); });
    l.classes = several([&] { return ClassLedger{word(), nats()}; });
    if (coin()) l.ousted = {OustedClass{word(), word(), time(), nats()}};
    return l;
  }
  ObjectBelief belief() {
    ObjectBelief b;
    b.id = 1 + below(99);
    b.existence = uniform(0, 1);
    b.confirmed = coin();
    const std::size_t n = 1 + below(3);
    for (std::size_t i = 0; i < n; ++i) {
      b.classes.push_back({word(), 1.0 / static_cast<double>(n), matrix<Vector7d>(),
                           covariance<Matrix7d>(), matrix<Eigen::Matrix<double, 7, 6>>()});
    }
    b.visibility = static_cast<Visibility>(below(5));
    b.visible_fraction = uniform(0, 1);
    b.blocked_by = bits();
    b.first_seen = time(), b.last_seen = time(), b.as_of = time();
    b.hits = below(99), b.visible_misses = below(99);
    b.moving = uniform(0, 1);
    b.velocity = matrix<Eigen::Vector3d>();
    b.memory = coin() ? Memory::kWorking : Memory::kLongTerm;
    b.recalled = coin();
    for (float& metres : b.seen_from) metres = static_cast<float>(below(99));
    b.why = ledger();
    b.track = coin() ? 1 + below(99) : 0;
    return b;
  }
  void fill(Objects& m) {
    m = {stamp(),
         bits(),
         world(),
         pose(),
         unit(),
         bits(),
         several([&] { return belief(); }),
         covariance<Matrix6d>(),
         bits(),
         bits(),
         uniform(0, 99),
         several([&] { return endedTrack(); }),
         several([&] { return belief(); })};
  }
  EndedTrack endedTrack() {
    const TrackId into = coin() ? 1 + below(99) : 0;
    return {into + 1 + below(99), into, time()};
  }
  void fill(ObjectState& m) { m = {stamp(), bits(), world(), belief()}; }
  void fill(Event& m) {
    m = {stamp(), bits(),        world(), static_cast<EventKind>(below(18)), bits(), bits(),
         word(),  uniform(0, 1), word()};
    for (double& seconds : m.returns_in_s) seconds = uniform(0, 9);
  }
  void fill(Predictions& m) {
    m = {stamp(), bits(), word(), several([&] {
           Prediction p{bits(), word(), box(), uniform(0, 1)};
           for (double& v : p.velocity) v = uniform(-99, 99);
           for (double& sigma : p.side_sigma) sigma = uniform(0, 9);
           return p;
         })};
  }
  MapObject mapObject() {
    return {1 + bits() / 2,
            world(),
            word(),
            uniform(0, 1),
            uniform(0, 1),
            matrix<Vector7d>(),
            covariance<Matrix7d>(),
            time(),
            time(),
            below(99),
            static_cast<Visibility>(below(5)),
            coin() ? Memory::kWorking : Memory::kLongTerm,
            coin()};
  }
  MapAnchor mapAnchor() {
    return {1 + bits() / 2,
            bits(),
            world(),
            world(),
            matrix<Eigen::Vector3d>(),
            uniform(-3, 3),
            matrix<Eigen::Vector4d>().cwiseAbs(),
            below(99)};
  }
  MapLoop mapLoop() {
    return {1 + bits() / 2,
            1 + bits() / 2,
            1 + bits() / 2,
            coin() ? MapLoopKind::kLoop : MapLoopKind::kTie,
            static_cast<MapLoopState>(below(3)),
            matrix<Eigen::Vector4d>(),
            matrix<Eigen::Vector4d>().cwiseAbs(),
            uniform(0, 99),
            uniform(0, 1),
            several([&] {
              return MapLoopPair{bits(), bits()};
            }),
            below(99)};
  }
  void fill(MapTile& m) {
    m = {bits(),
         static_cast<std::int32_t>(below(99)) - 50,
         static_cast<std::int32_t>(below(9)) - 5,
         static_cast<std::int32_t>(below(9)),
         bits(),
         several([&] { return mapObject(); })};
  }
  void fill(MapHeader& m) { m = {bits(), bits(), uniform(1, 99), below(99), below(99)}; }
  void fill(MapFrame& m) {
    m = {stamp(), bits(),    world(),   world(),  pose(), covariance<Eigen::Matrix4d>(),
         bits(),  below(99), below(99), below(99)};
  }
  Member member() {
    const ObjectId object = 1 + below(99);
    return {object + 1 + below(99), object};
  }
  void fill(MapNear& m) {
    m = {stamp(),
         bits(),
         bits(),
         world(),
         bits(),
         time(),
         bits(),
         coin(),
         coin(),
         several([&] { return member(); }),
         several([&] { return belief(); }),
         several([&] { return belief(); }),
         several([&] { return correction(); })};
  }
  Correction correction() {
    return {bits(), static_cast<CorrectionKind>(below(4)),
            bits(), bits(),
            word(), uniform(0, 9),
            word(), time(),
            coin()};
  }
  void fill(MapCorrection& m) { m = {bits(), bits(), correction()}; }
  void fill(MapQuery& m) {
    m = {bits(),
         bits(),
         static_cast<MapQueryKind>(below(8)),
         bits(),
         word(),
         matrix<Eigen::Vector3d>(),
         matrix<Eigen::Vector3d>(),
         uniform(0, 9),
         world(),
         below(99)};
  }
  void fill(MapReply& m) {
    m = {bits(),
         bits(),
         bits(),
         coin(),
         word(),
         coin(),
         several([&] { return mapObject(); }),
         several([&] { return belief(); }),
         several([&] { return mapAnchor(); }),
         several([&] { return mapLoop(); }),
         below(99),
         below(99),
         several([&] { return correction(); })};
  }
  void fill(SwapNotice& m) {
    m = {bits(), bits(), SwapStep::kRolledBack, uniform(0, 99), word(), word(), word()};
  }
  void fill(Health& m) {
    m = {word(),         bits(),         below(99999), HealthState::kDegraded,
         word(),         bits(),         bits(),       bits(),
         uniform(0, 99), uniform(0, 99), bits(),       {{word(), bits()}, {"b", bits()}}};
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace perdure::wire
