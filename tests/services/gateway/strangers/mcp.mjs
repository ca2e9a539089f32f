// Runs the SDK of the Model Context Protocol against Perdure's server. It calls every tool; the SDK
// checks each result against the tool's output schema.
// usage: node mcp.mjs NODE_MODULES http URL TOKEN REVISION | stdio REVISION COMMAND...
import { createRequire } from 'node:module';
import { join } from 'node:path';

const [modules, kind, ...rest] = process.argv.slice(2);
const require = createRequire(join(modules, 'x.js'));
const { Client } = require('@modelcontextprotocol/sdk/client/index.js');
const { StdioClientTransport } = require('@modelcontextprotocol/sdk/client/stdio.js');
const { StreamableHTTPClientTransport } = require('@modelcontextprotocol/sdk/client/streamableHttp.js');

const problems = [];
const fail = (what) => { problems.push(what); };
let revision, transport;
if (kind === 'http') {
  const [url, token, asked] = rest;
  revision = asked;
  transport = new StreamableHTTPClientTransport(new URL(url), { requestInit: { headers: { Authorization: `Bearer ${token}` } } });
} else {
  const [asked, command, ...args] = rest;
  revision = asked;
  transport = new StdioClientTransport({ command, args, env: process.env });
}
// The SDK always asks for its newest revision; an older client is played by changing that message.
const send = transport.send.bind(transport);
transport.send = (message, options) => {
  if (message.method === 'initialize' && revision) message.params.protocolVersion = revision;
  return send(message, options);
};
let agreed;
const setVersion = transport.setProtocolVersion?.bind(transport);
transport.setProtocolVersion = (version) => { agreed = version; setVersion?.(version); };

const client = new Client({ name: 'stranger', version: '1' });
client.onerror = (error) => fail(`error: ${error.message}`);
await client.connect(transport);
await client.ping();
const { tools } = await client.listTools();

/** The entries of each item must sum to its log-odds. */
function checkSums(result) {
  const items = [result.object, ...(result.objects ?? []), ...(result.changes ?? []), ...(result.regions ?? [])].filter(Boolean);
  for (const item of items) {
    const sum = Object.values(item.evidence).reduce((a, e) => a + e.log_odds, 0);
    if (Math.abs(sum - item.log_odds) > 1e-6) fail(`${item.id}: the evidence sums to ${sum}, not ${item.log_odds}`);
    if (Math.abs(1 / (1 + Math.exp(-sum)) - item.probability) > 1e-6) fail(`${item.id}: probability ${item.probability}`);
    if (!('age_s' in item)) fail(`${item.id}: no age`);
  }
  return items.length;
}
const results = {};
async function call(name, args) {
  const result = await client.callTool({ name, arguments: args });
  if (result.isError) return fail(`${name}: ${result.content[0].text}`);
  if (JSON.stringify(JSON.parse(result.content[0].text)) !== JSON.stringify(result.structuredContent)) fail(`${name}: text and structure differ`);
  results[name] = { items: checkSums(result.structuredContent), ...result.structuredContent };
  return result.structuredContent;
}
const found = await call('find_objects', {});
const first = found?.objects[0];
if (first) {
  await call('where_last_seen', { id: first.id });
  await call('why', { id: first.id });
  await call('what_changed', { since_s: 0 });
  await call('never_seen', { near: first.position_m.slice(0, 2), radius_m: 30 });
} else fail('the map has no object');

// Corrections, if the server takes them: one that lowers the probability, and its withdrawal.
if (first && tools.some((t) => t.name === 'correct')) {
  const made = await call('correct', { object: first.id, kind: 'not_there', nats: 2.5, author: 'Ada' });
  if (made?.object.evidence.person?.log_odds !== -2.5 || made.correction.author !== 'Ada') fail(`a correction: ${JSON.stringify(made)}`);
  const after = await call('correct', { withdraw: made?.correction.id });
  if (after?.object.probability !== first.probability) fail(`a withdrawn correction: ${after?.object.probability}, before ${first.probability}`);
} else if (!(await client.callTool({ name: 'correct', arguments: {} }).then(() => false, (error) => error.code === -32602))) fail('corrections are taken');

const refused = await client.callTool({ name: 'why', arguments: { id: 'x' } });
if (!refused.isError) fail('a wrong argument is accepted');
await client.callTool({ name: 'no_such_tool', arguments: {} }).then(() => fail('an unknown tool is accepted'),
  (error) => { if (error.code !== -32602) fail(`unknown tool: ${error}`); });
await client.request({ method: 'resources/list' }, require('@modelcontextprotocol/sdk/types.js').EmptyResultSchema)
  .then(() => fail('an unknown method is accepted'), (error) => { if (error.code !== -32601) fail(`unknown method: ${error}`); });
// A request that the client cancels is answered late, which the client must ignore; the next one works.
client.onerror = (error) => { if (!error.message.includes('unknown message ID')) fail(`error: ${error.message}`); };
const cancel = new AbortController();
const late = client.callTool({ name: 'find_objects', arguments: {} }, undefined, { signal: cancel.signal }).catch(() => {});
cancel.abort();
await late;
await client.ping();
await client.close();
console.log(JSON.stringify({ problems, server: client.getServerVersion()?.name, agreed, tools: tools.map((t) => t.name), results }));
process.exit(problems.length > 0 ? 1 : 0);
