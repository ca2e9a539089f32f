// The playback controls, which are visible if the gateway plays a recording.

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];

export class PlaybackBar {
  constructor(element, connection, model) {
    Object.assign(this, { element, connection, model });
    element.innerHTML = `<button data-do="play" title="Play, pause (space)">▶</button>
      <input type="range" min="0" max="1000" value="0" aria-label="Place in the recording">
      <output></output><select aria-label="Speed">${SPEEDS.map((s) => `<option value="${s}">${s} ×</option>`).join('')}</select>
      <button data-do="next" title="To the next event (N)">next event</button>`;
    [this.button, this.slider, this.output, this.speed, this.next] = element.children;
    this.button.addEventListener('click', () => this.toggle());
    this.next.addEventListener('click', () => this.nextEvent());
    this.slider.addEventListener('input', () => { this.dragged = Number(this.slider.value) / 1000; this.seekSoon(); });
    this.slider.addEventListener('change', () => { this.seek(this.dragged); this.dragged = undefined; });
    this.speed.addEventListener('change', () => this.control());
  }

  get plays() { return this.connection.playback?.status === 'playing'; }

  control(play = this.plays, seek = undefined) {
    this.connection.control(play, Number(this.speed.value), seek);
  }

  toggle() { this.control(!this.plays); }

  seek(share) {
    const { first, last } = this.connection.range;
    this.control(this.plays, first + share * (last - first));
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

  /** Seeks while the handle is dragged, but only a few times a second. */
  seekSoon() {
    this.timer ??= setTimeout(() => {
      this.timer = undefined;
      if (this.dragged !== undefined) this.seek(this.dragged);
    }, 150);
  }

  async nextEvent() {
    try {
      await this.connection.call('/playback/next_event', {});
      this.said = '';
    } catch (error) {
      this.said = error.message;
    }
  }

  render() {
    const { range, playback } = this.connection;
    this.element.hidden = !range;
    if (!range) return;
    const words = { playing: '❚❚', ended: '↻' }[playback?.status] ?? '▶';
    if (this.button.textContent !== words) this.button.textContent = words;
    const time = this.plays ? this.model.time ?? range.first : playback?.time ?? range.first;
    const share = (time - range.first) / Math.max(0.1, range.last - range.first);
    if (this.dragged === undefined) this.slider.value = String(Math.round(1000 * share));
    if (playback && document.activeElement !== this.speed) this.showSpeed(playback.speed);
    const at = (this.dragged ?? Math.min(1, Math.max(0, share))) * (range.last - range.first);
    this.output.textContent = this.said || `${at.toFixed(1)} of ${(range.last - range.first).toFixed(1)} s`;
  }
}
