// Shows the camera image with the annotations of the same frame, which are matched by time.
import { readImage, seconds } from './connection.js';

const KEPT = 12; // limit of images that wait for annotations
const PATIENCE_MS = 250;

const css = (c) => `rgba(${Math.round(255 * c.r)},${Math.round(255 * c.g)},${Math.round(255 * c.b)},${c.a})`;

export class CameraView {
  constructor(figure, canvas, caption) {
    Object.assign(this, { figure, canvas, caption });
    this.pen = canvas.getContext('2d');
    this.images = []; // {time, at, bitmap}, not shown yet
    this.shown = null; // the image on the canvas
    this.annotations = null;
    this.likelihood = false; // shows the likelihood of a class as brightness
    this.drawn = 0;
    setInterval(() => this.drawLate(), 100);
  }

  async takeImage(view) {
    const { time, bytes } = readImage(view);
    const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/jpeg' }));
    this.images.push({ time, at: performance.now(), bitmap });
    while (this.images.length > KEPT) this.images.shift().bitmap.close();
    this.drawMatching();
  }

  takeAnnotations(message) {
    this.annotations = { time: seconds(message.timestamp), message, at: performance.now() };
    this.drawMatching();
  }

  showLikelihood(on) {
    this.likelihood = on;
    this.annotations = null; // they are of the other kind
    if (this.shown) this.draw(this.shown, null);
  }

  /** Draws the image that matches the annotations; this may be the image already shown. */
  drawMatching() {
    const fits = (i) => i && this.annotations && Math.abs(i.time - this.annotations.time) < 1e-4;
    const found = this.images.findIndex(fits);
    if (found >= 0) {
      for (const old of this.images.splice(0, found)) old.bitmap.close();
      this.draw(this.images.shift(), this.annotations.message);
    } else if (fits(this.shown)) this.draw(this.shown, this.annotations.message);
  }

  /** Draws an image without annotations if none have arrived in time. */
  drawLate() {
    const late = this.images.findIndex((i) => performance.now() - i.at > PATIENCE_MS);
    if (late < 0 || (this.annotations && performance.now() - this.annotations.at < 2 * PATIENCE_MS)) return;
    for (const old of this.images.splice(0, this.images.length - 1)) old.bitmap.close();
    this.draw(this.images.shift(), null);
  }

  draw(image, message) {
    const { canvas, pen } = this, { bitmap, time } = image;
    if (this.shown && this.shown !== image) this.shown.bitmap.close();
    this.shown = image;
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

  drawAnnotations(message) {
    const { pen, canvas } = this;
    // Lines and text have a constant size on the screen, independent of the image scale.
    const scale = Math.max(1, (0.85 * canvas.width) / Math.max(1, canvas.clientWidth));
    for (const p of message.points) {
      pen.strokeStyle = css(p.outline_color);
      pen.lineWidth = p.thickness * scale * (p.type === 4 ? 0.9 : 1);
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
    for (const t of message.texts) {
      const width = pen.measureText(t.text).width + 8 * scale, height = 16 * scale;
      const box = { x: Math.min(t.position.x, canvas.width - width), y: Math.max(0, t.position.y - height) };
      if (taken.some((o) => box.x < o.x + o.w && o.x < box.x + width && Math.abs(o.y - box.y) < height)) continue;
      taken.push({ ...box, w: width });
      pen.fillStyle = css(t.background_color);
      pen.fillRect(box.x, box.y, width, height);
      pen.fillStyle = css(t.text_color);
      pen.fillText(t.text, box.x + 4 * scale, box.y + 12 * scale);
    }
  }
}
