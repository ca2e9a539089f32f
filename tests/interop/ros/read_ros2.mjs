// Reads a ROS 2 recording by its index. Prints one JSON line for each message, and one for the
// file: its profile, its channels, and each definition that differs from ROS 2 Humble.
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { ros2humble } from "@foxglove/rosmsg-msgs-common";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { decompress } from "fzstd";

// npm's packages lack vision_msgs 4; these definitions follow its documentation.
const vision = {
  "vision_msgs/Detection2DArray": "std_msgs/Header header, vision_msgs/Detection2D[] detections",
  "vision_msgs/Detection2D":
    "std_msgs/Header header, vision_msgs/ObjectHypothesisWithPose[] results, vision_msgs/BoundingBox2D bbox, string id",
  "vision_msgs/BoundingBox2D": "vision_msgs/Pose2D center, float64 size_x, float64 size_y",
  "vision_msgs/Pose2D": "vision_msgs/Point2D position, float64 theta",
  "vision_msgs/Point2D": "float64 x, float64 y",
  "vision_msgs/Detection3DArray": "std_msgs/Header header, vision_msgs/Detection3D[] detections",
  "vision_msgs/Detection3D":
    "std_msgs/Header header, vision_msgs/ObjectHypothesisWithPose[] results, vision_msgs/BoundingBox3D bbox, string id",
  "vision_msgs/BoundingBox3D": "geometry_msgs/Pose center, geometry_msgs/Vector3 size",
  "vision_msgs/ObjectHypothesisWithPose":
    "vision_msgs/ObjectHypothesis hypothesis, geometry_msgs/PoseWithCovariance pose",
  "vision_msgs/ObjectHypothesis": "string class_id, float64 score",
};
// The parser uses other names for these types.
const aliases = { "builtin_interfaces/Time": "time", "builtin_interfaces/Duration": "duration", byte: "uint8" };
const textOf = (definitions) =>
  definitions
    .filter((one) => !one.isConstant)
    .map((one) => `${aliases[one.type] ?? one.type}${one.isArray ? `[${one.arrayLength ?? ""}]` : ""} ${one.name}`)
    .join(", ");

const file = await open(process.argv[2], "r");
const size = (await file.stat()).size;
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      await file.read(bytes, 0, Number(length), Number(offset));
      return bytes;
    },
  },
  decompressHandlers: { zstd: (bytes, unpacked) => decompress(bytes, new Uint8Array(Number(unpacked))) },
});
const plain = (key, value) =>
  typeof value === "bigint" ? value.toString() : ArrayBuffer.isView(value) ? Array.from(value) : value;
const print = (value) => console.log(JSON.stringify(value, plain));

const decoders = new Map();
const channels = {};
const wrong = [];
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  definitions[0].name = schema.name.replace("/msg/", "/");
  for (const one of definitions) {
    const known = vision[one.name] ?? (ros2humble[one.name] && textOf(ros2humble[one.name].definitions));
    if (known === undefined || known !== textOf(one.definitions)) wrong.push(`${one.name}: ${textOf(one.definitions)}; ROS: ${known}`);
  }
  decoders.set(channel.id, new MessageReader(definitions));
  channels[channel.topic] = {
    type: schema.name, encoding: schema.encoding, latched: /durability: 1\n/.test(channel.metadata.get("offered_qos_profiles")),
  };
}
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  print({ topic: channel.topic, log: message.logTime, value: decoders.get(channel.id).readMessage(message.data) });
}
print({ profile: reader.header.profile, messages: reader.statistics.messageCount, channels, wrong });
