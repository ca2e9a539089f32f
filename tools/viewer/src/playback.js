// The controls of time: play and pause, speed and next event of a recording; pause and now of live data.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8], PATIENCE_MS = 1000;

export class PlaybackBar {
  /** `lookBack(time)` shows an earlier time of live data; without a time, the present. */
  constructor(element, connection, model, lookBack) {
    Object.assign(this, { element, connection, model, lookBack });
    element.innerHTML = `<button data-do="play" title="Play, pause (space)">▶</button><output></output>
      <select aria-label="Speed">${SPEEDS.map((s) => `<option value="${s}"${s === 1 ? ' selected' : ''}>${s} ×</option>`).join('')}</select>
      <button data-do="next" title="To the next event (N)">next event</button>
      <button data-do="now" title="Back to the present (N)">now</button>`;
    [this.button, this.output, this.speed, this.next, this.now] = element.children;
    this.button.addEventListener('click', () => this.toggle());
    this.next.addEventListener('click', () => this.onward());
    this.now.addEventListener('click', () => this.onward());
    this.speed.addEventListener('change', () => this.control());
    this.sentAt = -PATIENCE_MS;
  }

  get plays() { return this.connection.range ? this.connection.playback?.status === 'playing' : this.model.past === undefined; }

  /** The time that is shown, on the sensor clock. */
  get time() {
    const { range, playback } = this.connection;
    if (!range) return this.model.past ?? this.model.newest;
    return this.wanted ?? (this.plays ? this.model.time : playback?.time) ?? range.first;
  }

  control(play = this.plays, seek = undefined) {
    this.connection.control(play, Number(this.speed.value), seek);
  }

  toggle() {
    const seek = this.wanted;
    this.wanted = undefined; // it must not undo this later
    if (this.connection.range) this.control(!this.plays, seek);
    else this.lookBack(this.model.past === undefined ? this.model.newest : undefined);
  }

  /** Shows the state at a time. Of several seeks of a recording, only the last waits for the answer
      to the one before. */
  seek(time, play = this.plays) {
    if (!this.connection.range) return this.lookBack(time);
    this.wanted = time;
    const now = performance.now();
    if (now - this.sentAt < PATIENCE_MS) return undefined;
    this.sentAt = now;
    this.sent = time;
    return this.control(play, time);
  }

  /** Must be called when the recording has answered a seek. */
  sought() {
    this.sentAt = -PATIENCE_MS;
    const { wanted } = this;
    this.wanted = undefined;
    if (wanted !== undefined && wanted !== this.sent) this.seek(wanted);
  }

  /** Selects a speed. Adds it to the list if it is missing, such as that of `play --rate 20`. */
  showSpeed(speed) {
    const rounded = Number(speed.toPrecision(3)), options = [...this.speed.options];
    if (!options.some((o) => Number(o.value) === rounded)) {
      const next = options.find((o) => Number(o.value) > rounded) ?? null;
      this.speed.insertBefore(new Option(`${rounded} ×`, String(rounded)), next);
    }
    if (this.speed.value !== String(rounded)) this.speed.value = String(rounded);
  }

  /** Goes to the next event of a recording, or to the present of live data. */
  async onward() {
    if (!this.connection.range) return this.lookBack();
    try {
      await this.connection.call('/playback/next_event', {});
      this.said = '';
    } catch (error) {
      this.said = error.message;
    }
    return undefined;
  }

  render() {
    const { range, playback } = this.connection, { past, newest } = this.model;
    this.speed.hidden = this.next.hidden = !range;
    this.now.hidden = range || past === undefined;
    const words = this.plays ? '❚❚' : playback?.status === 'ended' ? '↻' : '▶';
    if (this.button.textContent !== words) this.button.textContent = words;
    if (playback && document.activeElement !== this.speed) this.showSpeed(playback.speed);
    if (range) this.output.textContent = this.said || `${Math.max(0, this.time - range.first).toFixed(1)} of ${(range.last - range.first).toFixed(1)} s`;
    else this.output.textContent = past === undefined ? 'now' : `${(newest - past).toFixed(1)} s ago`;
  }
}
