#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/check.h"
#include "services/gateway/core/channels.h"

namespace perdure::gateway {
namespace {

using Schema = nlohmann::ordered_json;

/// The schemas. A type begins with its name at the start of a line; with "!", the schema has this
/// name as its title. The members follow, separated by semicolons: name, type, and after a colon a
/// description that ends with the line. A type must be defined above its first use.
constexpr std::string_view kTypes = R"(
time!
 sec natural; nsec natural
duration!
 sec integer; nsec natural
vector3
 x number; y number; z number
point2
 x number; y number
quaternion
 x number; y number; z number; w number
pose
 position vector3; orientation quaternion
colour
 r number; g number; b number; a number
pair
 key text; value text
transform
 timestamp time; parent_frame_id text; child_frame_id text; translation vector3
 rotation quaternion
solid
 pose pose; size vector3; color colour
arrow
 pose pose; shaft_length number; shaft_diameter number; head_length number; head_diameter number
 color colour
cylinder
 pose pose; size vector3; bottom_scale number; top_scale number; color colour
lines
 type natural; pose pose; thickness number; scale_invariant boolean; points vector3[]
 color colour; colors colour[]; indices natural[]
triangles
 pose pose; points vector3[]; color colour; colors colour[]; indices natural[]
text_primitive
 pose pose; billboard boolean; font_size number; scale_invariant boolean; color colour; text text
model
 pose pose; scale vector3; color colour; override_color boolean; url text; media_type text
 data bytes
entity
 timestamp time; frame_id text; id text; lifetime duration; frame_locked boolean; metadata pair[]
 arrows arrow[]; cubes solid[]; spheres solid[]; cylinders cylinder[]; lines lines[]
 triangles triangles[]; texts text_primitive[]; models model[]
deletion
 timestamp time; type natural; id text
packed_field
 name text; offset natural; type natural
circle_annotation
 timestamp time; position point2; diameter number; thickness number; fill_color colour
 outline_color colour; metadata pair[]
points_annotation
 timestamp time; type natural; points point2[]; outline_color colour; outline_colors colour[]
 fill_color colour; thickness number; metadata pair[]
text_annotation
 timestamp time; position point2; text text; font_size number; text_color colour
 background_color colour; metadata pair[]
foxglove.FrameTransforms!
 transforms transform[]
foxglove.SceneUpdate!
 deletions deletion[]; entities entity[]
foxglove.PoseInFrame!
 timestamp time; frame_id text; pose pose
foxglove.PosesInFrame!
 timestamp time; frame_id text; poses pose[]
foxglove.PointCloud!
 timestamp time; frame_id text; pose pose; point_stride natural; fields packed_field[]; data bytes
foxglove.Log!
 timestamp time; level natural; message text; name text; file text; line natural
foxglove.CameraCalibration!
 timestamp time; frame_id text; width natural; height natural; distortion_model text
 D number[]; K number[]; R number[]; P number[]
foxglove.ImageAnnotations!
 timestamp time; circles circle_annotation[]; points points_annotation[]
 texts text_annotation[]; metadata pair[]
object_summary
 id natural; class text
 p number: probability of the class
 r number: probability that it exists
 c number[]: centre in frame_id, m
 yaw number: about the vertical, rad
 size number[]: length, width, height, m
 cov number[]: of the centre, m^2: xx xy xz yy yz zz
 yaw_sigma number
 size_sigma number[]: standard deviation, m
 visibility text: visible, partial, occluded, out_of_view, behind
 fraction number: of it that is visible
 blocked_by natural: id of what hides it; 0: nothing that has one
 confirmed boolean
 moving number: probability that it moves
 velocity number[]: m/s
 hits natural
 first_s number: first seen, s of the sensor clock
 last_s number: last seen, s of the sensor clock
 recalled boolean: came back from the map and not seen since
 provisional boolean: its session is not found on the map yet
 elsewhere boolean: on a map whose place in `map` is not known
perdure.Objects!
 timestamp time; frame_id text
 world text: a new one, or a new epoch, is a new frame of reference
 epoch natural; sequence natural
 latency_ms number: from capture; below 0: not known
 body number[]: pose: x y z, quaternion x y z w
 body_sigma number: of its position, m, root of the trace; below 0: not known
 up number[]: against gravity; yaws are about it
 objects object_summary[]
class_belief
 class text; p number
 mean number[]: x y z yaw log l, log w, log h
 covariance number[][]: 7 x 7
perdure.Object!
 found boolean; object object_summary; classes class_belief[]
 existence object: evidence by kind, nats and counts
 ledger object: of each class: evidence by kind, nats
 ousted object: the class that was given up last
 returns object: when it should be seen again, s
 history number[][]: time s, r, p, visible fraction
perdure.Event!
 timestamp time
 world text: which odom frame, with the epoch
 epoch natural; event text; object_id natural; other_id natural; class text; probability number
 detail text
 returns_in_s number[]: expected, and a 90 % interval
 at number[]: x y z in odom, where it is known
service
 process text; state text; message text
 age_s number: since it was heard
 frames_in natural; frames_out natural; dropped natural; rate_hz number
 cpu number: of one core; below 0: not known yet
 rss_mb number; reasons object
 stood_in_for boolean: another process does its work
silence
 objects number; odometry number
perdure.Health!
 vehicle text; services service[]
 silent_s silence: since the last message; below 0: none came
detection
 box number[]: x1 y1 x2 y2, px
 class text: the likeliest against clutter
 nats number: log-likelihood ratio against clutter
 primed boolean
perdure.Detections!
 timestamp time; camera text; sequence natural; detections detection[]
perdure.Map!
 timestamp time; frame_id text
 all natural: objects on the map
 elsewhere natural: objects of maps whose place here is not known
 objects object_summary[]: those nearest to the body
perdure.MapFrame!
 timestamp time; world text; epoch natural
 map text: the world that the map began as
 map_epoch natural
 T_MW number[]: odom in map: x y z, quaternion x y z w
 body_sigma number[]: of the body in map: x y z m, yaw rad; empty: not known
 revision natural: changes of the graph
 sessions natural: that hang together with this one, itself included
 loops natural: that are believed
 anchors natural
anchor
 id natural
 previous natural: of the same session; 0: none
 session text: the odom frame of its way, world/epoch
 at number[]: x y z in map, m
 yaw number
 sigma number[]: x y z m, yaw rad, relative to the first anchor
 objects natural: that were last seen from there
loop
 id natural
 a natural: the anchor that was known
 b natural: the anchor where the vehicle was
 kind text: loop, or tie: by objects with their ids
 state text: tentative, confirmed, withdrawn
 residual number[]: measured less as it lies: x y z m, yaw rad, in axes of a
 sigma number[]: of the measurement; empty: not known
 chi2 number: of the residual, 4 degrees of freedom
 weight number: by which it counts, 0 to 1
 pairs natural[][]: ids that it found to be one: known, seen
 landmarks natural: that look alike
perdure.MapGraph!
 timestamp time; frame_id text
 why_none text: a sentence, where there is no graph
 all_anchors natural: of the map
 all_loops natural
 truncated boolean: these are the nearest to the vehicle
 anchors anchor[]
 loops loop[]: between these anchors
perdure.SeenGround!
 timestamp time; frame_id text
 cell_m number: side of a cell
 ground_m number: height of the ground in odom
 cells number[][]: x y of the centre in odom, age of the last view in s; -1: before, not known when
perdure.Model!
 name text; hash text; classes text[]; input_width natural; input_height natural
perdure.ObjectRequest!
 id natural
perdure.MapRequest!
 id natural; class text
 near number[]: x y z, m; with radius
 radius number
 low number[]: x y z, m: a box, with high
 high number[]; limit natural
perdure.CorrectionRequest!
 object natural
 kind text: not_there, class, same, different
 class text: the right one
 other natural: for same and different
 nats number: log-likelihood ratio; else the map's default
 author text
 withdraw natural: the id of a correction, instead of the members above
correction
 id natural; kind text; object natural; other natural; class text; nats number; author text
 time_s number: of the newest frame of the map
perdure.MapReply!
 truncated boolean; objects object_summary[]
 corrections correction[]: standing ones of the object with this id, or all
)";

using Types = std::map<std::string, Schema, std::less<>>;

/// Returns the text before the separator, and removes text and separator from `rest`.
std::string_view cut(std::string_view& rest, std::string_view separator) {
  const std::size_t at = rest.find(separator);
  const std::string_view part = rest.substr(0, at);
  rest.remove_prefix(at == rest.npos ? rest.size() : at + separator.size());
  return part;
}

Schema typeOf(std::string_view name, const Types& known) {
  if (name.ends_with("[]")) {
    return {{"type", "array"}, {"items", typeOf(name.substr(0, name.size() - 2), known)}};
  }
  const auto found = known.find(name);
  check(found != known.end(), "a schema's member has a known type");
  return found->second;
}

void addMembers(std::string_view line, const Types& known, Schema& properties) {
  while (!line.empty()) {
    const bool described = line.find(": ") < line.find("; ");
    std::string_view member = cut(line, described ? ": " : "; ");
    const std::string name(cut(member, " "));
    properties[name] = typeOf(member, known);
    if (described) properties[name]["description"] = std::exchange(line, {});
  }
}

Types readTypes() {
  Types known = {{"number", {{"type", "number"}}},
                 {"integer", {{"type", "integer"}}},
                 {"natural", {{"type", "integer"}, {"minimum", 0}}},
                 {"text", {{"type", "string"}}},
                 {"boolean", {{"type", "boolean"}}},
                 {"bytes", {{"type", "string"}, {"contentEncoding", "base64"}}},
                 {"object", {{"type", "object"}}}};
  Schema* type = nullptr;
  for (std::string_view rest = kTypes.substr(1); !rest.empty();) {
    const std::string_view line = cut(rest, "\n");
    if (line.starts_with(' ')) {
      addMembers(line.substr(1), known, (*type)["properties"]);
      continue;
    }
    const bool titled = line.ends_with('!');
    const std::string name(line.substr(0, line.size() - (titled ? 1 : 0)));
    type = &known[name];
    (*type)["type"] = "object";
    if (titled) (*type)["title"] = name;
  }
  return known;
}

}  // namespace

std::string jsonSchema(std::string_view name) {
  static const Types kKnown = readTypes();
  return typeOf(name, kKnown).dump();
}

}  // namespace perdure::gateway
