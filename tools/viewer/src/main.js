// Assembles the page. Messages update the model, and the model updates map, lists and panels.
import { CameraView } from './camera.js';
import { Connection } from './connection.js';
import { EventLog, ObjectList, questionOf, renderServices } from './lists.js';
import { wordsOfPart } from './graph_panel.js';
import { Model, timeOf, troubleOf } from './model.js';
import { Link } from './link.js';
import { ObjectPanel } from './object_panel.js';
import { Past } from './past.js';
import { PlaybackBar } from './playback.js';
import { renderPlots } from './plots.js';
import { TimeLine } from './timeline.js';
import { Truth, wordsOfError } from './truth.js';
import { MARKS, escaped, lookOfLoop, wordsOfImage, wordsOfNoImage, wordsOfPlace, wordsOfTime } from './words.js';
import { World } from './world.js';

const $ = (id) => document.getElementById(id);
const model = new Model();
const status = { state: 'connecting', sentence: '' };
const truth = await Truth.load(); // null, but for simulated drives

function addressOfGateway() {
  const address = new URL(location.href);
  address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
  address.hash = '';
  return address.href;
}

const connection = new Connection(addressOfGateway(), (state, sentence) => {
  status.state = state;
  status.sentence = sentence;
});

let world = null;
try {
  world = new World($('canvas'), $('labels'), choose, choosePart);
} catch (error) {
  $('labels').innerHTML = `<p class="empty">This browser draws no WebGL, hence no map: ${escaped(error.message)}</p>`;
}
const past = new Past();
const camera = new CameraView($('camera'), $('image'), $('image-caption'), choose, (time, image) => { if (!connection.range) past.take('image', time, image); });
const list = new ObjectList($('list').tBodies[0], $('list-note'), $('search'), model, choose);
const log = new EventLog($('events'), $('events-filter'), model, chooseLinked, (at) => world?.lookAtPlace(at));
connection.onStatus = (sentence) => log.say(sentence);
const panel = new ObjectPanel($('object'), model, connection, chooseLinked);

const playback = new PlaybackBar($('playback'), connection, model, lookBack);
const timeline = new TimeLine($('timeline'), model, connection, playback, (group) => log.hides(group), choose);
connection.onSeek = () => { model.jumped(); log.clear(); playback.sought(); };

/** Shows an earlier time of live data, and its image; without `time`, the present. */
function lookBack(time) {
  const then = past.at('objects', time ?? Infinity);
  if (!then) return;
  const image = past.at('image', time === undefined ? Infinity : then.time);
  model.past = time === undefined ? undefined : then.time;
  camera.frozen = time !== undefined;
  if (time !== undefined) panel.full = null; // the gateway knows the present only
  model.show(then.value);
  world?.setObjects(model);
  if (image && image.value.view !== camera.shown?.view) camera.show(image.time, image.value).catch((e) => console.warn(`image: ${e.message}`));
  showState();
}

let linked = 0; // the id of the last link, until an object is selected
function choose(id, { reveal = true, open = true } = {}) {
  linked = 0;
  world?.choosePart(undefined);
  wished.object = undefined;
  model.chosen = id;
  world?.choose(id);
  camera.choose(id);
  panel.show(id);
  list.render();
  if (id !== 0) {
    if (reveal) list.reveal();
    if (open && document.activeElement !== $('search')) openTab('object');
    panel.ask();
  }
}

/** Returns the id of the object to which `id` belongs now: people or the map may have joined it to
    another one. */
async function presentId(id) {
  if (model.find(id)) return id;
  const { objects } = await connection.call('/map/query', { id }).catch(() => ({}));
  return objects?.[0]?.id ?? id;
}
async function chooseLinked(id) {
  linked = id;
  const present = await presentId(id);
  if (linked === id) choose(present); // otherwise there is a newer selection
}

/** Selects an anchor or a loop of the map's graph: {kind, id}. */
function choosePart(part) {
  choose(0);
  world?.choosePart(part);
  panel.showPart(() => wordsOfPart(part, model.graph));
  openTab('object');
}
$('object').addEventListener('click', (e) => {
  const link = e.target.closest('[data-part]');
  if (link) choosePart({ kind: link.dataset.part, id: Number(link.dataset.id) });
});

function openTab(name) {
  for (const tab of document.querySelectorAll('[role=tab]')) tab.setAttribute('aria-selected', String(tab.dataset.tab === name));
  for (const part of document.querySelectorAll('[data-panel]')) part.hidden = part.dataset.panel !== name;
  if (name === 'object') panel.ask();
}

// Incoming messages.
let cameraTopic = '';
function lookThroughCamera() {
  const first = [...connection.channels.values()].find((c) => c.schemaName === 'foxglove::CompressedImage');
  if (!first || cameraTopic || !showsCamera) return;
  cameraTopic = first.topic;
  connection.on(cameraTopic, (view) => camera.takeImage(view).catch((e) => console.warn(`image: ${e.message}`)));
  connection.on(overlayTopic(), (m) => camera.takeAnnotations(m));
}
const overlayTopic = () => cameraTopic.replace(/image$/, camera.likelihood ? 'likelihood' : 'annotations');
let showsCamera = true;

connection.on('/objects', (message) => {
  if (model.takeObjects(message, performance.now())) {
    past.clear();
    camera.frozen = false;
  }
  if (!connection.range) past.take('objects', model.newest, message);
  timeline.take(message, model.newest);
  if (model.past === undefined) world?.setObjects(model);
});
connection.on('/trajectory', (message) => world?.setWay(message.poses));
connection.on('/tf', ({ transforms }) => world?.setEarth(transforms.find((t) => t.child_frame_id === 'enu')));
connection.on('/landmarks', (message) => world?.setPoints(message));
connection.on('/map', (message) => {
  model.takeMap(message);
  world?.syncRemembered(model);
});
connection.on('/map/frame', (message) => {
  model.mapFrame = message;
  world?.setMapFrame(model.T_MW());
});
function takeGraph(message) {
  model.graph = message;
  world?.setGraph(message);
  showLegendOfGraph();
}
function showLegendOfGraph() {
  const shown = Boolean(world?.shows.graph && model.graph?.anchors.length), looks = new Set(model.graph?.loops.map(lookOfLoop));
  if (model.graph?.anchors.some((a) => !a.sigma.length)) looks.add('unknown');
  for (const item of document.querySelectorAll('#legend [data-graph]')) item.hidden = !shown || (item.dataset.graph !== 'anchor' && !looks.has(item.dataset.graph));
  const none = model.graph && !model.graph.anchors.length ? ` ${model.graph.why_none}` : '';
  const part = model.graph?.truncated ? ` The nearest ${model.graph.anchors.length} anchors of ${model.graph.all_anchors}.` : '';
  document.querySelector('[data-key=g]').title = `Graph of the map: anchors and loops (G).${none}${part}`;
}
const takeSeen = (message) => world?.setSeen(message, model.time);
connection.on('/map/graph', takeGraph);
connection.on('/events', (event) => {
  log.add(event);
  timeline.mark(event, timeOf(event));
  if (event.at && MARKS[event.event]) world?.addMark(event.at, MARKS[event.event], `${event.world}/${event.epoch}`);
});
connection.on('/health', (health) => {
  model.takeHealth(health);
  $('vehicle').textContent = health.vehicle;
  renderServices($('services'), health);
});

// User queries.
function setAnswer(objects, note) {
  if (note) model.takeAnswer(objects, note);
  else model.answer = null;
  $('ask-map').setAttribute('aria-pressed', String(Boolean(objects)));
  world?.syncRemembered(model);
  list.render();
}
$('search').addEventListener('input', () => setAnswer());
$('ask-map').addEventListener('click', () => (model.answer?.objects ? setAnswer() : askMap()));
async function askMap() {
  const word = $('search').value.trim();
  const request = questionOf(word, model);
  $('list-note').textContent = 'Waiting for the map …';
  try {
    const reply = await connection.call('/map/query', request);
    const many = reply.truncated ? ', and there are more' : '';
    setAnswer(reply.objects, reply.objects.length === 0 ? `The map has no object ${'near' in request ? 'there' : `"${word}"`}.` : `The map has ${reply.objects.length}${many}.`);
  } catch (error) {
    setAnswer(null, `The map does not answer: ${error.message}`);
  }
}

// Keys and buttons.
const toggles = {
  f: () => { world?.setFollow(!world.follow); return world?.follow; },
  t: () => { world?.fromAbove(); return undefined; },
  e: () => world?.toggle('ellipsoids'),
  l: () => world?.toggle('points'),
  m: () => world?.toggle('map'),
  g: () => {
    const on = world?.toggle('graph');
    if (on) connection.on('/map/graph', takeGraph);
    else connection.off('/map/graph'); // a hidden view needs no data
    showLegendOfGraph();
    return on;
  },
  s: () => {
    const on = world?.toggle('seen');
    if (on) connection.on('/map/seen', takeSeen);
    else connection.off('/map/seen'); // a hidden view needs no data
    for (const item of document.querySelectorAll('#legend [data-seen]')) item.hidden = !on;
    return on;
  },
  u: () => truth?.toggle(model, world),
  c: () => {
    showsCamera = !showsCamera;
    $('camera').hidden = !showsCamera;
    if (showsCamera) lookThroughCamera();
    else if (cameraTopic) {
      connection.off(cameraTopic); // a hidden view needs no data
      connection.off(overlayTopic());
      cameraTopic = '';
    }
    return showsCamera;
  },
  b: () => {
    if (cameraTopic) connection.off(overlayTopic());
    camera.showLikelihood(!camera.likelihood);
    if (cameraTopic) connection.on(overlayTopic(), (m) => camera.takeAnnotations(m));
    return camera.likelihood;
  },
  i: () => { camera.enlarge(); return undefined; },
  r: () => {
    $('rows').hidden = !$('rows').hidden;
    timeline.render();
    return !$('rows').hidden;
  },
};
function toggle(key) {
  const on = toggles[key]();
  if (on !== undefined) document.querySelector(`[data-key=${key}]`).setAttribute('aria-pressed', String(on));
}
if (world) world.onFollow = (on) => document.querySelector('[data-key=f]').setAttribute('aria-pressed', String(on));
for (const bar of ['tools', 'time-head']) $(bar).addEventListener('click', (e) => { if (e.target.dataset.key) toggle(e.target.dataset.key); });
document.querySelector('nav').addEventListener('click', (e) => { if (e.target.dataset.tab) openTab(e.target.dataset.tab); });
$('state').addEventListener('click', () => openTab('services'));
$('help-button').addEventListener('click', () => $('help').showModal());

document.addEventListener('keydown', (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || $('help').open) return;
  const typing = e.target === $('search');
  const step = { ArrowDown: 1, ArrowUp: -1 }[e.key];
  if (step) {
    const id = list.next(step);
    if (id) choose(id);
  } else if (e.key === 'Enter' && e.target.matches('button, li')) {
    return; // the focused element handles it
  } else if (e.key === 'Enter' && model.chosen) {
    world?.lookAt(model.chosen);
    if (typing) openTab('object');
  } else if (e.key === 'Enter' && typing) {
    const id = list.next(1);
    if (id) choose(id); else askMap();
  } else if (e.key === 'Escape') {
    if (camera.figure.classList.contains('large')) camera.enlarge(false);
    else if (typing && $('search').value) { $('search').value = ''; setAnswer(); } else { $('search').blur(); choose(0); openTab('objects'); }
  } else if (typing) {
    return;
  } else if (e.key === '/') {
    openTab('objects');
    $('search').focus();
  } else if (e.key === ' ' && e.target.tagName !== 'BUTTON') {
    playback.toggle();
  } else if (e.key.toLowerCase() === 'n') {
    playback.onward();
  } else if (e.key === '?') {
    $('help').showModal();
  } else if (toggles[e.key.toLowerCase()]) {
    toggle(e.key.toLowerCase());
  } else if ('12345'.includes(e.key)) {
    openTab(['objects', 'object', 'events', 'services', 'plots'][e.key - 1]);
  } else return;
  e.preventDefault();
});

// Updates of the display.
function figures(now) {
  const frame = model.frame, items = [];
  const stands = connection.range && connection.playback?.status !== 'playing';
  if (frame) items.push(['time', wordsOfTime(model.time, model.origin), ''], ['objects', [...model.objects.values()].filter((o) => o.confirmed).length, '']);
  const map = model.mapFrame;
  if (frame && model.truth) items.push(['error', wordsOfError(truth.errorsOfBody(model.drive.slice(-1))), 'minor']);
  if (frame && map) items.push(['sessions', map.sessions, 'minor'], ['loops', map.loops, 'minor'], ['σ in map', wordsOfPlace(map.body_sigma), 'minor']);
  if (frame) items.push(['rate', stands ? '–' : `${model.rate(now).toFixed(0)} Hz`, 'minor'], ['latency', frame.latency_ms >= 0 && model.silentFor(now) < 2 ? `${frame.latency_ms.toFixed(0)} ms` : '–', 'minor']);
  return items.map(([k, v, c]) => `<div class="${c}"><dt>${k}</dt><dd>${v}</dd></div>`).join('');
}

/** Returns the caption of the image, or the text shown instead of an image. */
function captionOf(state) {
  if (camera.figure.classList.contains('has-image')) {
    return wordsOfImage(state, model.time - camera.shownTime);
  }
  const recorded = connection.range && (cameraTopic ? 'empty' : 'without');
  const capture = model.health?.services.find((s) => s.process === 'capture');
  return wordsOfNoImage(state, { recorded, openFor: (performance.now() - openedAt) / 1000, heard: capture?.stood_in_for || capture?.age_s < 2.5 });
}
const openedAt = performance.now();

let stateAt = 0;
function showState() {
  model.origin = connection.range?.first ?? 0;
  const now = performance.now();
  if (now - stateAt > 1500) model.stoodStill(now);
  stateAt = now;
  const [state, sentence] = troubleOf(model, { ...status, playback: connection.playback }, now);
  playback.render();
  timeline.render();
  const words = { live: 'live', degraded: 'degraded', stale: 'no data', played: connection.playback?.status ?? '', lost: 'no connection', connecting: 'connecting' };
  $('state').dataset.state = model.past === undefined ? state : 'stale';
  $('state').textContent = model.past === undefined ? words[state] : 'paused';
  document.body.dataset.state = state;
  $('trouble').hidden = !sentence;
  $('trouble').classList.toggle('bad', state === 'lost');
  if ($('trouble').textContent !== sentence) $('trouble').textContent = sentence;
  $('figures').innerHTML = figures(now);
  if (!cameraTopic) lookThroughCamera();
  camera.caption.textContent = captionOf(state);
}

function refresh() {
  if (now4(4)) {
    if (!document.querySelector('[data-panel=objects]').hidden) list.render();
    if (!document.querySelector('[data-panel=object]').hidden && (model.chosen || panel.part)) panel.part ? panel.renderPart() : panel.render();
    grant();
    model.truth?.show(model, world);
    if (!document.querySelector('[data-panel=plots]').hidden) renderPlots($('plots'), model);
    showState();
    link.write();
  }
  world?.draw();
  requestAnimationFrame(refresh);
}
let last4 = 0;
/** Returns true `rate` times a second. */
function now4(rate) {
  const now = performance.now();
  if (now - last4 < 1000 / rate) return false;
  last4 = now;
  return true;
}

// The state of the page in its address. `wished` has what waits for data: an object, a time.
const LAYERS = ['f', 'e', 'l', 'm', 'g', 's', 'u', 'c', 'b', 'r'];
const isOn = (key) => document.querySelector(`[data-key=${key}]`).getAttribute('aria-pressed') === 'true';
if (matchMedia('(max-width: 760px)').matches) toggle('r');
const listed = () => [...$('events-filter').children].filter((b) => b.getAttribute('aria-pressed') === 'true').map((b) => b.dataset.group).join();
const usualEvents = listed();
const usual = Object.fromEntries(LAYERS.map((key) => [key, isOn(key)]));
const wished = {};
const link = new Link(() => {
  const { orbit, follow } = world ?? {}, { range } = connection;
  const view = orbit && !follow && [...orbit.target.toArray(), orbit.azimuth, orbit.polar, orbit.distance].map((x) => x.toFixed(2)).join();
  return {
    object: wished.object ?? (model.chosen || undefined),
    tab: [...document.querySelectorAll('[role=tab]')].find((t) => t.getAttribute('aria-selected') === 'true' && t.dataset.tab !== 'objects')?.dataset.tab,
    search: $('search').value,
    layers: LAYERS.filter((key) => isOn(key) !== usual[key]).join(''),
    events: listed() === usualEvents ? undefined : listed() || 'none',
    view: view || undefined,
    t: wished.t ?? (range && !playback.plays ? (playback.time - range.first).toFixed(2) : undefined),
  };
}, (state) => {
  for (const key of LAYERS) if (isOn(key) !== (usual[key] !== (state.layers ?? '').includes(key))) toggle(key);
  const events = (state.events ?? usualEvents).split(',');
  for (const b of $('events-filter').children) if ((b.getAttribute('aria-pressed') === 'true') !== events.includes(b.dataset.group)) b.click();
  $('search').value = state.search ?? '';
  const view = (state.view ?? '').split(',').map(Number);
  if (world && view.length === 6 && view.every(Number.isFinite)) {
    world.lookAtPlace(view.slice(0, 3));
    [world.orbit.azimuth, world.orbit.polar, world.orbit.distance] = view.slice(3);
  }
  wished.object = Number(state.object) || undefined;
  wished.t = state.t;
  if (document.querySelector(`[data-panel="${CSS.escape(state.tab ?? '')}"]`)) openTab(state.tab);
});
/** Restores what had to wait for data. */
function grant() {
  const { range } = connection;
  if (wished.t !== undefined && range) {
    playback.seek(range.first + Number(wished.t), false);
    wished.t = undefined;
  }
  if (!wished.object) return;
  if (model.find(wished.object)) choose(wished.object, { open: false });
  else if (wished.asked !== wished.object && model.mapFrame) {
    const asked = (wished.asked = wished.object);
    presentId(asked).then((id) => { if (wished.object === asked) wished.object = id; });
  }
}
link.open();

// The state of the page, which tests read.
window.perdure = { model, world, camera, connection, choose, choosePart, lookBack, timeline, playback, opened: performance.now() };
refresh();
