"use strict";
// What the page knows, and the one clock that robot, slider and curves share.
const DATA = JSON.parse(document.getElementById("data").textContent);

function unpack(text, kind) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new kind(bytes.buffer);
}
const floats = (text) => unpack(text, Float32Array);

// Index of the last entry of the rising array that is not above the value; times are packed as float32, so that
// 2.7 s as a double is before the step at 2.7 s unless it is rounded in the same way.
function indexAt(rising, value) {
  let low = 0, high = rising.length - 1;
  value = Math.fround(value);
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (rising[middle] <= value) low = middle; else high = middle - 1;
  }
  return low;
}

// A theme colour of the style sheet.
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

function isDark() {
  const chosen = document.documentElement.dataset.theme;
  return chosen ? chosen === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

// Okabe and Ito, in an order in which the first ones stand out from the ground.
const ON_LIGHT = ["#0072b2", "#d55e00", "#009e73", "#b65d92", "#56b4e9", "#c98a00", "#000000"];
const ON_DARK = ["#56b4e9", "#ff8a4c", "#2fc494", "#e09cc4", "#f0e442", "#e69f00", "#ffffff"];
const DASHES = [[], [6, 3], [6, 3, 1.5, 3], [2, 2]];
const lineColour = (i) => (isDark() ? ON_DARK : ON_LIGHT)[i % 7];

const clock = {
  t: DATA.begin, listeners: [],
  set(t) {
    this.t = Math.min(DATA.end, Math.max(DATA.begin, t));
    for (const listener of this.listeners) listener(this.t);
  },
};

// A canvas as sharp as the screen; returns its context in CSS pixels and its size.
function sharp(canvas) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return [context, width, height];
}

// Round numbers between two others, about as many as wanted.
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough)), digit = rough / power;
  const step = power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10), found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return [found, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
}

// Times of the points of every curve, by run.
const seriesTimes = DATA.runs.map((run) => floats(run.t));

// A number with so many decimals, a true minus, and no minus before zero.
const fixed = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
