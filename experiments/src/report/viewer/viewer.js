// The viewer: two images A and B of one scene on one stage, their values under a cursor, and the series beside its sums.

const VIEWS = {
  image: { name: "image" },
  error: { name: "standard error" },
  relative: { name: "relative standard error", number: true, unit: "of the mean" },
  reference: { name: "difference from the reference", number: true, signed: true },
  difference: { name: "difference A − B", number: true, signed: true },
};
const UNIT = "W/(m²·sr)";
const KEYS = [
  ["← →", "layer before, after"], ["0 … 9", "order"], ["End", "sum of all orders"],
  ["↑ ↓", "method of A; with Shift of B"], ["Space", "exchange A and B"], ["v", "next view"], ["t", "next tone map"],
  ["+ −", "brighter, darker"], ["b", "brighten every layer by itself or not"], ["c", "slider or side by side"], ["[ ]", "move the slider"],
  ["z x", "zoom in, out"], ["w a s d", "move the cursor by a pixel; with Shift by 16"], ["r", "whole image again"], ["?", "these keys"],
];
const LARGEST_ZOOM = 64;

class Viewer {
  constructor(element) {
    this.element = element;
    this.images = new Images(element);
    const { methods, sum, reference, first } = this.images;
    this.a = { method: first[0], column: sum };
    this.b = { method: reference ?? first[1], column: sum };
    Object.assign(this, { view: "image", tone: "srgb", stops: 0, own: true, linked: true, side: false, split: 0.5 });
    Object.assign(this, { zoom: 1, x: this.images.width / 2, y: this.images.height / 2, pixel: null });
    this.textures = { a: document.createElement("canvas"), b: document.createElement("canvas") };
    this.views = Object.keys(VIEWS).filter((view) => view !== "reference" || reference !== null);
    if (methods.every((m) => m.layers.every((layer) => layer.largest_error === null))) {
      this.views = this.views.filter((view) => view !== "error" && view !== "relative");
    }
    const aside = make("div", { class: "aside" }, buildReadout(this), buildHelp());
    element.append(buildControls(this), buildStage(this), aside, buildStrip(this));
    element.hidden = false;
    this.listen();
    this.update();
  }

  // What is on the stage, pane by pane: one where both make one image.
  panes() {
    return this.view === "difference" ? ["a"] : ["a", "b"];
  }

  title(pane) {
    const { method, column } = this[pane];
    return `${this.images.methods[method].label} · ${this.images.columns[column].symbol}`;
  }

  stopsOf(pane) {
    const columns = this.images.columns;
    return (columns[this.own ? this[pane].column : this.images.sum].stops ?? 0) + this.stops;
  }

  // Everything again, after a choice has changed. A later call overtakes one that still unpacks.
  async update() {
    const turn = (this.turn = (this.turn ?? 0) + 1);
    this.showControls();
    const get = ({ method, column }) => this.images.image(method, column);
    if (!this.element.dataset.painted) {
      // The first image is not kept waiting by the second.
      this.a.image = await get(this.a);
      this.paint();
      this.draw();
      this.element.dataset.painted = Math.round(performance.now());
    }
    const found = await Promise.all([get(this.a), get(this.b)]);
    const { reference } = this.images;
    const truths = this.view === "reference" ? [this.a, this.b].map((p) => this.images.image(reference, p.column)) : [];
    const against = await Promise.all(truths);
    if (turn !== this.turn) return;
    [this.a.image, this.b.image] = found;
    [this.a.truth, this.b.truth] = against;
    this.paint();
    this.draw();
    this.read();
    this.element.dataset.turn = turn;
    this.strip();
  }

  // The number that a view shows of a pixel; null where it is a colour.
  number(pane) {
    const { image, truth } = this[pane], other = this.b.image;
    if (this.view === "relative" && image.error) return (i) => average(image.error, i) / Math.abs(average(image.mean, i)) || 0;
    if (this.view === "reference" && truth) return (i) => average(image.mean, i) - average(truth.mean, i);
    if (this.view === "difference" && other) return (i) => average(image.mean, i) - average(other.mean, i);
    return null;
  }

  // Fills the panes' textures.
  paint() {
    const { n, width, height } = this.images;
    const values = ({ image }) => (this.view === "error" ? image.error : image.mean);
    const shown = this.panes().filter((pane) => this.canShow(pane));
    let common = null;
    if (this.view !== "image") {
      // Errors and differences have one scale on both sides.
      const of = (pane) => stopsFor(this.number(pane) ?? ((i) => average(values(this[pane]), i)), n);
      const stops = shown.map(of).filter((s) => s !== null);
      common = (stops.length ? Math.min(...stops) : 0) + this.stops;
    }
    for (const pane of shown) {
      const texture = this.textures[pane];
      [texture.width, texture.height] = [width, height];
      const context = texture.getContext("2d"), pixels = context.createImageData(width, height);
      const stops = common ?? this.stopsOf(pane), number = this.number(pane), curve = TONES[this.tone].curve;
      this[pane].stops = stops;
      if (number) {
        const { signed } = VIEWS[this.view];
        paintNumbers(pixels.data, n, number, 2 ** stops, signed ? MAPS.diverging : MAPS.viridis, signed);
      } else if (curve) {
        paintColours(pixels.data, values(this[pane]), 2 ** stops, curve);
      } else {
        paintNumbers(pixels.data, n, (i) => average(values(this[pane]), i), 2 ** stops, MAPS.viridis, false);
      }
      context.putImageData(pixels, 0, 0);
    }
    this.showScale(shown);
  }

  // Whether there is something to be seen, by this view.
  canShow(pane) {
    const { image, truth } = this[pane];
    if (!image || (this.view === "difference" && !this.b.image) || (this.view === "reference" && !truth)) return false;
    return image.error !== null || (this.view !== "error" && this.view !== "relative");
  }

  // Where panes are on the stage, in its own pixels: one over the other, or side by side.
  areas() {
    const { width, height } = this.canvas;
    if (!this.side || this.panes().length < 2) return { a: [0, 0, width, height], b: [0, 0, width, height] };
    return { a: [0, 0, width / 2, height], b: [width / 2, 0, width / 2, height] };
  }

  scaleIn([, , w, h]) {
    return Math.min(w / this.images.width, h / this.images.height) * this.zoom;
  }

  // Keeps the image on the stage.
  clamp() {
    const { width, height } = this.images, half = 0.5 / this.zoom;
    this.x = Math.min(Math.max(this.x, width * half), width * (1 - half));
    this.y = Math.min(Math.max(this.y, height * half), height * (1 - half));
  }

  draw() {
    const canvas = this.canvas, context = canvas.getContext("2d"), areas = this.areas();
    context.fillStyle = "#0c0d10";
    context.fillRect(0, 0, canvas.width, canvas.height);
    for (const pane of this.panes()) this.drawPane(context, pane, areas[pane]);
    const twoInOne = this.panes().length === 2 && !this.side;
    this.divider.hidden = !twoInOne;
    this.divider.style.left = `${100 * this.split}%`;
    this.element.dataset.zoom = this.zoom;
  }

  drawPane(context, pane, area) {
    const [x, y, w, h] = area, scale = this.scaleIn(area);
    context.save();
    context.beginPath();
    const cut = this.panes().length === 2 && !this.side ? this.split * w : 0;
    if (pane === "b") context.rect(x + cut, y, w - cut, h);
    else context.rect(x, y, cut || w, h);
    context.clip();
    context.imageSmoothingEnabled = scale < 1;
    context.translate(x + w / 2 - this.x * scale, y + h / 2 - this.y * scale);
    if (this.canShow(pane)) {
      context.drawImage(this.textures[pane], 0, 0, this.images.width * scale, this.images.height * scale);
      this.drawCursor(context, scale);
    }
    context.restore();
  }

  drawCursor(context, scale) {
    if (!this.pixel) return;
    const [px, py] = this.pixel, ratio = window.devicePixelRatio || 1, side = Math.max(scale, 6 * ratio);
    const left = (px + 0.5) * scale - side / 2, top = (py + 0.5) * scale - side / 2;
    for (const [colour, out] of [["#000", 1.5], ["#fff", 0.5]]) {
      context.strokeStyle = colour;
      context.lineWidth = ratio;
      context.strokeRect(left - out * ratio, top - out * ratio, side + 2 * out * ratio, side + 2 * out * ratio);
    }
  }

  // The pixel at a place on the page, in whichever pane that is; its place in the image, not rounded, where `exact`.
  pixelAt(clientX, clientY, exact = false) {
    const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
    const sx = (clientX - box.left) * ratio, sy = (clientY - box.top) * ratio, areas = this.areas();
    const area = sx >= areas.b[0] && this.panes().length === 2 ? areas.b : areas.a, scale = this.scaleIn(area);
    const x = this.x + (sx - area[0] - area[2] / 2) / scale, y = this.y + (sy - area[1] - area[3] / 2) / scale;
    if (exact) return [x, y];
    const inside = x >= 0 && y >= 0 && x < this.images.width && y < this.images.height;
    return inside ? [Math.floor(x), Math.floor(y)] : null;
  }

  // Zooms so that a place of the image stays where it is.
  zoomBy(factor, [x, y] = this.pixel ?? [this.x, this.y]) {
    const zoom = Math.min(Math.max(this.zoom * factor, 1), LARGEST_ZOOM), kept = this.zoom / zoom;
    this.zoom = zoom;
    this.panTo(x + (this.x - x) * kept, y + (this.y - y) * kept);
  }

  panTo(x, y) {
    [this.x, this.y] = [x, y];
    this.clamp();
    this.canvas.style.touchAction = this.zoom > 1 ? "none" : "pan-y";
    this.draw();
  }

  point(pixel, aloud = false) {
    this.pixel = pixel;
    this.draw();
    this.read(aloud);
  }

  movePixel(dx, dy) {
    const { width, height } = this.images, [x, y] = this.pixel ?? [Math.floor(this.x), Math.floor(this.y)];
    const to = (at, by, size) => Math.min(Math.max(at + by, 0), size - 1);
    const pixel = this.pixel ? [to(x, dx, width), to(y, dy, height)] : [x, y];
    const half = 0.5 / this.zoom - 0.5 / Math.max(width, height);
    const near = (at, centre, size) => Math.min(Math.max(centre, at + 0.5 - half * size), at + 0.5 + half * size);
    this.panTo(near(pixel[0], this.x, width), near(pixel[1], this.y, height));
    this.point(pixel, true);
  }

  // Another layer or method for a pane; layers of both where they are linked and both have it.
  choose(pane, change) {
    Object.assign(this[pane], change);
    const other = pane === "a" ? this.b : this.a;
    if (this.linked && this.images.has(other.method, this[pane].column)) other.column = this[pane].column;
    this.update();
    this.say(`A: ${this.title("a")}. B: ${this.title("b")}.`);
  }

  step(pane, what, by) {
    const count = what === "column" ? this.images.columns.length : this.images.methods.length;
    this.choose(pane, { [what]: (this[pane][what] + by + count) % count });
  }

  set(change, words) {
    Object.assign(this, change);
    if (change.linked) this.b.column = this.a.column;
    this.update();
    if (words) this.say(words);
  }

  // Tells those who cannot see the stage, once keys have come to rest.
  say(text) {
    clearTimeout(this.saying);
    this.saying = setTimeout(() => (this.status.textContent = text), 250);
  }
}
