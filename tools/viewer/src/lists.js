// The searchable list of objects, the log of events, and the state of services.
import { KINDS, colourOf, escaped, looksLike, percent, visibilityWords, wordsOfTime } from './words.js';

const MOST_ROWS = 400;

export class ObjectList {
  constructor(body, note, search, model, onChoose) {
    Object.assign(this, { body, note, search, model, onChoose });
    this.rows = new Map();
    body.addEventListener('click', (e) => {
      const row = e.target.closest('tr');
      if (row) onChoose(Number(row.dataset.id));
    });
    body.addEventListener('focusin', (e) => {
      const id = Number(e.target.closest('tr')?.dataset.id);
      if (id && id !== this.model.chosen && e.target.matches(':focus-visible')) onChoose(id, { reveal: false, open: false });
    });
  }

  distance(o) {
    const b = this.model.frame?.body ?? [0, 0, 0], at = this.model.placeInW(o);
    return at ? Math.hypot(at[0] - b[0], at[1] - b[1]) : Infinity;
  }

  /** Returns whether every word occurs in the description of object `o`. */
  matches(o, words, onlyMap) {
    if (this.model.answer?.objects) return this.model.answer.objects.has(o.id);
    const text = `${o.class} ${o.id} ${onlyMap ? 'remembered map' : visibilityWords(o)} ${this.model.isProvisional(o.id) ? 'provisional' : ''} ${o.elsewhere ? 'elsewhere' : ''} ${o.confirmed ? 'confirmed' : 'unconfirmed'} ${(o.moving ?? 0) >= 0.5 ? 'moving' : ''}`.toLowerCase();
    const tokens = text.split(/\s+/);
    return words.every((w) => (/^\d+$/.test(w) ? w === String(o.id) : tokens.some((t) => t.startsWith(w))));
  }

  found() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const asked = words.some((w) => 'unconfirmed'.startsWith(w) && w.length > 3);
    const here = [...this.model.objects.values()].filter((o) => (o.confirmed || asked || this.model.answer?.objects || o.id === this.model.chosen) && this.matches(o, words, false));
    const left = [...this.model.remembered.values()].filter((o) => !this.model.objects.has(o.id) && this.matches(o, words, true));
    const rank = { seen: 0, hidden: 1, away: 2 };
    here.sort((a, b) => rank[looksLike(a)] - rank[looksLike(b)] || this.distance(a) - this.distance(b));
    left.sort((a, b) => (a.elsewhere || b.elsewhere ? Number(a.elsewhere) - Number(b.elsewhere) : this.distance(a) - this.distance(b)));
    return [here, left];
  }

  render() {
    const [here, left] = this.found();
    const all = [...here, ...left], shown = all.slice(0, MOST_ROWS);
    this.order = shown.map((o) => o.id);
    const seen = here.filter((o) => looksLike(o) === 'seen').length, hidden = here.filter((o) => looksLike(o) === 'hidden').length;
    this.note.textContent = this.model.answer?.note ?? (all.length === 0
      ? (this.search.value ? 'No match here; "whole map" searches the map.' : 'No objects yet.')
      : `${seen} in sight, ${hidden} hidden, ${here.length - seen - hidden} out of view, ${left.length} on the map only${this.model.elsewhere > 0 ? `; ${this.model.elsewhere} of earlier sessions: where they are from here is not known yet` : ''}`);
    const wanted = new Set(this.order);
    for (const [id, row] of this.rows) {
      if (wanted.has(id)) continue;
      row.remove();
      this.rows.delete(id);
    }
    let at = this.body.firstElementChild;
    for (const o of shown) {
      const row = this.row(o);
      if (row === at) at = at.nextElementSibling;
      else this.body.insertBefore(row, at);
    }
  }

  row(o) {
    let row = this.rows.get(o.id);
    if (!row) {
      row = document.createElement('tr');
      row.dataset.id = o.id;
      row.tabIndex = 0;
      row.innerHTML = '<td class="what"><i></i><span></span></td><td class="dim"></td><td><span class="bar" title="exists"><b></b></span></td><td class="n"></td>';
      this.rows.set(o.id, row);
    }
    const only = !this.model.objects.has(o.id), look = only ? 'away' : looksLike(o);
    const [what, where, bar, far] = row.children;
    const put = (node, text) => { if (node.textContent !== text) node.textContent = text; };
    put(what.lastElementChild, `${o.class} ${o.id}`);
    const provisional = this.model.isProvisional(o.id);
    put(where, o.elsewhere ? 'elsewhere' : only ? (provisional ? 'provisional' : 'on the map') : look === 'seen' && o.visibility === 'partial' ? 'partly' : { seen: 'in sight', hidden: 'hidden', away: 'out of view' }[look]);
    put(far, o.elsewhere ? '?' : `${this.distance(o).toFixed(1)} m`);
    bar.firstElementChild.firstElementChild.style.width = `${Math.round(100 * o.r)}%`;
    bar.firstElementChild.title = `exists: ${percent(o.r)}`;
    row.style.setProperty('--c', colourOf(o.class));
    if (row.className !== look) row.className = look;
    row.setAttribute('aria-selected', String(o.id === this.model.chosen));
    return row;
  }

  /** Returns the id of the object `step` rows after the selected one. */
  next(step) {
    if (!this.order?.length) return 0;
    const at = this.order.indexOf(this.model.chosen);
    return this.order[at < 0 ? (step > 0 ? 0 : this.order.length - 1) : Math.min(this.order.length - 1, Math.max(0, at + step))];
  }

  reveal() {
    const row = this.rows.get(this.model.chosen);
    row?.scrollIntoView({ block: 'nearest' });
    if (this.body.contains(document.activeElement)) row?.focus();
  }
}

const FLIP_S = 1; // shorter changes of visibility are not listed

export class EventLog {
  constructor(list, filter, model, onLink, onPlace) {
    Object.assign(this, { list, filter, model });
    list.addEventListener('keydown', (e) => { if (e.key === 'Enter') (e.target.querySelector('[data-object]') ?? e.target).click(); });
    list.addEventListener('click', (e) => {
      const link = e.target.closest('[data-object]'), place = e.target.closest('[data-at]');
      if (link) onLink(Number(link.dataset.object));
      else if (place) onPlace(place.dataset.at.split(',').map(Number));
    });
    filter.addEventListener('click', (e) => {
      if (!e.target.dataset.group) return;
      e.target.setAttribute('aria-pressed', String(e.target.getAttribute('aria-pressed') !== 'true'));
      this.applyFilter();
    });
    this.clear();
  }

  clear() {
    this.list.innerHTML = '<li class="empty">No events yet.</li>';
    this.newest = new Map(); // "group object" → {line, time, event} of the newest event
  }

  hides(group) { return this.list.classList.contains(`without-${group}`); }

  applyFilter() {
    for (const button of this.filter.children) this.list.classList.toggle(`without-${button.dataset.group}`, button.getAttribute('aria-pressed') !== 'true');
  }

  /** Removes the line that the event replaces: an earlier prediction, or a short change of visibility. Returns
      whether the event only ends such a change, and needs no line itself. */
  replaces(event, group, time) {
    const before = this.newest.get(`${group} ${event.object_id}`);
    if (!before) return false;
    const flips = group === 'sight' && time - before.time < FLIP_S;
    if (group !== 'return' && !flips) return false;
    before.line.remove();
    return flips && before.event === 'occluded' && event.event === 'reappeared';
  }

  add(event) {
    this.list.querySelector('.empty')?.remove();
    const time = event.timestamp.sec + 1e-9 * event.timestamp.nsec, group = KINDS[event.event] ?? 'object', key = `${group} ${event.object_id}`;
    if (this.replaces(event, group, time)) return void this.newest.delete(key);
    const line = document.createElement('li');
    line.dataset.kind = event.event;
    line.dataset.group = group;
    if (event.at) line.dataset.at = event.at.join();
    if (event.at || event.object_id) line.tabIndex = 0;
    let words = escaped(event.words) + (event.detail ? ` <span class="dim">${escaped(event.detail)}</span>` : '');
    for (const id of new Set([event.object_id, event.other_id])) {
      // Does not link an id's digits inside a number, such as 0.1 s.
      if (id) words = words.replace(new RegExp(`(?<![\\d.])${id}(?!\\.?\\d)`), `<a data-object="${id}">${id}</a>`);
    }
    line.innerHTML = `<time>${wordsOfTime(time, this.model.origin)}</time><span>${words}</span>`;
    this.newest.set(key, { line, time, event: event.event });
    this.prepend(line);
  }

  /** Adds a sentence of the gateway, for example that events were lost. */
  say(sentence) {
    const line = document.createElement('li');
    line.className = 'said';
    line.textContent = sentence;
    this.prepend(line);
  }

  prepend(line) {
    this.list.prepend(line);
    while (this.list.childElementCount > 500) this.list.lastElementChild.remove();
  }
}

export function renderServices(element, health) {
  const open = new Set([...element.querySelectorAll('details[open]')].map((d) => d.dataset.process));
  const articles = health.services.map((s) => {
    if (s.stood_in_for) return `<article data-state="ok"><h3>${escaped(s.process)} <span class="dim">stood in for</span></h3><p>${escaped(s.message)}</p></article>`;
    const silent = s.age_s > 2.5;
    const reasons = Object.entries(s.reasons).map(([name, n]) => `<span>${escaped(name)}</span><span>${n}</span>`).join('');
    const cpu = s.cpu >= 0 ? `${(100 * s.cpu).toFixed(0)} % CPU, ` : '';
    return `<article data-state="${silent ? 'silent' : s.state}"><h3>${escaped(s.process)} <span class="dim">${silent ? `silent for ${Math.round(s.age_s)} s` : s.state}</span></h3>
      ${s.message ? `<p>${escaped(s.message)}</p>` : ''}
      <p class="figures">${s.rate_hz.toFixed(1)} Hz, in ${s.frames_in}, out ${s.frames_out}, dropped ${s.dropped}; ${cpu}${s.rss_mb.toFixed(0)} MB</p>
      ${reasons ? `<details data-process="${escaped(s.process)}"${open.has(s.process) ? ' open' : ''}><summary>counted</summary><div class="reasons">${reasons}</div></details>` : ''}</article>`;
  });
  element.innerHTML = articles.join('') || '<p class="empty">No data from services.</p>';
}

/** Parses a query: a number, "near 30" (m around the vehicle), "at 12 -40 30", or a class. */
export function questionOf(text, model) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean), numbers = words.slice(1).map(Number);
  if (words.length === 0) return {};
  if (/^\d+$/.test(words[0])) return { id: Number(words[0]) };
  if (numbers.every(Number.isFinite)) {
    const body = model.bodyInM();
    if (words[0] === 'near' && numbers.length < 2) return { near: body, radius: numbers[0] ?? 30 };
    if (words[0] === 'at' && numbers.length >= 2) return { near: [numbers[0], numbers[1], body[2]], radius: numbers[2] ?? 30 };
  }
  return { class: words.join(' ') };
}
