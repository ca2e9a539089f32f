// Writes a drive (plan.json and its images) as a ROS 2 recording by npm's libraries.
// usage: write_mcap.mjs PLAN MCAP
import { open, readFile } from "node:fs/promises";
import path from "node:path";
import { McapWriter } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { ros2humble } from "@foxglove/rosmsg-msgs-common";
import { MessageWriter } from "@foxglove/rosmsg2-serialization";

const [planFile, target] = process.argv.slice(2);
const plan = JSON.parse(await readFile(planFile, "utf8"));
const folder = path.dirname(planFile);
const file = await open(target, "w");
let size = 0n;
const writer = new McapWriter({
  writable: {
    write: async (bytes) => {
      await file.write(bytes);
      size += BigInt(bytes.byteLength);
    },
    position: () => size,
  },
  chunkSize: 64 * 1024,
});
await writer.start({ profile: "ros2", library: "npm" });

// The package has parsed definitions. ROS 2 writes them as text, which readers may use.
const textOf = (fields) =>
  fields.definitions
    .filter((one) => !one.isConstant)
    .map((one) => `${one.type}${one.isArray ? `[${one.arrayLength ?? ""}]` : ""} ${one.name}`)
    .join("\n");
function withParts(name, seen = new Set()) {
  const parts = [];
  for (const one of ros2humble[name].definitions) {
    if (!one.isComplex || seen.has(one.type)) continue;
    seen.add(one.type);
    parts.push({ ...ros2humble[one.type], name: one.type }, ...withParts(one.type, seen));
  }
  return parts;
}
const channels = new Map();
async function channelOf(topic, type) {
  if (!channels.has(topic)) {
    const root = ros2humble[type];
    const parts = withParts(type);
    const text = [textOf(root), ...parts.map((part) => `${"=".repeat(80)}\nMSG: ${part.name}\n${textOf(part)}`)].join("\n");
    const schemaId = await writer.registerSchema({
      name: type.replace("/", "/msg/"),
      encoding: "ros2msg",
      data: new TextEncoder().encode(text),
    });
    const id = await writer.registerChannel({ schemaId, topic, messageEncoding: "cdr", metadata: new Map() });
    channels.set(topic, { id, messages: new MessageWriter(parse(text, { ros2: true })), sequence: 0 });
  }
  return channels.get(topic);
}
async function add(topic, type, ns, message) {
  const channel = await channelOf(topic, type);
  const logTime = ns + 1000000n;
  await writer.addMessage({
    channelId: channel.id,
    sequence: channel.sequence++,
    logTime,
    publishTime: logTime,
    data: channel.messages.writeMessage(message),
  });
}

const timeOf = (ns) => ({ sec: Number(ns / 1000000000n), nanosec: Number(ns % 1000000000n) });
const header = (ns, frame_id) => ({ stamp: timeOf(ns), frame_id });
const vector = ([x, y, z]) => ({ x, y, z });
const cameras = new Map(plan.cameras.map((camera) => [camera.name, camera]));
const todo = plan.imu.map((values) => ({ ns: BigInt(values[0]), imu: values }));
for (const entry of plan.images) todo.push({ ns: BigInt(entry.ns), image: entry });
todo.sort((a, b) => (a.ns < b.ns ? -1 : a.ns > b.ns ? 1 : 0));
if (plan.transforms) {
  const transforms = plan.cameras.map((camera) => ({
    header: header(0n, plan.imu_frame),
    child_frame_id: camera.frame,
    transform: {
      translation: vector(camera.p),
      rotation: { x: camera.q[0], y: camera.q[1], z: camera.q[2], w: camera.q[3] },
    },
  }));
  await add("/tf_static", "tf2_msgs/TFMessage", todo[0].ns, { transforms });
}
for (const { ns, imu, image } of todo) {
  if (imu) {
    await add(plan.imu_topic, "sensor_msgs/Imu", ns, {
      header: header(ns, plan.imu_frame),
      orientation: { x: 0, y: 0, z: 0, w: 1 },
      angular_velocity: vector(imu.slice(1, 4)),
      linear_acceleration: vector(imu.slice(4, 7)),
    });
    continue;
  }
  const camera = cameras.get(image.camera);
  const data = await readFile(path.join(folder, image.file));
  if (image.format) {
    await add(image.topic, "sensor_msgs/CompressedImage", ns, { header: header(ns, camera.frame), format: image.format, data });
  } else {
    const { width, height } = camera;
    await add(image.topic, "sensor_msgs/Image", ns, {
      header: header(ns, camera.frame), width, height, encoding: image.encoding, step: image.step, data,
    });
  }
  await add(camera.info_topic, "sensor_msgs/CameraInfo", ns, {
    header: header(ns, camera.frame), width: camera.width, height: camera.height,
    distortion_model: camera.model, d: camera.d, k: camera.k,
  });
}
await writer.end();
await file.close();
