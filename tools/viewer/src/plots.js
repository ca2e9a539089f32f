// Charts of quantities over time, as SVG: existence, σ, speed, latency, CPU.
import { TRUE_COLOUR, escaped, wordsOf, wordsOfTime } from './words.js';

const MOST_POINTS = 300, GAP_S = 3, COLOURS = ['#4aa3ff', '#f5bf40', '#49c281', '#c58cff', '#f0625d', '#5fd0d8', '#cd7369', '#9fb6cc'];

/** Returns the least of 1, 2, 5, 10, … (also their tenths) that is not below x. */
export function roundUp(x) {
  const ten = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5, 10].map((k) => k * ten).find((y) => y >= x * (1 - 1e-9));
}

/** Returns a chart of series {name, colour, samples: [[time, value], …]}. A value that is not finite
    interrupts the line. The scale ends at `high`, or above all values and `least`. `say(value)` returns a value as text; `shaded` has intervals of time. */
export function chart(title, series, { high, least = 0.1, say, shaded = [], cursor, none = 'no data yet' }) {
  const all = series.flatMap((s) => s.samples), known = all.filter((s) => Number.isFinite(s[1]));
  if (known.length < 2) return `<h3>${title}</h3><p class="dim">${none}</p>`;
  const times = all.map((s) => s[0]), first = Math.min(...times), span = Math.max(0.1, Math.max(...times) - first);
  const top = high ?? roundUp(Math.max(least, ...known.map((s) => s[1])));
  const x = (t) => ((100 * (t - first)) / span).toFixed(2), y = (v) => (37 - (34 * v) / top).toFixed(2);
  const path = (samples) => {
    const step = Math.ceil(samples.length / MOST_POINTS);
    let pen = 'M', before = first;
    return samples.filter((_, i) => i % step === 0 || i === samples.length - 1).map(([t, v]) => {
      const stroke = Number.isFinite(v) ? `${t - before > GAP_S ? 'M' : pen}${x(t)} ${y(v)}` : '';
      pen = stroke ? 'L' : 'M';
      before = t;
      return stroke;
    }).join('');
  };
  const back = shaded.map(([a, b]) => `<rect x="${x(a)}" y="0" width="${(x(b) - x(a)).toFixed(2)}" height="40" fill="#ffd98a" opacity=".13"/>`).join('');
  const lines = series.map((s) => `<path d="${path(s.samples)}" fill="none" stroke="${s.colour}" stroke-width="1.6" vector-effect="non-scaling-stroke"/>`).join('');
  const mark = cursor >= first ? `<path d="M${x(cursor)} 0V40" stroke="#fff" vector-effect="non-scaling-stroke"/>` : '';
  const names = series.map((s) => `<span><i style="--c:${s.colour}"></i>${s.name} ${Number.isFinite(s.samples.at(-1)?.[1]) ? say(s.samples.at(-1)[1]) : '–'}</span>`).join('');
  return `<h3>${title} over the last ${span.toFixed(0)} s</h3><div class="plot"><b>${say(top)}</b><b>0</b>
    <svg viewBox="0 0 100 40" preserveAspectRatio="none" role="img" aria-label="${title} over time">${back}<path d="M0 3H100M0 20H100M0 37H100" stroke="#26313d" stroke-width=".4"/>${lines}${mark}</svg></div>
    <p class="series">${names}${shaded.length ? '<span>shaded: not visible</span>' : ''}</p>`;
}

/** Returns charts of error and 2 σ, of the vehicle and of the selected object. */
function errorCharts(model, o) {
  const { truth, past, start } = model;
  if (!truth || !start) return '';
  const one = (title, errors, none) => chart(`Error of ${title}`, [{ name: 'error', colour: TRUE_COLOUR, samples: (errors ?? []).map((s) => [s[0], s[1]]) }, { name: '2 σ', colour: COLOURS[0], samples: (errors ?? []).map((s) => [s[0], 2 * s[2]]) }], { say: (v) => `${v.toFixed(2)} m`, cursor: past, none });
  return one('the vehicle', truth.errorsOfBody(model.drive), 'no data yet') + (o ? one(escaped(wordsOf(o)), truth.errorsOf(o, model), `No true ${escaped(o.class)} is within 3 m.`) : '')
    + `<p class="dim">Truth is aligned in position and yaw at ${wordsOfTime(start.time, model.origin)}, the first pose that this page received. σ is the root of the covariance's trace.</p>`;
}

/** Shows errors if the truth is shown, σ of the selected object, speed, latency and CPU. */
export function renderPlots(element, model) {
  const o = model.find(model.chosen), cursor = model.past, played = model.origin > 0;
  const unit = (digits, name) => (v) => `${v.toFixed(digits)} ${name}`;
  const line = (name, samples, k, colour = COLOURS[0]) => ({ name, colour, samples: samples.map((s) => [s[0], s[k]]) });
  const sigma = o ? model.history.get(o.id) ?? [] : [];
  element.innerHTML = errorCharts(model, o) + chart(o ? `Standard deviation of ${escaped(wordsOf(o))}` : 'Standard deviation of an object', [line('largest of x, y, z', sigma, 4)], { say: unit(2, 'm'), cursor, none: o ? 'no data yet' : 'Select an object.' })
    + chart('Speed', [line('vehicle', model.drive, 1)], { say: unit(1, 'm/s'), least: 1, cursor })
    + chart('Latency', [line('from capture to objects', model.drive, 2)], { say: unit(0, 'ms'), least: 10, cursor, none: played ? 'A recording has no latency.' : 'no data yet' })
    + chart('CPU', [...model.cpu].map(([process, samples], i) => line(escaped(process), samples, 1, COLOURS[i % COLOURS.length])), { say: (v) => `${(100 * v).toFixed(0)} %`, cursor, none: played ? 'The recording has no topic health.' : 'no data yet' });
}
