// Names and colours of the displayed data.

const COLOURS = {
  car: '#388ee0', van: '#14b4b8', truck: '#3c6eb4', bus: '#6e6edc', person: '#f58c32', bicycle: '#50b45a',
  cyclist: '#50b45a', motorcycle: '#af7341', chair: '#966ee1', 'dining table': '#b98755', monitor: '#1eaa82',
  couch: '#e15f55', toy: '#e1b428', other: '#969696',
};
const FURTHER = ['#96aa3c', '#5a96aa', '#cd7369', '#7882be', '#bea064', '#64aa82'];

export function colourOf(name) {
  if (COLOURS[name]) return COLOURS[name];
  let hash = 7;
  for (const c of name) hash = (hash * 31 + c.codePointAt(0)) >>> 0;
  return FURTHER[hash % FURTHER.length];
}

const FRESH = [0x3f, 0xb9, 0x50], LATER = [0xd2, 0x99, 0x22], OLD = [0xf8, 0x51, 0x49], SOME_S = 10, LATER_S = 600, OLD_S = 3600;
/** Returns the colour of what was seen `age` seconds ago; undefined or negative: not known when. */
export function colourOfAge(age) {
  if (!(age >= 0)) return '#7a6bb0';
  const mixed = (from, to, t) => `rgb(${from.map((c, k) => Math.round(c + Math.min(1, Math.max(0, t)) * (to[k] - c))).join()})`;
  const t = (low, high) => Math.log(Math.max(age, SOME_S) / low) / Math.log(high / low);
  return age < LATER_S ? mixed(FRESH, LATER, t(SOME_S, LATER_S)) : mixed(LATER, OLD, t(LATER_S, OLD_S));
}

export const TRUE_COLOUR = '#ff6ad5';
export const isHidden = (o) => o.visibility === 'occluded';
export const isInSight = (o) => o.visibility === 'visible' || o.visibility === 'partial';
/** Returns the object's class for the style sheet. */
export const looksLike = (o) => (isHidden(o) ? 'hidden' : isInSight(o) ? 'seen' : 'away');

export const percent = (p) => (p > 0.9995 ? '100 %' : p >= 0.0995 ? `${(100 * p).toFixed(1)} %` : p >= 0.001 ? `${(100 * p).toFixed(2)} %` : p > 0 ? '< 0.1 %' : '0 %');
const observations = (n) => (n === 1 ? '1 observation' : `${n} observations`);
const hypotheses = (n) => (n === 1 ? '1 hypothesis' : `${n} hypotheses`);
const times = (n) => (n === 1 ? 'once' : `${n} times`);

/** Returns a sentence about a kind of evidence for existence. */
export function existenceWords(kind, n) {
  const words = {
    prior: 'before its first box: few boxes are new objects',
    hit: `detected in ${observations(n)}`,
    repeated: `detected in ${observations(n)} more from the same place: little weight`,
    miss: `not detected in ${observations(n)} of its place`,
    screened: 'correction of these: an object that is not on the map may have occluded it',
    hidden: `${observations(n)} not used: it was occluded`,
    away: `${observations(n)} not used: it was out of view`,
    time: 'time passed: objects leave',
    misshapen: `${hypotheses(n)} removed: no longer of the size of their class`,
    lost: `${hypotheses(n)} removed: that it left without being seen`,
    shared: "its first box may have been another object's",
    merge: `merged ${times(n)} with an object that was the same`,
    restore: `back from a restart ${times(n)}: evidence from before this ledger`,
    recall: `back from the map ${times(n)}: evidence from before this ledger`,
    person: `stated by people ${times(n)}`,
  };
  return words[kind] ?? kind;
}

export function classWords(kind) {
  const words = {
    prior: 'how frequent the two are',
    activation: 'activations of the network in its boxes',
    geometry: 'how well size and place explain the boxes',
    miss: 'observations without a detection',
    motion: 'whether it moves',
    pruning: 'hypotheses that were removed',
    merge: 'merged objects',
    restore: 'evidence from before this ledger',
    context: 'objects near it',
    person: 'stated by people',
  };
  return words[kind] ?? kind;
}

export function visibilityWords(o) {
  if (o.visibility === 'visible') return 'in full sight';
  if (o.visibility === 'partial') return `partly in sight (${Math.round(100 * (o.fraction ?? 0))} %)`;
  if (o.visibility === 'occluded') return 'hidden';
  if (o.visibility === 'out_of_view') return 'out of view';
  if (o.visibility === 'behind') return 'behind the camera';
  return o.visibility ?? 'not known';
}

/** Groups of events for the filter. Other events are in the group of objects. */
export const KINDS = {
  occluded: 'sight', reappeared: 'sight', left_view: 'sight', predicted_return: 'return', loop_closed: 'map', loop_withdrawn: 'map', relocalised: 'map',
};

/** Events of the whole map, with the colours of their marks. */
export const MARKS = { loop_closed: '#c58cff', relocalised: '#9fe5bf', loop_withdrawn: '#ff8f88' };

/** Styles of the map's loops; the gateway uses the same colours. */
export const LOOPS = {
  confirmed: { colour: '#c58cff', dashed: false, words: 'A place was recognised, and the map uses the loop.' },
  tie: { colour: '#40bfad', dashed: false, words: 'The place was tied to the map by objects that still had their ids.' },
  tentative: { colour: '#f5bf40', dashed: true, words: 'A place may have been recognised. The map does not use the loop, or not yet.' },
  withdrawn: { colour: '#ff8f88', dashed: true, words: 'Later loops contradict it. It was retracted, and the objects that it merged are separate again.' },
};
export const lookOfLoop = (loop) => (loop.state !== 'confirmed' ? loop.state : loop.kind === 'tie' ? 'tie' : 'confirmed');

export const wordsOf = (o) => `${o.class} ${o.id}`;

/** Escapes a text for HTML. */
export const escaped = (text) => String(text).replace(/[&<>"']/g, (c) => `&#${c.codePointAt(0)};`);

/** Returns the caption of an image that is `older` seconds older than the objects. */
export function wordsOfImage(state, older) {
  const old = older > 0.5 ? `${older.toFixed(1)} s before the objects that are shown` : '';
  if (state === 'lost' || state === 'stale') return old ? `the last image, ${old}` : 'the last image';
  return old ? `the image is of ${old}` : '';
}

/** Returns the text in place of an image. `recorded`: falsy for live data; "without": a recording
    without images; "empty": no image so far. */
export function wordsOfNoImage(state, { recorded, openFor, heard }) {
  if (recorded === 'without') return 'the recording has no images: perdure record --images keeps them';
  if (recorded || state === 'lost' || state === 'connecting' || openFor < 3) return 'no image yet';
  const none = 'No image since this page was opened';
  if (!heard) return `${none}: no data from capture.`;
  return state === 'stale' ? `${none}: the camera has stopped.` : `${none}: is the camera in image.cameras of the gateway?`;
}

/** Returns the standard deviations [x, y, z, yaw] of the body in the map; empty: unknown. */
export function wordsOfPlace(sigma) {
  return sigma.length > 0 ? `${Math.max(sigma[0], sigma[1]).toFixed(2)} m` : 'not known';
}

/** Returns a time of the sensor clock as text. `origin`: start of a recording, otherwise 0. */
export function wordsOfTime(seconds, origin) {
  const kDay = 86400;
  if (origin || seconds < 1000 * kDay) return `${(seconds - origin).toFixed(1)} s`;
  const day = new Date(1000 * seconds); // the sensor clock has the time of day
  return `${day.toTimeString().slice(0, 8)}.${Math.floor(day.getMilliseconds() / 100)}`;
}
