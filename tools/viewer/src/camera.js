// Shows the camera image with the annotations of the same frame, which are matched by time.
import { bytesOfImage, seconds, timeOfImage } from './connection.js';

const KEPT = 12; // limit of images that wait for annotations
const PATIENCE_MS = 250;

const css = (c) => `rgba(${Math.round(255 * c.r)},${Math.round(255 * c.g)},${Math.round(255 * c.b)},${c.a})`;

const TEXT_ID = / (\d+)(?= |$)/, SLACK_PX = 4;

export class CameraView {
  /** Calls `onPick(id)` on a click on a box, `onPair(time, {view, message})` for each image. */
  constructor(figure, canvas, caption, onPick, onPair) {
    Object.assign(this, { figure, canvas, caption, onPair });
    this.pen = canvas.getContext('2d');
    this.images = []; // {time, at, view}, not shown yet
    this.shown = null; // the image on the canvas, with its bitmap
    this.annotations = null;
    this.likelihood = false; // shows the likelihood of a class as brightness
    this.frozen = false; // whether an earlier image is shown
    this.chosen = this.drawn = this.turn = this.drawnTurn = 0;
    setInterval(() => this.drawLate(), 100);
    new ResizeObserver(() => this.redraw()).observe(canvas);
    canvas.addEventListener('click', (e) => {
      const id = this.pick(e);
      if (id) onPick(id); else this.enlarge();
    });
  }

  takeImage(view) {
    this.images.push({ time: timeOfImage(view), at: performance.now(), view });
    while (this.images.length > KEPT) this.images.shift();
    return this.drawMatching();
  }

  takeAnnotations(message) {
    this.annotations = { time: seconds(message.timestamp), message, at: performance.now() };
    return this.drawMatching();
  }

  showLikelihood(on) {
    this.likelihood = on;
    this.annotations = null; // they are of the other kind
    if (this.shown) this.draw(this.shown, null);
  }

  choose(id) {
    this.chosen = id;
    this.redraw();
  }

  redraw() { if (this.shown) this.draw(this.shown, this.message); }

  enlarge(on = !this.figure.classList.contains('large')) { this.figure.classList.toggle('large', on); }

  /** Draws the image that matches the annotations; this may be the image already shown. */
  async drawMatching() {
    const fits = (i) => i && this.annotations && Math.abs(i.time - this.annotations.time) < 1e-4;
    const found = this.images.findIndex(fits);
    if (found >= 0) await this.takePair(this.images.splice(0, found + 1).at(-1), this.annotations.message);
    else if (fits(this.shown) && !this.frozen) this.draw(this.shown, this.annotations.message);
  }

  /** Draws an image without annotations if none have arrived in time. */
  async drawLate() {
    const late = this.images.findIndex((i) => performance.now() - i.at > PATIENCE_MS);
    if (late < 0 || (this.annotations && performance.now() - this.annotations.at < 2 * PATIENCE_MS)) return;
    await this.takePair(this.images.splice(0).at(-1), null);
  }

  async takePair({ time, view }, message) {
    this.onPair(time, { view, message, likelihood: this.likelihood });
    if (!this.frozen) await this.show(time, { view, message, likelihood: this.likelihood });
  }

  /** Decodes and draws an image, unless a later call was faster. */
  async show(time, { view, message, likelihood }) {
    const turn = ++this.turn;
    const bitmap = await createImageBitmap(new Blob([bytesOfImage(view)], { type: 'image/jpeg' }));
    if (turn < this.drawnTurn) return bitmap.close();
    this.drawnTurn = turn;
    const arrived = this.annotations?.time === time ? this.annotations.message : null; // meanwhile
    return this.draw({ time, view, bitmap }, arrived ?? (likelihood === this.likelihood ? message : null));
  }

  draw(image, message) {
    const { canvas, pen } = this, { bitmap, time } = image;
    if (this.shown && this.shown !== image) this.shown.bitmap.close();
    this.shown = image;
    this.message = message;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    pen.drawImage(bitmap, 0, 0);
    this.figure.classList.add('has-image');
    this.caption.textContent = '';
    this.shownTime = time;
    if (this.likelihood) {
      pen.fillStyle = 'rgba(0,0,40,0.55)';
      pen.fillRect(0, 0, canvas.width, canvas.height);
    }
    if (message) this.drawAnnotations(message);
    ++this.drawn;
  }

  /** Screen pixels per image pixel. */
  scale() { return Math.min(this.canvas.clientWidth / this.canvas.width, this.canvas.clientHeight / this.canvas.height) || 1; }

  /** Returns the outlines of objects: [{id, hidden, points, box}, …], and the network's boxes with id 0.
      The message has no ids: a label has that of its outline, at the outline's upper left corner, in
      the same order. */
  outlines() {
    let next = 0;
    return (this.message?.points ?? []).map((p) => {
      const xs = p.points.map((q) => q.x), ys = p.points.map((q) => q.y);
      const box = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
      const label = this.message.texts[next];
      const own = label && (this.likelihood || (p.type === 4 && Math.abs(Math.max(2, box[0]) - label.position.x) + Math.abs(Math.max(14, box[1]) - label.position.y) < 0.3));
      if (own) ++next;
      return { id: own ? Number(TEXT_ID.exec(label.text)?.[1] ?? 0) : 0, hidden: own && label.text.endsWith(' hidden'), points: p, box };
    });
  }

  /** Returns the id of the object at a click: the smallest outline there, first of those in sight.
      A box of the network stands for the object with the largest overlap. */
  pick(e) {
    const { canvas } = this, area = canvas.getBoundingClientRect(), scale = this.scale(), slack = SLACK_PX / scale;
    const x = (e.clientX - area.left - area.width / 2) / scale + canvas.width / 2, y = (e.clientY - area.top - area.height / 2) / scale + canvas.height / 2;
    const outlines = this.outlines(), objects = outlines.filter((o) => o.id);
    const has = ({ box: [l, t, r, b] }) => x > l - slack && x < r + slack && y > t - slack && y < b + slack;
    const size = ([l, t, r, b]) => Math.max(0, r - l) * Math.max(0, b - t);
    const common = (a, b) => size([Math.max(a[0], b[0]), Math.max(a[1], b[1]), Math.min(a[2], b[2]), Math.min(a[3], b[3])]);
    const found = objects.filter(has).sort((a, b) => a.hidden - b.hidden || size(a.box) - size(b.box))[0];
    const box = found ? undefined : outlines.find((o) => !o.id && has(o))?.box;
    const nearest = box && objects.sort((a, b) => common(b.box, box) - common(a.box, box))[0];
    return found?.id ?? (nearest && common(nearest.box, box) > 0 ? nearest.id : 0);
  }

  drawAnnotations(message) {
    const { pen, canvas } = this;
    // Lines and text have a constant size on the screen, independent of the image scale.
    const scale = Math.max(0.5, 0.85 / this.scale());
    const chosen = this.chosen ? this.outlines().find((o) => o.id === this.chosen)?.points : undefined;
    for (const p of message.points) {
      pen.strokeStyle = p === chosen ? '#fff' : css(p.outline_color);
      pen.lineWidth = p.thickness * scale * (p === chosen ? 1.8 : p.type === 4 ? 0.9 : 1);
      pen.beginPath();
      if (p.type === 4) {
        for (let i = 0; i + 1 < p.points.length; i += 2) {
          pen.moveTo(p.points[i].x, p.points[i].y);
          pen.lineTo(p.points[i + 1].x, p.points[i + 1].y);
        }
      } else {
        p.points.forEach((q, i) => (i ? pen.lineTo(q.x, q.y) : pen.moveTo(q.x, q.y)));
        pen.closePath();
        if (p.fill_color.a > 0) {
          pen.fillStyle = css(p.fill_color);
          pen.fill();
        }
      }
      pen.stroke();
    }
    pen.font = `${Math.round(12 * scale)}px system-ui, "DejaVu Sans", sans-serif`;
    const taken = [];
    const own = (t) => Number(TEXT_ID.exec(t.text)?.[1]) === this.chosen;
    for (const t of [...message.texts].sort((a, b) => own(b) - own(a))) {
      const width = pen.measureText(t.text).width + 8 * scale, height = 16 * scale;
      const box = { x: Math.min(t.position.x, canvas.width - width), y: Math.max(0, t.position.y - height) };
      if (taken.some((o) => box.x < o.x + o.w && o.x < box.x + width && Math.abs(o.y - box.y) < height)) continue;
      taken.push({ ...box, w: width });
      pen.fillStyle = own(t) ? '#17406b' : css(t.background_color);
      pen.fillRect(box.x, box.y, width, height);
      pen.fillStyle = css(t.text_color);
      pen.fillText(t.text, box.x + 4 * scale, box.y + 12 * scale);
    }
  }
}
