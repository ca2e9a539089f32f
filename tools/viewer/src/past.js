// The last minute of live data, so that the page can show an earlier time.

export const PAST_S = 60, STEP_S = 0.2;

export class Past {
  constructor() { this.clear(); }

  clear() { this.kept = { objects: [], image: [] }; }

  take(kind, time, value) {
    const kept = this.kept[kind], last = kept.at(-1);
    if (last && time < last.time) kept.length = 0;
    else if (last && time < last.time + STEP_S - 0.01) return;
    kept.push({ time, value });
    while (kept[0].time < time - PAST_S) kept.shift();
  }

  /** Returns the last {time, value} that is not after `time`; else the first. */
  at(kind, time) {
    return this.kept[kind].findLast((one) => one.time <= time + 1e-6) ?? this.kept[kind][0];
  }
}
