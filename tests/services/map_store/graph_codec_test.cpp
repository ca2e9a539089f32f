#include "services/map_store/core/graph/graph_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/services/map_store/graphs.h"

namespace perdure::map_store {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

mapping::SavedMap someMap(std::uint32_t seed) { return test::RandomGraph(seed).map({}); }

/// A blob of each kind, and whether it can be decoded.
struct Blob {
  Bytes bytes;
  std::function<Result<void>(const Bytes&)> decode;
};

template <class Value>
Result<void> verdict(const Result<Value>& value) {
  return value ? Result<void>() : tl::unexpected<Reason>(value.error());
}

std::vector<Blob> oneOfEach() {
  const auto map = someMap(3);
  mapping::ObjectRecord record = map.records.at(1);
  record.earlier = record.sighting;
  return {
      {encodeAnchor(map.anchors.at(2).anchor), [](auto& b) { return verdict(decodeAnchor(b)); }},
      {encodeEdge(map.edges.at(1).edge), [](auto& b) { return verdict(decodeEdge(b)); }},
      {encodeRecord(record), [](auto& b) { return verdict(decodeRecord(b)); }},
      {encodeView(map.views.at(1)), [](auto& b) { return verdict(decodeView(b)); }}};
}

TEST(GraphCodec, GivesBackEveryBitOfAnchorsEdgesAndRecords) {
  const auto map = someMap(1);
  for (const auto& [id, saved] : map.anchors) {
    const auto back = decodeAnchor(encodeAnchor(saved.anchor));
    ASSERT_TRUE(back.has_value()) << back.error().detail;
    EXPECT_EQ(encodeAnchor(*back), encodeAnchor(saved.anchor));
    EXPECT_EQ(back->id, id);
    EXPECT_EQ(back->previous, saved.anchor.previous);
    EXPECT_EQ(back->session, saved.anchor.session);
    EXPECT_TRUE(back->stamp.sameFrame(saved.anchor.stamp));
    EXPECT_EQ(back->stamp.time, saved.anchor.stamp.time);
    EXPECT_EQ(back->stamp.captured_ns, saved.anchor.stamp.captured_ns);
    EXPECT_EQ(back->T_WA.q.coeffs(), saved.anchor.T_WA.q.coeffs());
    EXPECT_EQ(back->T_WA.p, saved.anchor.T_WA.p);
    EXPECT_EQ(back->from_previous.mean.p, saved.anchor.from_previous.mean.p);
    EXPECT_EQ(back->from_previous.covariance, saved.anchor.from_previous.covariance);
    EXPECT_EQ(back->way_m, saved.anchor.way_m);
  }
  for (const auto& [id, saved] : map.edges) {
    const auto back = decodeEdge(encodeEdge(saved.edge));
    ASSERT_TRUE(back.has_value()) << back.error().detail;
    EXPECT_EQ(back->a, saved.edge.a);
    EXPECT_EQ(back->b, saved.edge.b);
    EXPECT_EQ(back->kind, saved.edge.kind);
    EXPECT_EQ(back->T_ab.mean.p, saved.edge.T_ab.mean.p);
    EXPECT_EQ(back->T_ab.mean.yaw, saved.edge.T_ab.mean.yaw);
    EXPECT_EQ(back->T_ab.covariance, saved.edge.T_ab.covariance);
  }
}

TEST(GraphCodec, GivesBackEveryBitOfAView) {
  const auto map = someMap(2);
  ASSERT_EQ(map.views.size(), 12u);
  for (const auto& [anchor, view] : map.views) {
    const auto back = decodeView(encodeView(view));
    ASSERT_TRUE(back.has_value()) << back.error().detail;
    EXPECT_TRUE(*back == view);
    EXPECT_LE(encodeView(view).size(), 6 + 48 * view.size());
  }
}

TEST(GraphCodec, RefusesAViewThatIsNotSound) {
  mapping::View view = someMap(2).views.at(1);
  view.front().p.x() = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(decodeView(encodeView(view)).has_value());
  view.front().p.x() = 1.0F;
  view.front().sigma = -1.0F;
  EXPECT_FALSE(decodeView(encodeView(view)).has_value());
  view.front().sigma = 1.0F;
  EXPECT_TRUE(decodeView(encodeView(view)).has_value());
  view.resize(mapping::kMostPoints + 1);
  EXPECT_FALSE(decodeView(encodeView(view)).has_value());
  EXPECT_FALSE(decodeView(encodeView({})).has_value());
}

TEST(GraphCodec, GivesBackEveryBitOfARecord) {
  const auto map = someMap(2);
  int with_earlier = 0;
  for (const auto& [id, record] : map.records) {
    const auto back = decodeRecord(encodeRecord(record));
    ASSERT_TRUE(back.has_value()) << back.error().detail;
    EXPECT_EQ(encodeRecord(*back), encodeRecord(record));
    EXPECT_EQ(back->session, record.session);
    EXPECT_EQ(back->way_m, record.way_m);
    EXPECT_EQ(back->last_seen, record.last_seen);
    EXPECT_EQ(back->pose_error, record.pose_error);
    EXPECT_EQ(back->sighting.anchor, record.sighting.anchor);
    EXPECT_EQ(back->sighting.in_anchor.id, id);
    EXPECT_EQ(back->sighting.in_anchor.p, record.sighting.in_anchor.p);
    EXPECT_EQ(back->sighting.in_anchor.covariance, record.sighting.in_anchor.covariance);
    ASSERT_EQ(back->sighting.in_anchor.pmf.size(), record.sighting.in_anchor.pmf.size());
    EXPECT_TRUE(back->confirmed);
    EXPECT_FALSE(back->gone);
    ASSERT_EQ(back->earlier.has_value(), record.earlier.has_value());
    if (!record.earlier) continue;
    ++with_earlier;
    EXPECT_EQ(back->earlier->anchor, record.earlier->anchor);
    EXPECT_EQ(back->earlier->in_anchor.p, record.earlier->in_anchor.p);
  }
  EXPECT_GT(with_earlier, 10);
}

TEST(GraphCodec, WritesItsVersionAndIdLittleEndian) {
  const Bytes bytes = encodeAnchor(test::RandomGraph(1).anchor(0x0102030405060708u, 0));
  const Bytes head(bytes.begin(), bytes.begin() + 10);
  EXPECT_EQ(head, (Bytes{2, 0, 8, 7, 6, 5, 4, 3, 2, 1}));
}

TEST(GraphCodec, ReadsAnchorsOfVersionOneWhichHadOneScale) {
  mapping::Anchor anchor = someMap(5).anchors.at(2).anchor;
  anchor.scale = {2.5, 1.5};
  Bytes old = encodeAnchor(anchor);
  old[0] = 1;
  EXPECT_FALSE(decodeAnchor(old).has_value()) << "the second scale is left over";
  old.resize(old.size() - sizeof(double));
  const auto back = decodeAnchor(old);
  ASSERT_TRUE(back.has_value()) << back.error().detail;
  EXPECT_EQ(back->scale, (mapping::DriftVariance{2.5, 2.5}));
}

TEST(GraphCodec, RefusesEveryTruncationLeftOverBytesAndOtherVersions) {
  for (const Blob& blob : oneOfEach()) {
    ASSERT_TRUE(blob.decode(blob.bytes).has_value());
    for (std::size_t size = 0; size < blob.bytes.size(); ++size) {
      const auto back =
          blob.decode({blob.bytes.begin(), blob.bytes.begin() + std::ptrdiff_t(size)});
      ASSERT_FALSE(back.has_value()) << "of " << size << " bytes";
      EXPECT_EQ(back.error().code, "graph_malformed");
    }
    Bytes longer = blob.bytes, newer = blob.bytes;
    longer.push_back(0);
    newer[0] = 3;
    EXPECT_FALSE(blob.decode(longer).has_value());
    EXPECT_FALSE(blob.decode(newer).has_value());
  }
}

TEST(GraphCodec, RefusesWhatIsNotSound) {
  const auto map = someMap(4);
  const mapping::Anchor sound = map.anchors.at(2).anchor;
  std::vector<mapping::Anchor> anchors(5, sound);
  anchors[0].previous = anchors[0].id;
  anchors[1].T_WA.q.coeffs() *= 1.01;
  anchors[2].T_WA.p.z() = kNan;
  anchors[3].from_previous.covariance(2, 1) = std::numeric_limits<double>::infinity();
  anchors[4].id = 0;
  for (const auto& anchor : anchors) {
    EXPECT_FALSE(isSound(anchor));
    EXPECT_EQ(decodeAnchor(encodeAnchor(anchor)).error().code, "graph_malformed");
  }
  std::vector<mapping::Edge> edges(3, map.edges.at(1).edge);
  edges[0].b = edges[0].a;
  edges[1].a = 0;
  edges[2].T_ab.mean.yaw = kNan;
  for (const auto& edge : edges) EXPECT_FALSE(decodeEdge(encodeEdge(edge)).has_value());
  std::vector<mapping::ObjectRecord> records(4, map.records.at(1));
  records[0].pose_error(5, 5) = kNan;
  records[1].sighting.anchor = 0;
  records[2].sighting.in_anchor.pmf.at(0).probability = kNan;
  records[3].earlier.emplace().anchor = 0;
  for (const auto& record : records) EXPECT_FALSE(decodeRecord(encodeRecord(record)).has_value());
}

TEST(GraphCodec, RefusesAPmfThatClaimsMoreThanThereIs) {
  mapping::ObjectRecord record = someMap(5).records.at(1);
  record.earlier.reset();
  record.sighting.in_anchor.pmf.clear();
  Bytes bytes = encodeRecord(record);
  for (std::size_t i = 2; i <= 5; ++i) bytes[bytes.size() - i] = 0xff;
  EXPECT_EQ(decodeRecord(bytes).error().code, "graph_malformed");
  record.sighting.in_anchor.pmf.resize(5000);
  EXPECT_FALSE(isSound(record));
}

TEST(GraphCodec, SurvivesRandomBytes) {
  std::mt19937 random(1);
  for (const Blob& blob : oneOfEach()) {
    int refused = 0;
    for (int trial = 0; trial < 5000; ++trial) {
      Bytes bytes = blob.bytes;
      for (int i = 0; i < 8; ++i)
        bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
      bytes.resize(bytes.size() - random() % 4);
      if (!blob.decode(bytes)) ++refused;
    }
    EXPECT_GT(refused, 2500);
  }
}

}  // namespace
}  // namespace perdure::map_store
