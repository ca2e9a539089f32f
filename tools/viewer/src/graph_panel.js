// Describes an anchor or a loop of the map's graph in HTML.
import { LOOPS, escaped, lookOfLoop } from './words.js';

const metres = (x) => `${Math.abs(x) < 0.0005 ? '0' : x.toFixed(Math.abs(x) < 1 ? 3 : 2)} m`;
const degrees = (x) => `${((180 * x) / Math.PI).toFixed(2)}°`;
const table = (rows) => `<table>${rows.map(([k, v]) => `<tr><td class="dim">${k}</td><td>${v}</td></tr>`).join('')}</table>`;
const anchorLink = (id) => `<a data-part="anchor" data-id="${id}">anchor ${id}</a>`;
const object = (id) => `<a data-object="${id}">${id}</a>`;

function sigmaWords(sigma) {
  if (!sigma.length) return 'not known, because that of the trajectory to here is not known';
  if (sigma.every((s) => s === 0)) return 'the map begins here: all other places are relative to it';
  return `± ${metres(sigma[0])}, ${metres(sigma[1])}, ${metres(sigma[2])}; ± ${degrees(sigma[3])}`;
}

function anchorWords(a, graph) {
  const loops = graph.loops.filter((l) => l.a === a.id || l.b === a.id);
  const sigma = sigmaWords(a.sigma);
  const links = loops.map((l) => `<a data-part="loop" data-id="${l.id}">${l.kind} ${l.id}</a> <span class="dim">${l.state}</span>`);
  return `<h2 style="--c:#8fb8de"><i></i>Anchor ${a.id}</h2>
    <p>A place on the vehicle's trajectory. ${a.objects} object${a.objects === 1 ? '' : 's'} of the map belong${a.objects === 1 ? 's' : ''} to it, and move${a.objects === 1 ? 's' : ''} with it.</p>
    ${table([['x, y, z in map', a.at.map(metres).join(', ')], ['heading', degrees(a.yaw)], ['σ', sigma],
      ['before it', a.previous ? anchorLink(a.previous) : 'nothing: its session begins here'], ['session', escaped(a.session)]])}
    <h3>Loops and ties here</h3>${links.length ? `<p>${links.join('<br>')}</p>` : '<p class="dim">none</p>'}`;
}

function loopWords(l) {
  const seen = l.pairs.map(([known, seen]) => (known === seen ? object(known) : `${object(known)} <span class="dim">(seen as ${seen})</span>`));
  const by = seen.length ? `${seen.length} object${seen.length === 1 ? '' : 's'}: ${seen.join(', ')}`
    : l.landmarks ? `${l.landmarks} similar landmarks` : l.kind === 'tie' ? 'objects that still had their ids' : 'not known any more: it was found before the last start';
  const r = l.residual, s = l.sigma, known = s.length > 0;
  const row = (name, k, say) => [name, `${say(r[k])}${known ? ` <span class="dim">± ${say(s[k])}</span>` : ''}`];
  return `<h2 style="--c:${LOOPS[lookOfLoop(l)].colour}"><i></i>${l.kind === 'tie' ? 'Tie' : 'Loop'} ${l.id}</h2>
    <span class="tag ${{ confirmed: 'seen', tentative: 'hidden' }[l.state] ?? ''}">${l.state}</span>
    <p>${escaped(LOOPS[lookOfLoop(l)].words)}</p>
    ${table([['between', `${anchorLink(l.a)} and ${anchorLink(l.b)}`], ['by', by]])}
    <h3>Residual: what was measured less what the map has</h3>
    ${table([row('x', 0, metres), row('y', 1, metres), row('z', 2, metres), row('heading', 3, degrees), ['χ² of 4', l.chi2.toFixed(2)], ['weight', l.weight.toFixed(3)]])}
    <p class="dim">in axes of anchor ${l.a}; ${known ? '± standard deviation of the measurement' : 'how well it was measured is not known'}</p>`;
}

/** Returns HTML about a part {kind, id}; "" if it is not in the graph any more. */
export function wordsOfPart(part, graph) {
  const found = (part.kind === 'anchor' ? graph?.anchors : graph?.loops)?.find((x) => x.id === part.id);
  if (!found) return '';
  return part.kind === 'anchor' ? anchorWords(found, graph) : loopWords(found);
}
