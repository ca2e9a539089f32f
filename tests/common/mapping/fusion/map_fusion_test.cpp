// Maps of two or three vehicles along one block become one map.
#include "common/mapping/fusion/map_fusion.h"

#include <gtest/gtest.h>

#include <bit>
#include <string>

#include "tests/common/mapping/fusion/drives.h"

namespace perdure::mapping {
namespace {

using test::Driven;
using test::Thing;

const std::vector<Thing>& things() {
  static const auto all = test::thingsAlongBlock(3);
  return all;
}

const Driven& first() {
  static const Driven drive = test::driven(things(), {.seed = 1, .from_m = 0.0, .to_m = 330.0});
  return drive;
}
const Driven& second() {
  static const Driven drive =
      test::driven(things(), {.seed = 2, .from_m = 150.0, .to_m = 480.0, .clock_s = 1000.0});
  return drive;
}
const Driven& third() {
  static const Driven drive =
      test::driven(things(), {.seed = 5, .from_m = 300.0, .to_m = 590.0, .clock_s = 2000.0});
  return drive;
}

/// Fuses as the command does.
MapContents fuseAll(std::vector<MapContents> maps, FusionReport* last = nullptr) {
  std::stable_sort(maps.begin(), maps.end(), comesFirst);
  MapContents fused = maps.front();
  for (std::size_t k = 1; k < maps.size(); ++k) {
    const FusionReport report = fuseInto(fused, maps[k], Parameters());
    if (last != nullptr) *last = report;
  }
  return fused;
}

/// Number of present objects for each true object, and of merges of two true objects, by the origin
/// of each id.
struct Tally {
  std::map<std::size_t, std::set<ObjectId>> objects_of;
  std::size_t mixed = 0;

  double each() const {
    std::size_t objects = 0;
    for (const auto& [thing, ids] : objects_of) objects += ids.size();
    return static_cast<double>(objects) / static_cast<double>(objects_of.size());
  }
};

Tally tally(const MapContents& fused, const std::vector<Driven>& drives) {
  std::map<ObjectId, std::set<std::size_t>> things_of;
  const auto base = sessionsOf(fused.graph).front().identity;
  for (const Driven& drive : drives) {
    const SessionIdentity root = sessionsOf(drive.map.graph).front().identity;
    for (const auto& [id, object] : drive.map.objects) {
      ObjectId now = root.matches(base) ? id : 0;
      for (const Origin& origin : fused.origins) {
        if (origin.id == id && origin.map.matches(root)) now = origin.now;
      }
      EXPECT_NE(now, 0u) << "object " << id << " is nowhere";
      things_of[survivorOf(fused, now)].insert(drive.thing_of.at(id));
    }
  }
  Tally result;
  for (const auto& [id, things] : things_of) {
    if (fused.objects.at(id).ended) continue;
    if (things.size() > 1) ++result.mixed;
    for (const std::size_t thing : things) result.objects_of[thing].insert(id);
  }
  return result;
}

std::string bitsOf(const ObjectBelief& belief) {
  std::string bits = std::to_string(belief.id) + " " + std::to_string(belief.hits);
  const auto add = [&](double v) { bits += " " + std::to_string(std::bit_cast<std::uint64_t>(v)); };
  add(belief.existence);
  for (const ClassBelief& c : belief.classes) {
    bits += c.name;
    add(c.probability);
    for (const double each : c.mean) add(each);
    for (const double each : c.covariance.reshaped()) add(each);
    for (const double each : c.cross_pose.reshaped()) add(each);
  }
  return bits + std::to_string(toNanoseconds(belief.last_seen));
}

std::map<ObjectId, std::string> bitsOf(const MapContents& map) {
  std::map<ObjectId, std::string> bits;
  for (const auto& [id, object] : map.objects) {
    bits[id] = std::to_string(object.world.world) + (object.ended ? " ended " : " ") +
               bitsOf(object.belief);
  }
  return bits;
}

double apartInM(const MapContents& map, ObjectId id, const Thing& thing, const LevelPose& T_MTrue) {
  const ObjectRecord& record = map.graph.records.at(id);
  const LevelPose& T_MA = map.graph.anchors.at(record.sighting.anchor).T_MA;
  return (T_MA * record.sighting.in_anchor.p - T_MTrue * thing.p).head<2>().norm();
}

TEST(MapFusion, TwoVehiclesHaveOneObjectForEachThing) {
  const Driven a = first(), b = second();
  FusionReport report;
  const MapContents fused = fuseAll({a.map, b.map}, &report);
  EXPECT_GE(report.loops, 1u);
  EXPECT_GT(report.merges, 10u);
  EXPECT_EQ(partsOf(fused).size(), 1u);
  // Each object becomes one track, which has the object's id.
  EXPECT_TRUE(fused.graph.tracks.empty() && fused.graph.facts.empty());
  for (const auto& [id, record] : fused.graph.records) {
    EXPECT_EQ(record.sighting.in_anchor.id, id);
    EXPECT_EQ(record.earlier.value_or(record.sighting).in_anchor.id, id);
  }
  const Tally both = tally(fused, {a, b});
  EXPECT_EQ(both.mixed, 0u);
  EXPECT_LE(both.each(), 1.03);
  EXPECT_EQ(fused.present(), a.map.present() + b.map.present() - report.merges);
  // Each object has its true position in M, whose origin is the first anchor of the first vehicle.
  double sum = 0.0;
  for (const auto& [thing, ids] : both.objects_of) {
    sum += apartInM(fused, *ids.begin(), things()[thing], test::onBlock(0.0).inverse());
  }
  EXPECT_LT(sum / static_cast<double>(both.objects_of.size()), 5.0) << "drift, not another street";
}

TEST(MapFusion, AMapThatIsBroughtAgainChangesNotOneBit) {
  const Driven a = first(), b = second();
  const MapContents once = fuseAll({a.map, b.map});
  for (const MapContents& again : {a.map, b.map, once}) {
    FusionReport report;
    const MapContents twice = fuseAll({once, again}, &report);
    EXPECT_TRUE(report.added.empty());
    EXPECT_EQ(report.objects + report.merges + report.loops + report.renewed, 0u);
    EXPECT_TRUE(bitsOf(twice) == bitsOf(once));
    EXPECT_EQ(twice.origins, once.origins);
  }
  EXPECT_TRUE(bitsOf(fuseAll({a.map, b.map, a.map})) == bitsOf(once));
}

TEST(MapFusion, TheOrderOfThreeMapsDoesNotMatter) {
  const Driven a = first(), b = second(), c = third();
  const MapContents fused = fuseAll({a.map, b.map, c.map});
  EXPECT_EQ(sessionsOf(fused.graph).size(), 3u);
  EXPECT_TRUE(bitsOf(fuseAll({c.map, b.map, a.map})) == bitsOf(fused));
  EXPECT_TRUE(bitsOf(fuseAll({b.map, c.map, a.map})) == bitsOf(fused));
  // The maps are fused one by one, as a server receives them.
  EXPECT_TRUE(bitsOf(fuseAll({fuseAll({a.map, b.map}), c.map})) == bitsOf(fused));
  const Tally all = tally(fused, {a, b, c});
  EXPECT_EQ(all.mixed, 0u);
  EXPECT_LE(all.each(), 1.03);
}

/// The drive has merged some of its own objects. They must still be compared with the other map's
/// objects.
TEST(MapFusion, WhatADriveSawTwiceIsFoundOnTheOtherMap) {
  const Driven& a = first();
  const Driven b = test::driven(things(), {.seed = 2,
                                           .from_m = 0.0,
                                           .to_m = 4.0 * test::kSide_m + 330.0,
                                           .yaw_walk = 0.0003,
                                           .clock_s = 1000.0});
  std::size_t seen_twice = 0;
  for (const auto& [id, record] : b.map.graph.records) seen_twice += record.earlier ? 1 : 0;
  ASSERT_GT(seen_twice, 20u);
  const MapContents fused = fuseAll({a.map, b.map});
  const Tally both = tally(fused, {a, b});
  EXPECT_EQ(both.mixed, 0u);
  EXPECT_LE(both.each(), 1.03);
}

/// Two servers, each with the maps of two vehicles; both have the map of one of these vehicles.
TEST(MapFusion, FusedMapsHaveOneObjectForWhatBothKnow) {
  const Driven a = first(), b = second(), c = third();
  for (const bool c_is_older : {false, true}) {
    Driven other = c;
    if (c_is_older) {
      other = test::driven(things(), {.seed = 5, .from_m = 300.0, .to_m = 590.0, .clock_s = 500.0});
    }
    const MapContents ab = fuseAll({a.map, b.map}), bc = fuseAll({b.map, other.map});
    FusionReport report;
    const MapContents fused = fuseAll({ab, bc}, &report);
    EXPECT_EQ(sessionsOf(fused.graph).size(), 3u);
    EXPECT_EQ(report.known, 1u);
    const Tally all = tally(fused, {a, b, other});
    EXPECT_EQ(all.mixed, 0u);
    EXPECT_LE(all.each(), 1.03) << "the first session of the second map is older: " << c_is_older;
    for (const MapContents& again : {ab, bc, a.map, b.map, other.map}) {
      EXPECT_TRUE(bitsOf(fuseAll({fused, again})) == bitsOf(fused));
    }
    EXPECT_TRUE(bitsOf(fuseAll({bc, ab})) == bitsOf(fused));
  }
}

TEST(MapFusion, WhatJoinsNothingStaysAPartOfItsOwn) {
  const auto elsewhere = test::thingsAlongBlock(77);
  const Driven a = first();
  const Driven b = test::driven(elsewhere, {.seed = 2, .to_m = 200.0, .clock_s = 1000.0});
  FusionReport report;
  const MapContents fused = fuseAll({a.map, b.map}, &report);
  EXPECT_EQ(report.loops + report.merges, 0u);
  EXPECT_EQ(partsOf(fused).size(), 2u);
  EXPECT_EQ(fused.present(), a.map.present() + b.map.present());
}

TEST(MapFusion, ADriveThatWentOnBringsWhatItHasSeenSince) {
  test::Vehicle vehicle(things(), {.seed = 1});
  const Driven a = vehicle.to(200.0);
  const Driven later = vehicle.to(330.0);
  const Driven b = second();
  const MapContents fused = fuseAll({a.map, b.map});
  FusionReport report;
  const MapContents grown = fuseAll({fused, later.map}, &report);
  EXPECT_TRUE(report.added.empty());
  EXPECT_EQ(report.grown.size(), 1u);
  EXPECT_EQ(sessionsOf(grown.graph).front().anchors.size(),
            sessionsOf(later.map.graph).front().anchors.size());
  EXPECT_GT(grown.graph.anchors.size(), fused.graph.anchors.size());
  const Tally all = tally(grown, {later, b});
  EXPECT_EQ(all.mixed, 0u);
  EXPECT_LE(all.each(), 1.03);
  EXPECT_TRUE(bitsOf(fuseAll({grown, later.map})) == bitsOf(grown));
  EXPECT_TRUE(bitsOf(fuseAll({grown, a.map})) == bitsOf(grown)) << "an older copy says nothing new";
}

/// The second vehicle observes that an object of the first one disappears.
TEST(MapFusion, WhatAnotherDriveSawGoBecomesAChangeWithTimes) {
  const Driven a = first();
  Driven b = second();
  const auto thingOf = [](const Driven& d, std::size_t thing) {
    for (const auto& [id, t] : d.thing_of) {
      if (t == thing && d.map.objects.contains(id)) return id;
    }
    return ObjectId{0};
  };
  std::vector<std::size_t> in_both;
  for (std::size_t thing = 0; thing < things().size(); ++thing) {
    if (thingOf(a, thing) != 0 && thingOf(b, thing) != 0) in_both.push_back(thing);
  }
  ASSERT_GT(in_both.size(), 10u);
  const std::size_t thing = in_both[in_both.size() / 2];
  const ObjectId in_a = thingOf(a, thing), in_b = thingOf(b, thing);
  const TimePoint gone_at = b.map.objects.at(in_b).belief.last_seen + durationFromSeconds(3.0);
  b.map.objects.at(in_b).ended = Ending{EventKind::kGone, gone_at, 0};
  b.map.graph.records.erase(in_b);
  FusionReport report;
  const MapContents fused = fuseAll({a.map, b.map}, &report);
  ASSERT_EQ(report.changes.size(), 1u);
  const Change& change = report.changes.front();
  EXPECT_EQ(change.kind, Change::Kind::kGone);
  EXPECT_EQ(change.id, in_a);
  EXPECT_EQ(change.class_name, things()[thing].name);
  EXPECT_EQ(change.last_seen, a.map.objects.at(in_a).belief.last_seen);
  EXPECT_EQ(change.since, gone_at);
  EXPECT_EQ(change.by, report.added.front());
  ASSERT_TRUE(fused.objects.at(in_a).ended);
  EXPECT_EQ(fused.objects.at(in_a).ended->time, gone_at);
  EXPECT_EQ(fused.changes, report.changes);
  FusionReport again;
  EXPECT_TRUE(bitsOf(fuseAll({fused, b.map}, &again)) == bitsOf(fused));
  EXPECT_TRUE(again.changes.empty());
}

TEST(MapFusion, SilenceIsNoAbsence) {
  const Driven a = first();
  std::set<std::size_t> not_there;
  for (std::size_t thing = 0; thing < things().size(); thing += 5) not_there.insert(thing);
  const Driven b = test::driven(
      things(),
      {.seed = 2, .from_m = 150.0, .to_m = 480.0, .clock_s = 1000.0, .not_there = not_there});
  FusionReport report;
  const MapContents fused = fuseAll({a.map, b.map}, &report);
  EXPECT_GT(report.merges, 5u);
  EXPECT_TRUE(report.changes.empty());
  for (const auto& [id, object] : a.map.objects) {
    EXPECT_TRUE(!fused.objects.at(id).ended ||
                fused.objects.at(id).ended->kind == EventKind::kMerged);
  }
}

}  // namespace
}  // namespace perdure::mapping
