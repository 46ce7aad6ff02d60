// What surrounds the stage: choices, keys and pointers, the readout, the strip.

function labelled(text, control, ...more) {
  return make("label", {}, make("span", {}, text), control, ...more);
}

// A choice among named things, those with a group under its name.
function select(name, options, on) {
  const control = make("select", { name });
  for (const { value, text, group } of options) {
    let home = control;
    if (group) {
      home = [...control.children].find((child) => child.label === group);
      if (!home) control.append((home = make("optgroup", { label: group })));
    }
    home.append(make("option", { value }, text));
  }
  control.addEventListener("change", () => on(control.value));
  return control;
}

function checkbox(name, on) {
  const control = make("input", { type: "checkbox", name });
  control.addEventListener("change", () => on(control.checked));
  return control;
}

function buildControls(viewer) {
  const { methods, columns } = viewer.images, c = (viewer.controls = {});
  const pane = (which, title) => {
    const methodOptions = methods.map((m, value) => ({ value, text: m.label }));
    const columnOptions = columns.map((k, value) => ({ value, text: k.symbol === k.words ? k.symbol : `${k.symbol}, ${k.words}`, group: k.group }));
    c[`${which}Method`] = select(`${which}-method`, methodOptions, (v) => viewer.choose(which, { method: Number(v) }));
    c[`${which}Column`] = select(`${which}-layer`, columnOptions, (v) => viewer.choose(which, { column: Number(v) }));
    const legend = make("legend", {}, title);
    return make("fieldset", { class: which }, legend, labelled("method", c[`${which}Method`]), labelled("layer", c[`${which}Column`]));
  };
  const named = (names, of) => names.map((value) => ({ value, text: of[value].name }));
  c.view = select("view", named(viewer.views, VIEWS), (view) => viewer.set({ view, stops: 0 }));
  c.tone = select("tone", named(Object.keys(TONES), TONES), (tone) => viewer.set({ tone }));
  c.stops = make("input", { type: "range", name: "exposure", min: -10, max: 10, step: 0.5 });
  c.stops.addEventListener("input", () => viewer.set({ stops: Number(c.stops.value) }));
  c.stopsOut = make("output");
  c.own = checkbox("own", (own) => viewer.set({ own }));
  c.linked = checkbox("linked", (linked) => viewer.set({ linked }));
  c.side = checkbox("side", (side) => viewer.set({ side }));
  return make(
    "div", { class: "controls" },
    pane("a", "A"), pane("b", "B"),
    make("fieldset", {}, make("legend", {}, "Shown"), labelled("view", c.view), labelled("tone map", c.tone)),
    make("fieldset", {}, make("legend", {}, "Exposure"), labelled("stops", c.stops, c.stopsOut), labelled("each layer by itself", c.own)),
    make("fieldset", {}, make("legend", {}, "Panes"), labelled("same layer in both", c.linked), labelled("side by side", c.side)),
  );
}

function buildStage(viewer) {
  viewer.canvas = make("canvas", { "aria-hidden": "true" });
  viewer.divider = make("div", { class: "divider" });
  viewer.labels = { a: make("span", { class: "label a" }), b: make("span", { class: "label b" }) };
  const name = `Images of ${viewer.images.scene}. Press the question mark for keys.`;
  viewer.stage = make("div", { class: "stage", tabindex: 0, role: "application", "aria-label": name }, viewer.canvas, viewer.divider, viewer.labels.a, viewer.labels.b);
  viewer.scale = make("div", { class: "scale", hidden: true });
  viewer.status = make("p", { role: "status", class: "unseen" });
  return make("div", { class: "frame" }, viewer.stage, viewer.scale, viewer.status);
}

function buildHelp() {
  const list = make("dl", { class: "keys" });
  for (const [key, what] of KEYS) list.append(make("dt", {}, make("kbd", {}, key)), make("dd", {}, what));
  const mouse = "Drag to pan, wheel (once the image has the focus, or with Ctrl) or pinch to zoom, drag the line to move the slider.";
  return make("details", { class: "help" }, make("summary", {}, "Keys, once the image has the focus: ← → layers, ↑ ↓ methods, ? for all"), list, make("p", { class: "note" }, mouse));
}

function buildReadout(viewer) {
  viewer.readout = make("div", { class: "readout", tabindex: 0, role: "group", "aria-label": `Values in ${viewer.images.scene}` });
  return viewer.readout;
}

function buildStrip(viewer) {
  viewer.stripBox = make("div", { class: "strip", tabindex: 0, role: "group", "aria-label": `Orders in ${viewer.images.scene} and their running sums` });
  // Some way before it is seen: an empty box at a fraction of a pixel outside the window is not in it.
  new IntersectionObserver((entries) => {
    viewer.stripSeen = entries.at(-1).isIntersecting;
    if (viewer.stripSeen) viewer.strip();
  }, { rootMargin: "200px" }).observe(viewer.stripBox);
  return make("div", { class: "series" }, viewer.stripBox);
}

Object.assign(Viewer.prototype, {
  showControls() {
    const c = this.controls;
    for (const pane of ["a", "b"]) {
      c[`${pane}Method`].value = this[pane].method;
      c[`${pane}Column`].value = this[pane].column;
      this.labels[pane].hidden = !this.panes().includes(pane);
    }
    Object.assign(c.view, { value: this.view });
    Object.assign(c.tone, { value: this.tone, disabled: Boolean(VIEWS[this.view].number) });
    Object.assign(c.stops, { value: this.stops });
    c.stopsOut.textContent = `${this.stops < 0 ? "−" : "+"}${Math.abs(this.stops)}`;
    for (const name of ["own", "linked", "side"]) c[name].checked = this[name];
    this.stage.classList.toggle("side", this.side && this.panes().length === 2);
    const { width, height } = this.images;
    this.stage.style.aspectRatio = `${this.side && this.panes().length === 2 ? 2 * width : width} / ${height}`;
  },

  // The bar of a false colour, or a line on how much the pictures are brightened.
  showScale(shown) {
    for (const pane of this.panes()) {
      const { image, stops } = this[pane];
      const without = image === undefined ? "…" : !image ? "no such layer" : !this.canShow(pane) ? "not known" : null;
      const factor = VIEWS[this.view].number || this.tone === "colours" ? "" : ` ${exposure(stops ?? 0)}`;
      const text = this.view === "difference" ? `${this.title("a")} − ${this.title("b")}` : this.title(pane);
      this.labels[pane].textContent = `${text}${without ? ` (${without})` : factor}`;
    }
    const view = VIEWS[this.view], coloured = (view.number || this.tone === "colours") && shown.length > 0;
    this.scale.hidden = !coloured;
    if (!coloured) return;
    const same = shown.every((pane) => this[pane].stops === this[shown[0]].stops);
    const map = view.signed ? MAPS.diverging : MAPS.viridis;
    const steps = Array.from({ length: 33 }, (_, i) => `rgb(${map.slice(4 * Math.round((i / 32) * 1023)).slice(0, 3).join(" ")})`);
    const bars = (same ? shown.slice(0, 1) : shown).map((pane) => {
      const top = 2 ** -this[pane].stops, ticks = view.signed ? [-1, -0.5, 0, 0.5, 1] : [0, 0.25, 0.5, 0.75, 1];
      const bar = make("div", { class: "bar" });
      bar.style.background = `linear-gradient(90deg, ${steps.join(", ")})`;
      const unit = view.unit ?? UNIT, text = (t) => (view.unit ? `${short(100 * t * top)} %` : short(t * top));
      const labels = make("div", { class: "ticks" }, ...ticks.map((t) => make("span", {}, text(t))));
      return make("div", {}, bar, labels, make("small", {}, `${same ? "" : `${this.title(pane)}: `}${view.name}, mean of channels, ${unit}`));
    });
    this.scale.replaceChildren(...bars);
  },

  // The pixel's values, with the ends of their 95 % intervals.
  values(pane) {
    const { image, method } = this[pane], [x, y] = this.pixel, i = 3 * (y * this.images.width + x);
    const half = (c) => (image.error ? this.images.methods[method].quantile * image.error[i + c] : null);
    return image && [0, 1, 2].map((c) => ({ value: image.mean[i + c], half: half(c), error: image.error?.[i + c] }));
  },

  difference(a, b) {
    // With the wider quantile of both the interval holds at least as often as Welch's.
    const quantile = Math.max(...["a", "b"].map((pane) => this.images.methods[this[pane].method].quantile));
    return a.map((of, c) => {
      const known = of.half !== null && b[c].half !== null;
      return { value: of.value - b[c].value, half: known ? quantile * Math.hypot(of.error, b[c].error) : null };
    });
  },

  read(aloud = false) {
    if (!this.pixel) {
      const hint = "Values appear here for the pixel under the pointer, or the one that w a s d move to.";
      this.readout.replaceChildren(make("p", { class: "note" }, hint));
      return;
    }
    const [x, y] = this.pixel, { shrink } = this.images;
    const rows = ["a", "b"].filter((pane) => this[pane].image).map((pane) => [pane.toUpperCase(), this.title(pane), this.values(pane)]);
    const same = this.a.method === this.b.method && this.a.column === this.b.column;
    if (rows.length === 2 && !same && this.a.method !== this.b.method) {
      rows.push(["A − B", "", this.difference(rows[0][2], rows[1][2])]);
    }
    const place = shrink > 1 ? `Mean of ${shrink} × ${shrink} pixels from (${x * shrink}, ${y * shrink}) on` : `Pixel (${x}, ${y})`;
    const interval = ({ value, half }) => `[${short(value - half)}, ${short(value + half)}]`;
    const cell = (v, c) => {
      const number = make("data", { value: v.value, "data-channel": "rgb"[c] }, short(v.value));
      return make("td", { class: "number" }, number, ...(v.half === null ? [] : [make("small", {}, interval(v))]));
    };
    const head = make("tr", {}, ...["", "red", "green", "blue"].map((name) => make(name ? "th" : "td", name ? { scope: "col", class: "number" } : {}, name)));
    const row = ([name, title, values]) => make("tr", { "data-row": name }, make("th", { scope: "row" }, name, make("small", {}, make("bdi", {}, title))), ...values.map(cell));
    const atLeast = [this.a, this.b].some((pane) => pane.image?.bound) || shrink > 1;
    const note = `${UNIT}, with ${atLeast ? "intervals of at least 95 %: how the errors of orders go together is not known pixel by pixel, so they are added up" : "95 % intervals"}`;
    const table = make("table", {}, make("caption", {}, make("strong", {}, place), make("small", {}, note)), make("thead", {}, head), make("tbody", {}, ...rows.map(row)));
    this.readout.replaceChildren(table);
    if (!aloud) return;
    const spoken = ([name, title, values]) => `${name} ${title}: ${values.map((v, c) => `${["red", "green", "blue"][c]} ${short(v.value)}${v.half === null ? "" : ` from ${short(v.value - v.half)} to ${short(v.value + v.half)}`}`).join(", ")}`;
    this.say(`${place}. ${rows.map(spoken).join(". ")}.`);
  },

  // Every order beside the sum up to it, by the method of A.
  async strip() {
    const { images, a } = this, { own, tone, stops } = this;
    const key = [a.method, own, tone, stops].join();
    if (!this.stripSeen || this.stripKey === key) return;
    this.stripKey = key;
    const curve = TONES[tone].curve;
    const terms = images.columns.map((_, k) => k).filter((k) => k < images.sum && images.has(a.method, k));
    const rows = [["order", (k) => images.image(a.method, k), (k) => (own ? k : images.sum)], ["sum up to it", (k) => images.running(a.method, k), () => images.sum]];
    const made = await Promise.all(rows.map(async ([name, get, exposed]) => {
      const cells = await Promise.all(terms.map(async (k) => {
        const canvas = make("canvas", { width: images.width, height: images.height, "aria-hidden": "true" });
        const pixels = new ImageData(images.width, images.height), { mean } = await get(k);
        const by = (images.columns[exposed(k)].stops ?? 0) + stops;
        if (curve) paintColours(pixels.data, mean, 2 ** by, curve);
        else paintNumbers(pixels.data, images.n, (i) => average(mean, i), 2 ** by, MAPS.viridis, false);
        canvas.getContext("2d").putImageData(pixels, 0, 0);
        const symbol = images.columns[k].symbol, words = name === "order" ? symbol : k ? `E … ${symbol}` : "E";
        const button = make("button", { type: "button", title: "show the order" }, canvas, make("span", {}, words), " ", make("small", {}, exposure(by)));
        button.addEventListener("click", () => this.choose("a", { column: k }));
        return make("td", {}, button);
      }));
      return make("tr", {}, make("th", { scope: "row" }, name), ...cells);
    }));
    if (this.stripKey !== key) return;
    const caption = make("caption", {}, "The series of ", make("bdi", {}, images.methods[a.method].label), ": each order, and below it the sum of all orders up to it");
    this.stripBox.replaceChildren(make("table", {}, caption, make("tbody", {}, ...made)));
  },
});
