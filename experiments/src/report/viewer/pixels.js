// Linear values: how layers are unpacked and added up, and how values become colours and words.

const STEPS = 8; // of a standard error in an octave, as packing.rs has it

// All half floats.
const HALF = Float32Array.from({ length: 65536 }, (_, bits) => {
  const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return exponent ? sign * (1 + fraction / 1024) * 2 ** (exponent - 15) : sign * fraction * 2 ** -24;
});

async function inflate(text) {
  const binary = atob(text), bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// An image of n pixels: means, and standard errors where they are known, red, green, blue by turns. `bound` says that the true
// standard errors may be smaller.
function blank(n, known) {
  return { mean: new Float32Array(3 * n), error: known ? new Float32Array(3 * n) : null, bound: false };
}

async function unpack(layer, text, n) {
  const image = blank(n, layer.largest_error !== null);
  if (text === undefined) return image;
  const raw = await inflate(text);
  const errors = Float32Array.from({ length: 256 }, (_, code) => code && 2 ** (layer.largest_error + (code - 255) / STEPS));
  for (let i = 0; i < n; i++) {
    for (let c = 0, code = 0, error = 0; c < 3; c++) {
      const at = c * n + i;
      code = (code + raw[at] + 256 * raw[3 * n + at]) & 65535;
      image.mean[3 * i + c] = HALF[code] * layer.scale;
      if (image.error) {
        error = (error + raw[6 * n + at]) & 255;
        image.error[3 * i + c] = errors[error];
      }
    }
  }
  return image;
}

// Means add up. How the orders' errors go together is not known pixel by pixel: at worst they add up as well.
function added(images, n) {
  if (images.length === 1) return images[0];
  const sum = blank(n, images.every((image) => image.error));
  sum.bound = true;
  for (const { mean, error } of images) {
    for (let i = 0; i < 3 * n; i++) {
      sum.mean[i] += mean[i];
      if (sum.error) sum.error[i] += error[i];
    }
  }
  return sum;
}

// The images of one scene, unpacked when they are first asked for.
class Images {
  constructor(element) {
    Object.assign(this, JSON.parse(element.dataset.images));
    this.texts = Array.from(element.querySelectorAll("template"), (template) => template.content.textContent);
    this.n = this.width * this.height;
    this.known = new Map();
  }

  // The layers that a column shows: the sum is that of all terms before it.
  layers(method, column) {
    const all = this.methods[method].layers;
    const own = all.filter((layer) => layer.column === column);
    return own.length || column !== this.sum ? own : all.filter((layer) => layer.column < this.sum);
  }

  has(method, column) {
    return this.layers(method, column).length > 0;
  }

  image(method, column) {
    return this.remembered(`${method} ${column}`, () => this.layers(method, column));
  }

  // The sum of all terms up to a column.
  running(method, column) {
    const upTo = (layer) => layer.column <= column;
    return this.remembered(`${method} up to ${column}`, () => this.methods[method].layers.filter(upTo));
  }

  remembered(key, layers) {
    if (!this.known.has(key)) this.known.set(key, this.sumOf(layers()));
    return this.known.get(key);
  }

  async sumOf(layers) {
    if (!layers.length) return null;
    const one = (layer) => {
      const key = `layer ${layer.at}`;
      if (layer.at === null) return unpack(layer, undefined, this.n);
      if (!this.known.has(key)) this.known.set(key, unpack(layer, this.texts[layer.at], this.n));
      return this.known.get(key);
    };
    return added(await Promise.all(layers.map(one)), this.n);
  }
}

// The value of a pixel, averaged over the channels, by what is looked at.
const average = (values, i) => (values[3 * i] + values[3 * i + 1] + values[3 * i + 2]) / 3;

// A power of two that brings 95 % of the lit values below 0.8.
function stopsFor(value, n) {
  const lit = [];
  for (let i = 0, step = Math.max(1, Math.floor(n / 8192)); i < n; i += step) {
    const x = Math.abs(value(i));
    if (x > 0 && x < Infinity) lit.push(x);
  }
  lit.sort((a, b) => a - b);
  return lit.length ? Math.round(Math.log2(0.8 / lit[Math.floor((lit.length - 1) * 0.95)])) : null;
}

// Viridis [Smith & van der Walt 2015] at sixteenths.
const VIRIDIS = "440154481a6c472f7d41448739568c31688e2a788e23888e1f988b22a88435b77954c5687ad151a5db36d2e21bfde725";
// Below zero blue, above orange, nothing black: brightness is size, and the two are apart for every kind of colour vision.
const DIVERGING = "d9efff6cb8ff1f78d80b3d7a0a0c107a3c06d8730fffae52fff0d9";
const NOT_FINITE = [255, 0, 255];

// A map as 1024 colours of four bytes.
function colours(anchors) {
  const stops = anchors.match(/.{6}/g).map((hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  return Uint8ClampedArray.from({ length: 4096 }, (_, i) => {
    if (i % 4 === 3) return 255;
    const place = ((i >> 2) / 1023) * (stops.length - 1), k = Math.min(Math.floor(place), stops.length - 2);
    return stops[k][i % 4] + (place - k) * (stops[k + 1][i % 4] - stops[k][i % 4]);
  });
}

const MAPS = { viridis: colours(VIRIDIS), diverging: colours(DIVERGING) };
const CURVE = Uint8ClampedArray.from({ length: 8193 }, (_, i) => {
  const x = i / 8192;
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
});
const srgb = (x) => CURVE[x <= 0 ? 0 : x >= 1 ? 8192 : (x * 8192 + 0.5) | 0];

// From linear light to what the sRGB curve is put on.
const TONES = {
  srgb: { name: "sRGB, clipped", curve: (x) => x },
  filmic: { name: "filmic (ACES-like)", curve: (x) => (x <= 0 ? 0 : (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)) },
  reinhard: { name: "Reinhard, x / (1 + x)", curve: (x) => (x <= 0 ? 0 : x / (1 + x)) },
  colours: { name: "false colour (viridis)", curve: null },
};

// Paints colours of three channels.
function paintColours(data, values, factor, curve) {
  for (let i = 0, o = 0; i < values.length; i += 3, o += 4) {
    const r = values[i], g = values[i + 1], b = values[i + 2];
    const finite = Number.isFinite(r + g + b);
    data[o] = finite ? srgb(curve(r * factor)) : NOT_FINITE[0];
    data[o + 1] = finite ? srgb(curve(g * factor)) : NOT_FINITE[1];
    data[o + 2] = finite ? srgb(curve(b * factor)) : NOT_FINITE[2];
    data[o + 3] = 255;
  }
}

// Paints numbers by a map; `signed` puts zero in its middle.
function paintNumbers(data, n, value, factor, map, signed) {
  for (let i = 0, o = 0; i < n; i++, o += 4) {
    const x = value(i) * factor;
    const place = Math.min(Math.max(signed ? 0.5 + x / 2 : x, 0), 1);
    const at = 4 * Math.round(place * 1023);
    for (let c = 0; c < 3; c++) data[o + c] = Number.isFinite(x) ? map[at + c] : NOT_FINITE[c];
    data[o + 3] = 255;
  }
}

// Three digits, as the page's tables have them.
function short(x) {
  if (!Number.isFinite(x)) return "—";
  if (x === 0) return "0";
  const exponent = Math.floor(Math.log10(Math.abs(x)));
  if (exponent >= -3 && exponent < 5) {
    const unit = 10 ** (exponent - 2);
    const rounded = exponent > 2 ? Math.round(x / unit) * unit : x;
    return rounded.toFixed(Math.max(0, 2 - exponent)).replace("-", "−");
  }
  const digits = [...String(exponent)].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));
  return `${(x / 10 ** exponent).toFixed(2)}·10${digits.join("")}`.replace("-", "−");
}

// `×4`, `×1/16`.
const exposure = (stops) => {
  const factor = (x) => (Number.isInteger(x) ? String(2 ** x) : short(2 ** x));
  return stops >= 0 ? `×${factor(stops)}` : `×1/${factor(-stops)}`;
};

// An element; text stays text.
function make(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...content);
  return element;
}
