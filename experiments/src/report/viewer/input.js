// Keys, pointers, wheel and touch.

Object.assign(Viewer.prototype, {
  listen() {
    const { stage, canvas } = this;
    stage.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("dblclick", (event) => this.zoomBy(2, this.pixelAt(event.clientX, event.clientY, true)));
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => this.pointerDown(event));
    canvas.addEventListener("pointermove", (event) => this.pointerMove(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    this.divider.addEventListener("pointerdown", (event) => {
      this.divider.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    this.divider.addEventListener("pointermove", (event) => {
      if (this.divider.hasPointerCapture(event.pointerId)) this.splitAt(event.clientX);
    });
    new ResizeObserver(() => this.resize()).observe(canvas);
    const pictures = this.element.parentElement.querySelector(".pictures");
    pictures?.addEventListener("click", (event) => this.takePicture(event));
    for (const figure of this.element.parentElement.querySelectorAll(".pyramids figure")) this.openPyramid(figure);
  },

  // Has the pictures of a pyramid bring their strategies onto the stage, as A.
  openPyramid(figure) {
    const method = this.images.methods.findIndex((m) => m.label === figure.dataset.method);
    for (const tile of figure.querySelectorAll("[data-part]")) {
      const column = this.images.columns.findIndex((k) => k.symbol === tile.dataset.part);
      if (!this.images.has(method, column)) continue;
      const button = make("button", { type: "button", title: tile.firstChild.alt }, tile.firstChild);
      button.addEventListener("click", () => {
        this.choose("a", { method, column });
        this.stage.scrollIntoView({ block: "center" });
      });
      tile.replaceChildren(button);
    }
  },

  resize() {
    const { width, height } = this.canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    // Even, so that two panes side by side fall on the same grid.
    const [w, h] = [2 * Math.max(1, Math.round((width * ratio) / 2)), Math.max(1, Math.round(height * ratio))];
    if (this.canvas.width === w && this.canvas.height === h) return;
    [this.canvas.width, this.canvas.height] = [w, h];
    this.draw();
  },

  splitAt(clientX) {
    const box = this.canvas.getBoundingClientRect();
    this.split = Math.min(Math.max((clientX - box.left) / box.width, 0), 1);
    this.draw();
  },

  wheel(event) {
    if (!event.ctrlKey && document.activeElement !== this.stage) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 30 : 1;
    this.zoomBy(2 ** ((-event.deltaY * lines) / 240), this.pixelAt(event.clientX, event.clientY, true));
  },

  pointerDown(event) {
    this.stage.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event);
    const pixel = this.pixelAt(event.clientX, event.clientY);
    if (pixel) this.point(pixel);
  },

  // Without a button the cursor follows; with one the image does, and with two fingers it is pinched too.
  pointerMove(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      if (event.pointerType === "mouse") this.point(this.pixelAt(event.clientX, event.clientY) ?? this.pixel);
      return;
    }
    const others = [...this.pointers.values()].filter((p) => p.pointerId !== event.pointerId);
    this.pointers.set(event.pointerId, event);
    const from = this.pixelAt(before.clientX, before.clientY, true), to = this.pixelAt(event.clientX, event.clientY, true);
    if (others.length) {
      const distance = (p) => Math.hypot(p.clientX - others[0].clientX, p.clientY - others[0].clientY);
      const fixed = this.pixelAt(others[0].clientX, others[0].clientY, true);
      this.zoomBy(Math.max(distance(event), 1) / Math.max(distance(before), 1), fixed);
    } else if (this.zoom > 1) {
      this.panTo(this.x + from[0] - to[0], this.y + from[1] - to[1]);
    } else {
      this.point(this.pixelAt(event.clientX, event.clientY) ?? this.pixel);
    }
  },

  // A picture of the table becomes A; with Shift, B.
  takePicture(event) {
    const cell = event.target.closest("td"), row = cell?.closest("tr");
    if (!cell || !row) return;
    const method = [...row.parentElement.children].indexOf(row), column = [...row.children].indexOf(cell) - 1;
    this.choose(event.shiftKey ? "b" : "a", { method, column });
    this.stage.scrollIntoView({ block: "nearest" });
  },

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const pane = event.shiftKey ? "b" : "a", far = event.shiftKey ? 16 : 1, { images } = this;
    const next = (list, value) => list[(list.indexOf(value) + 1) % list.length];
    const column = (k) => k >= 0 && this.choose("a", { column: k });
    const light = (by) => this.set({ stops: Math.min(Math.max(this.stops + by, -10), 10) }, "");
    const split = (by) => ((this.split = Math.min(Math.max(this.split + by, 0), 1)), this.draw());
    const keys = {
      arrowleft: () => this.step(pane, "column", -1), arrowright: () => this.step(pane, "column", 1),
      arrowup: () => this.step(pane, "method", -1), arrowdown: () => this.step(pane, "method", 1),
      end: () => column(images.sum), home: () => column(0),
      " ": () => this.exchange(),
      v: () => this.set({ view: next(this.views, this.view), stops: 0 }, VIEWS[next(this.views, this.view)].name),
      t: () => this.set({ tone: next(Object.keys(TONES), this.tone) }, TONES[next(Object.keys(TONES), this.tone)].name),
      "+": () => light(0.5), "=": () => light(0.5), "-": () => light(-0.5), "−": () => light(-0.5), _: () => light(-0.5),
      b: () => this.set({ own: !this.own }, this.own ? "One exposure for all layers" : "Each layer brightened by itself"),
      c: () => this.set({ side: !this.side }, this.side ? "Slider" : "Side by side"),
      "[": () => split(-0.02), "]": () => split(0.02),
      z: () => this.zoomBy(Math.SQRT2), x: () => this.zoomBy(Math.SQRT1_2),
      w: () => this.movePixel(0, -far), s: () => this.movePixel(0, far), a: () => this.movePixel(-far, 0), d: () => this.movePixel(far, 0),
      r: () => this.zoomBy(1 / LARGEST_ZOOM),
      "?": () => (this.element.querySelector(".help").open ^= true),
    };
    const digit = /^[0-9]$/.test(event.key);
    const act = digit ? () => column(images.columns.findIndex((k) => k.words === `order ${event.key}`)) : keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  },

  exchange() {
    [this.a, this.b] = [this.b, this.a];
    this.update();
    this.say(`A: ${this.title("a")}. B: ${this.title("b")}.`);
  },
});

// An old browser has the pictures.
if ("DecompressionStream" in window) document.querySelectorAll(".viewer").forEach((element) => new Viewer(element));
