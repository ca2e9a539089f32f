// Runs Foxglove's own client against the gateway. It subscribes to every advertised channel,
// decodes it and compares it with Foxglove's schemas. It calls every service.
// usage: node foxglove.mjs NODE_MODULES PORT SUBPROTOCOL
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';

const [modules, port, subprotocol] = process.argv.slice(2);
const require = createRequire(join(modules, 'x.js'));
const { FoxgloveClient } = require('@foxglove/ws-protocol');
const { parseIDL } = require('@foxglove/omgidl-parser');
const { MessageReader } = require('@foxglove/omgidl-serialization');
const schemas = Object.fromEntries(Object.values(require('@foxglove/schemas/jsonschema')).map((s) => [s.title, s]));
const Ajv = require('ajv').default ?? require('ajv');
const WebSocket = require('ws');

const ajv = new Ajv({ strict: false, allErrors: false });
const problems = [], got = new Map(), channels = new Map(), byId = new Map(), readers = new Map(), validators = new Map();
const socket = new WebSocket(`ws://127.0.0.1:${port}/`, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
const fail = (what) => { problems.push(what); };

/** Foxglove's schemas allow additional members; this also checks that no listed member is missing. */
function compare(channel, value) {
  const known = schemas[channel.schemaName.replace('::', '.')];
  if (channel.schemaName.startsWith('foxglove') && !known) fail(`${channel.topic}: Foxglove has no ${channel.schemaName}`);
  for (const schema of [known, channel.schemaEncoding === 'jsonschema' ? JSON.parse(channel.schema) : undefined]) {
    if (!schema) continue;
    const key = `${channel.id}/${schema === known}`;
    if (!validators.has(key)) validators.set(key, ajv.compile({ ...schema, $id: undefined }));
    const validate = validators.get(key);
    if (!validate(value)) fail(`${channel.topic}: ${ajv.errorsText(validate.errors)}`);
    for (const name of Object.keys(schema.properties)) {
      if (known === schema && !(name in value) && name !== 'metadata') fail(`${channel.topic}: ${name} is missing`);
    }
  }
}

/** Compares with the numbers that the test publishes. */
function expectRaw(channel, value) {
  const expected = { '/raw/imu': (v) => v.accel?.[2] === 9.8 || v.accel?.z === 9.8, '/raw/speed': (v) => v.speed === 1,
    '/raw/odometry': (v) => v.state === 1, '/raw/landmarks': (v) => Object.values(v).some((x) => x?.length === 5) }[channel.topic];
  if (!expected?.(value)) fail(`${channel.topic}: ${JSON.stringify(value, (k, x) => (typeof x === 'bigint' ? String(x) : x)).slice(0, 300)}`);
  return value;
}

function decode(channel, data) {
  const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  if (channel.encoding === 'json') return JSON.parse(new TextDecoder().decode(bytes));
  if (!readers.has(channel.id)) readers.set(channel.id, new MessageReader(channel.schemaName, parseIDL(channel.schema)));
  const reader = readers.get(channel.id);
  const value = reader.readMessage(bytes);
  if (!channel.schemaName.startsWith('foxglove')) return expectRaw(channel, value);
  return { ...value, data: Buffer.from(value.data).toString('base64'), timestamp: { sec: value.timestamp.sec, nsec: value.timestamp.nsec } };
}

socket.on('open', () => { if (!socket.extensions.includes('permessage-deflate')) fail('the gateway does not compress for a client that asks'); });
client.on('error', (e) => fail(`error: ${e.message ?? e}`));
client.on('status', (s) => { if (s.level > 0) fail(`status: ${s.message}`); });
client.on('serverInfo', (info) => { if (!info.capabilities.includes('time')) fail('no capability time'); });
client.on('advertise', (list) => {
  for (const channel of list) {
    channels.set(channel.topic, channel);
    byId.set(client.subscribe(channel.id), channel);
  }
});
client.on('message', ({ subscriptionId, data }) => {
  const channel = byId.get(subscriptionId);
  try {
    compare(channel, decode(channel, data));
  } catch (error) {
    fail(`${channel.topic}: ${error.message}`);
  }
  got.set(channel.topic, (got.get(channel.topic) ?? 0) + 1);
});
let times = 0;
client.on('time', () => { ++times; });

const answers = new Map();
client.on('advertiseServices', (list) => {
  const requests = { '/object': { id: 1 }, '/map/query': { class: 7 } };
  for (const service of list) {
    client.sendServiceCallRequest({ serviceId: service.id, callId: service.id, encoding: 'json',
      data: new TextEncoder().encode(JSON.stringify(requests[service.name])) });
    answers.set(service.id, { service, answer: null });
  }
});
client.on('serviceCallResponse', ({ serviceId, data }) => {
  const { service } = answers.get(serviceId);
  const value = JSON.parse(new TextDecoder().decode(data));
  if (!ajv.validate(JSON.parse(service.response.schema), value)) fail(`${service.name}: ${ajv.errorsText()}`);
  answers.get(serviceId).answer = value;
});
client.on('serviceCallFailure', ({ serviceId, message }) => { answers.get(serviceId).answer = message; });

const until = Date.now() + 20000;
const complete = () => channels.size > 0 && [...channels.keys()].every((t) => (got.get(t) ?? 0) > 0)
  && answers.size > 0 && [...answers.values()].every((a) => a.answer !== null) && times > 0;
while (!complete() && Date.now() < until) await new Promise((r) => setTimeout(r, 50));
for (const topic of channels.keys()) if (!got.has(topic)) fail(`${topic}: nothing came`);
for (const { service, answer } of answers.values()) if (answer === null) fail(`${service.name}: no answer`);
if (times === 0) fail('no time was told');
if (socket.protocol !== subprotocol) fail(`it speaks ${socket.protocol}`);
// The layout for Foxglove must name only advertised topics, each with the right schema.
const layout = JSON.parse(readFileSync(new URL('../../../../tools/viewer/src/foxglove_layout.json', import.meta.url)));
let named = 0;
function expectChannel(where, topic, ...kinds) {
  ++named;
  const channel = channels.get(topic);
  if (!channel) fail(`layout: ${where} names ${topic}, which nobody advertises`);
  else if (kinds.length > 0 && !kinds.includes(channel.schemaName.replace('::', '.'))) fail(`layout: ${where} shows ${topic} of ${channel.schemaName}`);
  return channel;
}
/** Checks a path such as "/objects.objects[:]{id==$object}.r": the schema must have each member, also those of filters. */
function expectPath(where, path) {
  const [topic] = path.match(/^[\w/]+/);
  const channel = expectChannel(where, topic);
  let at = channel && JSON.parse(channel.schema);
  for (const [, member, filter, slice] of path.slice(topic.length).matchAll(/\.(\w+)|\{([^}]*)\}|\[([\d:]*)\]/g)) {
    if (!at) return;
    if (slice !== undefined) at = at.items;
    else if (filter !== undefined) {
      const [name, value] = filter.split(/[=!<>]=?/);
      if (!at.properties?.[name]) fail(`layout: ${where}: ${path} has no ${name}`);
      if (value[0] === '$' && !(value.slice(1) in layout.globalVariables)) fail(`layout: ${where}: ${value} is no variable`);
    } else if (!(at = at.properties?.[member])) fail(`layout: ${where}: ${path} has no ${member}`);
  }
}
const DRAWN = ['foxglove.SceneUpdate', 'foxglove.PoseInFrame', 'foxglove.PosesInFrame', 'foxglove.PointCloud'];
for (const [panel, config] of Object.entries(layout.configById)) {
  for (const topic of Object.keys(config.topics ?? {})) expectChannel(panel, topic, ...DRAWN);
  const { imageTopic, calibrationTopic, annotations = {} } = config.imageMode ?? {};
  if (imageTopic) expectChannel(panel, imageTopic, 'foxglove.CompressedImage');
  if (calibrationTopic) expectChannel(panel, calibrationTopic, 'foxglove.CameraCalibration');
  for (const topic of Object.keys(annotations)) expectChannel(panel, topic, 'foxglove.ImageAnnotations');
  if (config.topicToRender) expectChannel(panel, config.topicToRender, 'foxglove.Log');
  for (const path of [config.topicPath, ...(config.paths ?? []).map((p) => p.value)]) if (path) expectPath(panel, path);
}
const placed = (node) => (typeof node === 'string' ? [node] : [...placed(node.first), ...placed(node.second)]);
if (String(placed(layout.layout).sort()) !== String(Object.keys(layout.configById).sort())) fail('layout: a panel has no place, or a place no panel');
for (const kind of ['3D', 'Image', 'Plot', 'RosOut']) if (!Object.keys(layout.configById).some((p) => p.startsWith(`${kind}!`))) fail(`layout: no ${kind}`);

console.log(JSON.stringify({ named, problems: [...new Set(problems)].slice(0, 20), channels: channels.size, messages: [...got.values()].reduce((a, b) => a + b, 0) }));
process.exit(problems.length > 0 ? 1 : 0);
