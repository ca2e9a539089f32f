// Shows all data of one object. While open, requests them from the gateway twice a second.
import { Corrections } from './corrections.js';
import { chart } from './plots.js';
import { wordsOfError } from './truth.js';
import { classWords, colourOf, escaped, existenceWords, isHidden, isInSight, percent, visibilityWords } from './words.js';

const EVERY_MS = 500;

export class ObjectPanel {
  constructor(element, model, connection, onLink) {
    this.element = element;
    this.model = model;
    this.connection = connection;
    this.onLink = onLink;
    this.id = 0;
    this.part = this.told = null;
    this.corrections = new Corrections(connection);
    element.addEventListener('click', (e) => {
      const link = e.target.closest('[data-object]');
      if (link) onLink(Number(link.dataset.object));
    });
    setInterval(() => this.ask(), EVERY_MS);
    this.clear();
  }

  clear() {
    this.id = 0;
    this.part = this.told = null;
    this.element.innerHTML = '<p class="empty">Click on an object in the map or in the list.</p>';
  }

  /** Shows a part of the map's graph instead of an object. `words` returns its HTML. */
  showPart(words) {
    this.clear();
    this.part = words;
    this.renderPart();
  }

  renderPart() {
    const words = this.part();
    if (words === this.told) return;
    this.told = words;
    this.element.innerHTML = words || '<p class="empty">It is not on the map any more.</p>';
  }

  show(id) {
    this.part = null;
    this.id = id;
    this.full = null;
    this.note = '';
    this.shown = performance.now();
    if (id === 0) return this.clear();
    this.element.innerHTML = '<div></div>';
    this.element.append(this.corrections.element);
    this.corrections.show(id);
    this.render(); // shows the data that are already available
    this.ask();
  }

  async ask() {
    if (this.id === 0 || this.asking || this.model.past !== undefined || this.element.closest('section').hidden) return;
    const id = this.id;
    this.asking = true;
    try {
      const full = await this.connection.call('/object', { id });
      if (id !== this.id) return;
      if (full.object && full.object.id !== id) return this.onLink(full.object.id); // it was joined to another one
      this.note = full.found === false ? 'It is neither in the working set nor on the map any more.' : '';
      if (full.found !== false) this.full = full;
      this.latency ??= performance.now() - this.shown;
      this.render();
    } catch (error) {
      if (id === this.id) this.note = error.message;
    } finally {
      this.asking = false;
      if (id !== this.id) this.ask();
    }
  }

  render() {
    const o = this.model.objects.get(this.id) ?? this.full?.object ?? this.model.find(this.id);
    if (!o) {
      this.element.firstChild.innerHTML = `<p class="empty">${escaped(this.note || 'Waiting for its data …')}</p>`;
      return;
    }
    // Keeps the content while text is being selected.
    if (String(getSelection()).length > 0 && this.element.contains(getSelection().anchorNode)) return;
    const top = this.element.scrollTop;
    this.element.firstChild.innerHTML = this.heading(o) + this.whereWords(o) + this.existenceChart(o) + this.classes() + this.ledger() + this.margins() + this.place(o) + this.covariance();
    this.element.scrollTop = top;
  }

  heading(o) {
    const look = isHidden(o) ? 'hidden' : isInSight(o) ? 'seen' : '';
    const tags = [`<span class="tag ${look}">${escaped(this.model.objects.has(o.id) ? visibilityWords(o) : 'on the map only')}</span>`];
    if (!o.confirmed) tags.push('<span class="tag">not confirmed yet</span>');
    if ((o.moving ?? 0) >= 0.5) tags.push('<span class="tag">moves</span>');
    if (this.model.isProvisional(o.id)) tags.push('<span class="tag hidden" title="This session is not found on the map of before yet: it may be an object of that">provisional</span>');
    if (o.elsewhere) tags.push('<span class="tag">of an earlier session; where it is from here is not known yet</span>');
    if (o.recalled) tags.push('<span class="tag">recalled from the map</span>');
    const note = this.note ? `<p class="dim">${escaped(this.note)}</p>` : '';
    return `<h2 style="--c:${colourOf(o.class)}"><i></i>${escaped(o.class)} ${o.id}</h2>${tags.join('')}${note}
      <div class="big"><div><strong>${percent(o.r)}</strong><span>exists</span></div>
      <div><strong>${percent(o.p)}</strong><span>is a ${escaped(o.class)}</span></div>
      <div><strong>${this.distance(o)}</strong><span>away</span></div></div>`;
  }

  distance(o) {
    const b = this.model.frame?.body, at = this.here(o);
    return b && at ? `${Math.hypot(at[0] - b[0], at[1] - b[1], at[2] - b[2]).toFixed(1)} m` : '–';
  }

  /** Returns the position in W, or null if unknown. Replies of the store, and objects only on the
      map, are converted from M. */
  here(o) {
    return this.model.objects.has(o.id) ? o.c : this.model.placeInW({ memory: 'long_term', ...o, elsewhere: this.model.find(o.id)?.elsewhere });
  }

  whereWords(o) {
    const words = [];
    if (isHidden(o)) {
      const by = this.model.find(o.blocked_by);
      words.push(o.blocked_by ? `It is hidden by <a data-object="${o.blocked_by}">${escaped(by?.class ?? 'object')} ${o.blocked_by}</a>.` : 'Something that is not on the map hides it.');
    }
    const returns = this.full?.returns;
    if (returns && !isInSight(o)) {
      const now = this.model.time ?? returns.said_s;
      const left = returns.in_s.map((s) => Math.max(0, s - (now - returns.said_s)));
      words.push(`It should be seen again in <b>${left[0].toFixed(1)} s</b> (${left[1].toFixed(1)} to ${left[2].toFixed(1)} s).`);
    } else if (this.full && !isInSight(o)) {
      words.push('The next sighting is not predicted.');
    }
    if (o.last_s !== undefined && this.model.time !== undefined && !isInSight(o)) words.push(`Last seen ${Math.max(0, this.model.time - o.last_s).toFixed(1)} s ago.`);
    return words.map((w) => `<p>${w}</p>`).join('');
  }

  existenceChart(o) {
    const own = this.model.history.get(o.id) ?? [];
    const samples = (this.full?.history?.length ?? 0) > 1 && (own.length === 0 || this.full.history[0][0] < own[0][0]) ? this.full.history : own;
    if (samples.length < 2) return '';
    // The background is coloured while the object was not visible.
    const unseen = samples.slice(1).flatMap((s, i) => ((s[3] ?? 1) > 0.05 ? [] : [[samples[i][0], s[0]]]));
    const line = (name, k, colour) => ({ name, colour, samples: samples.map((s) => [s[0], s[k]]) });
    return chart('Existence and class', [line(escaped(o.class), 2, '#8b9aa8'), line('exists', 1, colourOf(o.class))], { high: 1, say: percent, shaded: unseen, cursor: this.model.past });
  }

  classes() {
    const classes = this.full?.classes;
    if (!classes) return '';
    const rows = classes.map((c) => `<span>${escaped(c.class)}</span><span class="bar"><b style="--c:${colourOf(c.class)};width:${(100 * c.p).toFixed(1)}%"></b></span><span class="n">${percent(c.p)}</span>`);
    return `<h3>What it is</h3><div class="pmf">${rows.join('')}</div>`;
  }

  static swing(nats, most) {
    const half = Math.min(50, (50 * Math.abs(nats)) / Math.max(0.5, most));
    return `<span class="swing"><b class="${nats < 0 ? 'less' : ''}" style="${nats < 0 ? 'right:50%' : 'left:50%'};width:${half.toFixed(1)}%"></b></span>`;
  }

  ledger() {
    const rows = Object.entries(this.full?.existence ?? {});
    if (rows.length === 0) return '';
    const most = Math.max(...rows.map(([, e]) => Math.abs(e.nats)));
    const sum = rows.reduce((s, [, e]) => s + e.nats, 0);
    const signed = (n) => (Math.abs(n) < 0.005 ? '0' : `${n > 0 ? '+' : '−'}${Math.abs(n).toFixed(2)}`);
    const lines = rows.map(([kind, e]) => `<tr><td>${ObjectPanel.swing(e.nats, most)}</td><td class="n">${signed(e.nats)}</td><td>${escaped(existenceWords(kind, e.count))}</td></tr>`);
    return `<h3>Evidence that it exists (nats)</h3><table class="ledger">${lines.join('')}
      <tr><td></td><td class="n"><b>${signed(sum)}</b></td><td><b>log-odds: ${percent(1 / (1 + Math.exp(-sum)))}</b></td></tr></table>`;
  }

  /** Explains why the most probable class is more probable than the next one. */
  margins() {
    const [first, second] = this.full?.classes ?? [];
    const ledger = this.full?.ledger ?? {}, ousted = this.full?.ousted;
    let nats, title;
    if (second && ledger[first.class] && ledger[second.class]) {
      const kinds = new Set([...Object.keys(ledger[first.class]), ...Object.keys(ledger[second.class])]);
      nats = [...kinds].map((k) => [k, (ledger[first.class][k] ?? 0) - (ledger[second.class][k] ?? 0)]);
      title = `Why it is a ${first.class} rather than ${second.class}`;
    } else if (ousted) {
      nats = Object.entries(ousted.nats);
      title = `Why ${ousted.class} was replaced by ${ousted.by}`;
    } else return '';
    nats = nats.filter(([, n]) => Math.abs(n) >= 0.005);
    if (nats.length === 0) return '';
    const most = Math.max(...nats.map(([, n]) => Math.abs(n)));
    const lines = nats.map(([kind, n]) => `<tr><td>${ObjectPanel.swing(n, most)}</td><td class="n">${n > 0 ? '+' : '−'}${Math.abs(n).toFixed(2)}</td><td>${escaped(classWords(kind))}</td></tr>`);
    return `<h3>${escaped(title)} (nats)</h3><table class="ledger">${lines.join('')}</table>`;
  }

  place(o) {
    const sigma = [0, 3, 5].map((i) => Math.sqrt(Math.max(0, o.cov[i])));
    const pm = (value, s, unit, digits = 2) => `${value.toFixed(digits)} <span class="dim">± ${s === undefined ? '?' : s.toFixed(digits)}</span> ${unit}`;
    const rows = [
      ['x', pm(o.c[0], sigma[0], 'm')], ['y', pm(o.c[1], sigma[1], 'm')], ['z', pm(o.c[2], sigma[2], 'm')],
      ['heading', pm((180 * o.yaw) / Math.PI, (180 * (o.yaw_sigma ?? 0)) / Math.PI, '°', 1)],
      ['length', pm(o.size[0], o.size_sigma?.[0], 'm')], ['width', pm(o.size[1], o.size_sigma?.[1], 'm')], ['height', pm(o.size[2], o.size_sigma?.[2], 'm')],
      ['seen', `${o.hits ?? '?'} times, first ${this.ago(o.first_s)}, last ${this.ago(o.last_s)}`],
    ];
    if (this.model.truth) rows.push(['error', wordsOfError(this.model.truth.errorsOf(o, this.model))]);
    if ((o.moving ?? 0) > 0.01) rows.push(['moves', `${percent(o.moving)}, ${Math.hypot(...o.velocity).toFixed(1)} m/s`]);
    const frame = this.model.objects.has(o.id) ? 'odom' : 'map';
    return `<h3>Where it is in ${frame}, and how large</h3><p class="dim">± one standard deviation</p><table>${rows.map(([k, v]) => `<tr><td class="dim">${k}</td><td>${v}</td></tr>`).join('')}</table>`;
  }

  /** Shows, for the most probable class, the correlations as colours, and the covariance of the
      pair under the pointer. */
  covariance() {
    const P = this.full?.classes?.[0]?.covariance;
    if (!P) return '';
    const names = ['x', 'y', 'z', 'yaw', 'log l', 'log w', 'log h'];
    const cells = P.flatMap((row, i) => row.map((value, k) => {
      const rho = value / Math.max(1e-12, Math.sqrt(P[i][i] * P[k][k]));
      const colour = `rgba(${rho < 0 ? '240,98,93' : '74,163,255'},${Math.min(1, Math.abs(rho)).toFixed(2)})`;
      return `<i style="background:${colour}" title="${names[i]}, ${names[k]}: covariance ${value.toPrecision(3)}, correlation ${rho.toFixed(2)}"></i>`;
    }));
    const sigmas = names.map((n, i) => `<b>${n}</b><span>${Math.sqrt(Math.max(0, P[i][i])).toPrecision(2)}</span>`);
    return `<h3>Covariance</h3><p class="dim">standard deviations; correlations: blue +, red −</p><div class="covariance"><div class="sigmas">${sigmas.join('')}</div><div class="matrix" role="img" aria-label="Correlations of ${names.join(', ')}">${cells.join('')}</div></div>`;
  }

  ago(s) {
    if (s === undefined || this.model.time === undefined) return '?';
    const d = this.model.time - s;
    return d < 0.15 ? 'now' : d < 90 ? `${d.toFixed(1)} s ago` : `${(d / 60).toFixed(1)} min ago`;
  }
}
