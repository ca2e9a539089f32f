// The time line: a row for each object with its visibility over time, marks of events, and the shown
// time, which can be dragged. It covers a whole recording, or the last minute of live data.
import { PAST_S, STEP_S } from './past.js';
import { roundUp } from './plots.js';
import { KINDS, colourOf, looksLike, wordsOf, wordsOfTime } from './words.js';

const LOOKS = ['', 'seen', 'hidden', 'away', 'gone'], WORDS = ['', 'in sight', 'hidden', 'out of view', 'gone'];
const PALETTE = [0, 0xfff2b46f, 0xff4dc9ff, 0xff68523c, 0xff5d62f0]; // ABGR
const MARKS = { object: '#8fb8de', sight: '#ffc94d', return: '#8b9aa8', map: '#c58cff' };
const CELLS = 1000, MOST_MARKS = 1000, GAP_S = 1.5, NAMES_PX = 96, EDGE_PX = 8, CLICK_PX = 4, SNAP_PX = 5;

export class TimeLine {
  /** `bar` has the shown time and seeks; `hides(group)` returns whether events of a group are hidden. */
  constructor(element, model, connection, bar, hides, choose) {
    Object.assign(this, { element, model, connection, bar, hides });
    [this.axis, this.rows, this.head] = ['axis', 'rows', 'playhead'].map((id) => document.getElementById(id));
    this.reset();
    this.rows.addEventListener('click', (e) => {
      const row = e.target.closest('button');
      if (row) choose(Number(row.dataset.id));
    });
    element.addEventListener('pointerdown', (e) => {
      this.pressed = { x: e.clientX, drags: e.target === this.axis };
      if (this.pressed.drags) this.drag(e);
    });
    element.addEventListener('pointermove', (e) => {
      if (this.pressed && Math.abs(e.clientX - this.pressed.x) > CLICK_PX) this.pressed.drags = true;
      if (this.pressed?.drags) this.drag(e);
      else if (e.target === this.axis) this.axis.title = this.markAt(e)?.words ?? '';
    });
    for (const end of ['pointerup', 'pointercancel']) element.addEventListener(end, () => { this.pressed = undefined; });
    this.axis.addEventListener('keydown', (e) => this.key(e));
  }

  reset() {
    this.lines = new Map(); // id → {cells, row}
    this.marks = new Map(); // key → {time, group, words}
    this.goneAt = new Map();
    this.column = undefined;
    const { range } = this.connection;
    this.range = range;
    this.count = range ? CELLS : Math.round(PAST_S / STEP_S) + 1;
    this.step = range ? Math.max(0.02, (range.last - range.first) / (CELLS - 1)) : STEP_S;
    this.rows?.replaceChildren();
  }

  /** Returns the first and the last time of the line. */
  span() {
    const { range } = this.connection, end = this.model.newest ?? 0;
    return range ? [range.first, range.last] : [end - PAST_S, end];
  }

  /** Returns the index of a column in `cells`, which are a ring for live data. */
  at(column) { return ((column % this.count) + this.count) % this.count; }

  columnOf(time) { return Math.floor((time - (this.range?.first ?? 0)) / this.step + 1e-6); }

  take(message, time) {
    if (this.range !== this.connection.range) this.reset();
    const column = this.columnOf(time), before = this.column;
    this.column = column;
    const follows = before !== undefined && column >= before && (column - before) * this.step < GAP_S;
    const skipped = follows || this.range ? 0 : column < before || before === undefined ? this.count : Math.min(this.count, column - before);
    const looks = new Map(message.objects.filter((o) => o.confirmed).map((o) => [o.id, LOOKS.indexOf(looksLike(o))]));
    for (const o of message.objects) if (looks.has(o.id) && !this.lines.has(o.id)) this.addRow(o);
    for (const [id, { cells }] of this.lines) {
      const look = looks.get(id) ?? (time >= this.goneAt.get(id) ? 4 : 0);
      for (let c = column - skipped + 1; c < column; ++c) cells[this.at(c)] = 0;
      for (let c = follows ? Math.min(before + 1, column) : column; c <= column; ++c) cells[this.at(c)] = look;
    }
  }

  addRow(o) {
    const row = document.createElement('button'), name = document.createElement('span'), bar = document.createElement('canvas');
    row.dataset.id = o.id;
    row.style.setProperty('--c', colourOf(o.class));
    row.append(name, bar);
    bar.width = this.count;
    bar.height = 1;
    this.rows.prepend(row); // new objects first
    this.lines.set(o.id, { cells: new Uint8Array(this.count), row });
  }

  mark(event, time) {
    if (this.range !== this.connection.range) this.reset();
    if (event.event === 'gone' || event.event === 'merged') this.goneAt.set(event.object_id, time);
    this.marks.set(`${time} ${event.event} ${event.object_id}`, { time, group: KINDS[event.event] ?? 'object', words: `${wordsOfTime(time, this.model.origin)}: ${event.words}` });
    if (this.marks.size > MOST_MARKS) this.marks.delete(this.marks.keys().next().value);
  }

  shownMarks() {
    const [from, to] = this.span();
    return [...this.marks.values()].filter((m) => m.time >= from && m.time <= to && !this.hides(m.group));
  }

  place() {
    const { left, width } = this.axis.getBoundingClientRect();
    return { left: left + NAMES_PX, width: Math.max(1, width - NAMES_PX - EDGE_PX) };
  }

  markAt(e) {
    const [from, to] = this.span(), { left, width } = this.place();
    const off = (m) => Math.abs(left + (width * (m.time - from)) / (to - from) - e.clientX);
    const near = this.shownMarks().filter((m) => off(m) <= SNAP_PX);
    return near.sort((a, b) => off(a) - off(b))[0];
  }

  drag(e) {
    if (!this.element.hasPointerCapture(e.pointerId)) this.element.setPointerCapture(e.pointerId);
    const [from, to] = this.span(), { left, width } = this.place();
    const share = Math.min(1, Math.max(0, (e.clientX - left) / width));
    this.bar.seek(this.markAt(e)?.time ?? from + share * (to - from));
    this.renderTime();
  }

  key(e) {
    const [from, to] = this.span(), step = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
    const time = { Home: from, End: this.range ? to : undefined }, jumps = e.key in time;
    if (!step && !jumps) return;
    this.bar.seek(jumps ? time[e.key] : Math.min(to, Math.max(from, this.bar.time + step)));
    this.renderTime();
    e.preventDefault();
  }

  renderTime() {
    const [from, to] = this.span(), time = this.bar.time ?? from;
    const share = Math.min(1, Math.max(0, (time - from) / Math.max(0.1, to - from)));
    this.head.style.left = `calc(${NAMES_PX}px + ${share} * (100% - ${NAMES_PX + EDGE_PX}px))`;
    this.axis.setAttribute('aria-valuemin', '0');
    this.axis.setAttribute('aria-valuemax', (to - from).toFixed(0));
    this.axis.setAttribute('aria-valuenow', (time - from).toFixed(1));
  }

  render() {
    this.renderTime();
    this.renderAxis();
    if (this.rows.hidden) return;
    const [from] = this.span(), first = this.range ? 0 : this.columnOf(from);
    for (const [id, line] of this.lines) this.renderRow(id, line, first);
    if (this.revealed === this.model.chosen) return;
    this.revealed = this.model.chosen;
    this.lines.get(this.revealed)?.row.scrollIntoView({ block: 'nearest' });
  }

  renderRow(id, { cells, row }, first) {
    const [name, bar] = row.children, o = this.model.find(id);
    const look = cells[this.at(this.columnOf(this.bar.time ?? 0))];
    const text = o ? wordsOf(o) : name.textContent || `object ${id}`;
    if (name.textContent !== text) name.textContent = text;
    row.setAttribute('aria-label', `${text} ${WORDS[look]}`);
    row.setAttribute('aria-pressed', String(id === this.model.chosen));
    const image = new ImageData(this.count, 1), pixels = new Uint32Array(image.data.buffer);
    let drawn = false;
    for (let c = 0; c < this.count; ++c) {
      const code = cells[this.at(first + c)];
      drawn ||= code > 0;
      pixels[c] = PALETTE[code];
    }
    row.hidden = !drawn;
    if (drawn) bar.getContext('2d').putImageData(image, 0, 0);
  }

  renderAxis() {
    const ratio = devicePixelRatio, { clientWidth: w, clientHeight: h } = this.axis, pen = this.axis.getContext('2d');
    if (this.axis.width !== Math.round(w * ratio)) {
      this.axis.width = Math.round(w * ratio);
      this.axis.height = Math.round(h * ratio);
    }
    const [from, to] = this.span(), { width } = this.place(), x = (t) => NAMES_PX + (width * (t - from)) / Math.max(0.1, to - from);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    pen.font = '11px system-ui, "DejaVu Sans", sans-serif';
    pen.fillStyle = '#8b9aa8';
    const step = roundUp(Math.max(1, ((to - from) * 70) / width));
    for (let t = 0; t <= to - from + 1e-6; t += step) {
      const at = this.range ? x(from + t) : x(to - t), words = this.range ? `${t} s` : t === 0 ? 'now' : `−${t} s`;
      pen.fillRect(at, h - 4, 1, 4);
      pen.fillText(words, Math.min(at + 3, w - pen.measureText(words).width - 1), 10);
    }
    for (const m of this.shownMarks()) {
      pen.fillStyle = MARKS[m.group];
      pen.fillRect(x(m.time) - 1, h - 11, 2, 11);
    }
  }
}
