// The state of the page in its address (location.hash), so that a link restores it.

const EVERY_MS = 1000;

export class Link {
  /** `read()` returns the state as {name: text}, with undefined for the usual value; `apply(state)`
      restores it. */
  constructor(read, apply) {
    Object.assign(this, { read, apply, writtenAt: 0 });
    addEventListener('hashchange', () => this.open());
  }

  open() { this.apply(Object.fromEntries(new URLSearchParams(location.hash.slice(1)))); }

  /** Writes the state if it changed, at most once a second, without a new entry of the history. */
  write() {
    const now = performance.now();
    if (now - this.writtenAt < EVERY_MS) return;
    const known = Object.entries(this.read()).filter(([, text]) => text !== undefined && text !== '');
    const hash = known.length ? `#${new URLSearchParams(known)}` : '';
    if (hash === location.hash) return;
    this.writtenAt = now;
    history.replaceState(null, '', hash || location.pathname + location.search);
  }
}
